"""Makes docs/frames.png: of each scene family the first frame, seen from the front, that hides a fair part.

python tools/readme_picture.py [--seed 5] [--out docs/frames.png]
"""

import argparse
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from pipelines.ablate.config import paper_scenes
from pipelines.drawing.frames import contact_sheet
from synth.frame import Frame
from synth.scene import FrameSource, SceneWeights

FAMILIES = ("laptop_table", "table", "stroller", "laptop_lap", "clutter", "several")


def first_fitting(family: str, seed: int) -> Frame:
    """The first frame of a family that a picture can show well: 40-85 % seen, a body at least 190 px high."""
    weights = SceneWeights(*[float(name == family) for name in SceneWeights.names()])
    shown = {"visible_share": (0.4, 0.85), "distance": (1.8, 3.0), "azimuth": (-1.6, 1.6)}
    config = replace(paper_scenes(), scenes=weights, **shown)
    for frame in FrameSource(config, seed, 200):
        rows = np.flatnonzero((frame.body_part > 0).any(axis=1))
        is_whole = (frame.joint_state != 3).all()
        if len(rows) >= 190 and is_whole:
            return frame
    raise RuntimeError(f"no fitting frame of {family!r} with seed {seed}")


def main() -> None:
    """Writes the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--out", type=Path, default=Path("docs/frames.png"))
    options = parser.parse_args()
    sheet = contact_sheet([first_fitting(family, options.seed) for family in FAMILIES], n_across=1)
    cv2.imwrite(str(options.out), cv2.resize(sheet, None, fx=0.8, fy=0.8, interpolation=cv2.INTER_AREA))


if __name__ == "__main__":
    main()
