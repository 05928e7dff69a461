"""Makes docs/rooms.png: a living room, an office and a hall with several people; depth as a Kinect v2 measures it.

python tools/rooms_picture.py [--seed 4] [--sensor kinect_v2] [--out docs/rooms.png]
"""

import argparse
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from pipelines.drawing.rooms import room_sheet
from synth.frame import RoomFrame
from synth.render.sensors import apply_sensor
from synth.scene import RoomSource, SceneConfig
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights
from synth.vocabulary import JointState

KINDS = ("living", "office", "hall")
N_TRIED = 60


def first_fitting(kind: str, seed: int) -> RoomFrame:
    """The first frame of a kind that shows at least three people well, one of them partly hidden by another."""
    config = SceneConfig(
        room=RoomConfig(kinds=RoomWeights(**{kind: 1.0})), people=PeopleConfig(number=(3, 5)), height=(1.3, 2.0)
    )
    for frame in RoomSource(config, seed, N_TRIED):
        heights = [view.box[3] for view, one in zip(frame.people, frame.info.people, strict=True)
                   if one.visible_fraction > 0.3]  # fmt: skip
        is_hidden = any((view.joint_state == JointState.OCCLUDED_BY_PERSON).any() for view in frame.people)
        if len(heights) >= 3 and min(heights) > 120 and max(heights) < 330 and is_hidden:
            return frame
    raise RuntimeError(f"no fitting frame of kind {kind!r} with seed {seed}")


def measured(frame: RoomFrame, sensor: str) -> RoomFrame:
    """The frame with a sensor's depth."""
    rng = np.random.default_rng(frame.info.index)
    return replace(frame, depth=apply_sensor(sensor, frame.depth, frame.camera, rng))


def main() -> None:
    """Writes the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=4)
    parser.add_argument("--sensor", default="kinect_v2")
    parser.add_argument("--out", type=Path, default=Path("docs/rooms.png"))
    options = parser.parse_args()
    frames = [measured(first_fitting(kind, options.seed), options.sensor) for kind in KINDS]
    cv2.imwrite(str(options.out), room_sheet(frames))


if __name__ == "__main__":
    main()
