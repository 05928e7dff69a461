"""Images a second of clips and of several cameras, written to disk, on one core.

python benchmarks/bench_clips.py [--images 480] [--turns 2]
"""

import argparse
import tempfile
import time
from pathlib import Path

from pipelines.corpus import Order, write_corpus
from pipelines.generation.drawn import drawn_order, whole_frames
from synth.scene import ClipSource, SceneConfig
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights

ROOMS = RoomConfig(kinds=RoomWeights(1.0, 1.0, 1.0))
TWO = PeopleConfig(number=(2, 2))
ROWS = {
    "four views of a room with two people": SceneConfig(room=ROOMS, people=TWO, cameras=4),
    "one view of it": SceneConfig(room=ROOMS, people=TWO),
    "four views of one person cut out": SceneConfig(cameras=4),
    "one view of it ": SceneConfig(),
    "clips of 60 steps, two people in a room": SceneConfig(room=ROOMS, people=TWO, clip=60),
    "the same by four cameras": SceneConfig(room=ROOMS, people=TWO, clip=60, cameras=4),
}


def seconds_of(order: Order) -> tuple[float, float]:
    """CPU seconds of drawing the frames of an order, and of writing them too."""
    source = order.make_source()
    start = time.process_time()
    for index in range(order.n_frames):
        source.frame(index)
    drawn = time.process_time() - start
    with tempfile.TemporaryDirectory() as folder:
        start = time.process_time()
        write_corpus(Path(folder) / "corpus", order)
        return drawn, time.process_time() - start


def main() -> None:
    """Runs the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--images", type=int, default=480)
    parser.add_argument("--turns", type=int, default=2)
    options = parser.parse_args()
    for scene in ROWS.values():  # compiles everything
        seconds_of(drawn_order(scene, 99, scene.frames_a_scene))
    for turn in range(options.turns):
        for name, scene in ROWS.items():
            n = whole_frames(scene, options.images)
            drawn, written = seconds_of(drawn_order(scene, turn, n))
            print(f"{name.strip()}: {n / drawn:.0f} images/s drawn, {n / written:.0f} written", flush=True)
        source = ClipSource(ROWS["clips of 60 steps, two people in a room"], turn, 600)
        start = time.process_time()
        for k in range(7):
            source.clip("train", k)
        print(f"a clip planned: {(time.process_time() - start) / 7:.2f} s", flush=True)


if __name__ == "__main__":
    main()
