"""Animated pictures of three clips of 10 s for docs/clips.md: depth as a Kinect v2 measures it, and people in colour.

python tools/clips_pictures.py [--out docs]
"""

import argparse
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from pipelines.drawing import palette
from pipelines.inspect.strips import people_over_depth
from synth.frame import RoomFrame
from synth.render.sensors import apply_sensor
from synth.scene import ClipSource, SceneConfig
from synth.scene.clips.config import ActWeights, CameraMoves
from synth.scene.config import SplitShares
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights

FPS = 10
STEPS = 100
SIZE = (256, 212)
KINDS = {"living": (23, 3), "office": (21, 4), "hall": (47, 4)}
"""Seed and number of people by kind of room."""


def source_of(kind: str) -> ClipSource:
    """One clip of 10 s in a room of a kind."""
    seed, number = KINDS[kind]
    config = SceneConfig(
        room=RoomConfig(kinds=RoomWeights(**{kind: 1.0})),
        people=PeopleConfig(number=(number, number)),
        splits=SplitShares(1.0, 0.0, 0.0),
        clip=STEPS,
        fps=float(FPS),
        acts=ActWeights(walk=0.5, talk=0.15, sit=0.35),
        camera_moves=CameraMoves(stand=1.0, pan=0.0, drive=0.0),
    )
    return ClipSource(config, seed, STEPS)


def picture(frame: RoomFrame, index: int) -> Image.Image:
    """Depth with noise on the left, people in colour on the right."""
    rng = np.random.default_rng([7, index])
    noisy = apply_sensor("kinect_v2", frame.depth, frame.camera, rng)
    sensed = palette.depth_colours(noisy, 800.0, 6500.0)
    both = [cv2.resize(image, SIZE, interpolation=cv2.INTER_AREA) for image in (sensed, people_over_depth(frame))]
    return Image.fromarray(np.ascontiguousarray(np.hstack(both)[..., ::-1]))


def main() -> None:
    """Writes the pictures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("docs"))
    options = parser.parse_args()
    for kind in KINDS:
        source = source_of(kind)
        frames = [picture(source.frame(k), k) for k in range(STEPS)]
        path = options.out / f"clip_{kind}.webp"
        frames[0].save(
            path, save_all=True, append_images=frames[1:], duration=1000 // FPS, loop=0, quality=32, method=4
        )
        print(f"{path}: {path.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
