"""Whole scenes a second on one core, from drawing the room to the written shard, beside frames of one person.

CPU time counts, so that other programs on the machine disturb little. Frames of the default scenes, which show one
person cut out, are written by turns with rooms in the same run; the ratio is the more reliable figure.

    python benchmarks/bench_rooms.py [--frames 640] [--people 2] [--turns 2]
    python benchmarks/bench_rooms.py --profile             # where the time of rooms goes
"""

import argparse
import cProfile
import pstats
import tempfile
import time
from pathlib import Path

from pipelines.corpus import Order, write_corpus
from pipelines.generation.drawn import drawn_order
from synth.scene import SceneConfig
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights

STAGES = (
    ("subjects built", "pools.py", "_make_subject"),
    ("rooms built", "cast.py", "_make"),
    ("groups drawn (subjects included)", "groups.py", "draw_group"),
    ("groups placed (groups included)", "arrange.py", "gather"),
    ("rendering", "rooms.py", "render_room"),
    ("visibility", "among.py", "measure_person"),
    ("frames in all (drawn and rendered)", "source.py", "frame"),
    ("maps encoded", "shards.py", "encode_maps"),
    ("hidden layers", "layers.py", "hidden_layers"),
    ("records written as JSON", "frameinfo.py", "info_line"),
)


def rooms_order(n_frames: int, n_people: int, seed: int) -> Order:
    """Rooms of all kinds with so many people, 512x424."""
    scene = SceneConfig(
        room=RoomConfig(kinds=RoomWeights(living=1.0, office=1.0, hall=1.0)),
        people=PeopleConfig(number=(n_people, n_people)),
    )
    return drawn_order(scene, seed, n_frames)


def written(order: Order) -> tuple[float, int]:
    """CPU seconds of writing a corpus, and its bytes."""
    with tempfile.TemporaryDirectory() as folder:
        start = time.process_time()
        write_corpus(Path(folder) / "corpus", order)
        seconds = time.process_time() - start
        return seconds, sum(path.stat().st_size for path in Path(folder).rglob("*") if path.is_file())


def profiled(order: Order) -> None:
    """Prints the time of each stage of writing a corpus."""
    profile = cProfile.Profile()
    with tempfile.TemporaryDirectory() as folder:
        profile.runcall(write_corpus, Path(folder) / "corpus", order)
    stats = pstats.Stats(profile)
    rows = stats.stats.items()  # type: ignore[attr-defined]
    total = stats.total_tt  # type: ignore[attr-defined]
    print(f"under the profiler: {1000 * total / order.n_frames:.2f} ms a frame, of it")
    for label, file, function in STAGES:
        seconds = sum(row[3] for (path, _, name), row in rows if name == function and path.endswith(file))
        print(f"  {label:36} {1000 * seconds / order.n_frames:6.2f} ms {seconds / total:6.1%}")


def main() -> None:
    """Runs the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=640)
    parser.add_argument("--people", type=int, default=2)
    parser.add_argument("--turns", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--profile", action="store_true")
    options = parser.parse_args()
    n = options.frames
    for warm in (rooms_order(60, options.people, 99), drawn_order(SceneConfig(), 99, 60)):  # loads kernels
        written(warm)
    if options.profile:
        profiled(rooms_order(n, options.people, options.seed))
        return
    for turn in range(options.turns):
        seed = options.seed + turn
        rooms, n_bytes = written(rooms_order(n, options.people, seed))
        single, _ = written(drawn_order(SceneConfig(), seed, n))
        print(
            f"{options.people} people in a room: {n / rooms:.1f} frames/s ({1000 * rooms / n:.2f} ms, "
            f"{n_bytes / n / 1000:.0f} kB a frame); one person cut out: {n / single:.1f} frames/s "
            f"({1000 * single / n:.2f} ms); ratio {rooms / single:.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
