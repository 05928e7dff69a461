"""A made-up recording: somebody of discs and lines who walks to the image's right, with joints in text files."""

import json

import cv2
import numpy as np

from pipelines.commands.importing.depth import DepthSettings
from pipelines.corpus import Corpus
from pipelines.generation.writing import write_shown
from pipelines.recordings.bones import bones_of
from pipelines.recordings.layout import known_layouts
from synth.camera import Camera
from synth.vocabulary import JOINT_NAMES

CAMERA = Camera(64, 48, 60.0, 60.0, 31.5, 23.5)
NAMES = list(known_layouts()["itop"].annotation.names)
LAYOUT = """
recognised_by = []
files = "d_*.{format}"
format = "{format}"
width = 64
height = 48
camera = {{ fx = 60.0, fy = 60.0, cx = 31.5, cy = 23.5 }}
"""
ANNOTATION = """
[annotation]
files = "j_{{}}.txt"
y_up = true
names = {names}
joints = {{ {joints} }}
"""


def standing(x_m=0.0):
    """(15, 3) joints of somebody who faces the camera at 2 m [m]; their right is on the image's left."""
    by_name = {
        "head": (0, -0.6), "neck": (0, -0.4), "torso": (0, -0.1), "shoulder": (0.18, -0.35), "elbow": (0.4, -0.35),
        "hand": (0.6, -0.35), "hip": (0.1, 0.15), "knee": (0.12, 0.45), "foot": (0.14, 0.7),
    }  # fmt: skip
    out = []
    for name in JOINT_NAMES:
        x, y = by_name[name.removeprefix("r_").removeprefix("l_")]
        out.append((-x if name.startswith("r_") else x, y, 2.0))
    return np.array(out) + np.array([x_m, 0.0, 0.0])


def silhouette(joints):
    """(48, 64) uint16 [mm]: discs along all bones, 5 cm before them."""
    image = np.zeros((48, 64), np.uint8)
    bones = bones_of(joints)
    for start, end in zip(CAMERA.project(bones.start), CAMERA.project(bones.end), strict=True):
        cv2.line(image, [round(v) for v in start], [round(v) for v in end], 1, 4)
    return (image * np.uint16(1950)).astype(np.uint16)


def write_layout(folder, format="png", joints=None):
    used = NAMES if joints is None else joints
    text = LAYOUT.format(format=format)
    if used:
        text += ANNOTATION.format(names=json.dumps(NAMES), joints=", ".join(f'{n} = "{n}"' for n in used))
    (folder / "layout.toml").write_text(text)
    return str(folder / "layout.toml")


def write_recording(out, n=10):
    """So many frames, numbered so that names do not sort as numbers do."""
    out.mkdir()
    for number in range(n):
        joints = standing(0.01 * number)
        cv2.imwrite(str(out / f"d_{number + 5}.png"), silhouette(joints))
        theirs = joints[[JOINT_NAMES.index(name) for name in NAMES]] * [1, -1, 1]
        np.savetxt(out / f"j_{number + 5}.txt", theirs)
    return out


def imported(folder, layout, out=None, **settings):
    """The corpus of a recording, beside it where nothing else is said."""
    out = folder.parent / "corpus" if out is None else out
    order = DepthSettings(folder, out, layout, **settings).order()[1]
    write_shown(out, order)
    return Corpus.open(out)
