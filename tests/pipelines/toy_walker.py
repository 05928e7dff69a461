"""A toy recording: a person of balls along the bones who walks before a tilted camera, as PNG and joint files."""

import json

import cv2
import numpy as np

from pipelines.commands.importing.depth import DepthSettings
from pipelines.generation.writing import write_shown
from pipelines.recordings.poses import camera_pose
from synth.camera import Camera
from synth.geometry import inverse, transform_points
from synth.vocabulary import BONES, JOINT_NAMES

CAMERA = Camera(160, 120, 142.0, 142.0, 79.5, 59.5)
HEIGHT_M, TILT_DEG = 1.0, 4.0
BALL_M = 0.06
NAMES = list(JOINT_NAMES)
LAYOUT = """
recognised_by = []
files = "d_*.png"
format = "png"
width = 160
height = 120
camera = {{ fx = 142.0, fy = 142.0, cx = 79.5, cy = 59.5{pose} }}
"""
ANNOTATION = """
[annotation]
files = "j_{{}}.txt"
names = {names}
joints = {{ {joints} }}
"""


def walking(number):
    """(15, 3) joints in a world whose z is 0 on the floor and x away from the camera [m]; both arms swing."""
    height = {"head": 1.6, "neck": 1.45, "torso": 1.2, "shoulder": 1.4, "hip": 0.9, "knee": 0.5, "foot": BALL_M}
    aside = {"shoulder": 0.18, "hip": 0.1, "knee": 0.12, "foot": 0.14}
    swing = 0.5 * np.sin(number)
    arm = {"elbow": (0.22, 1.15), "hand": (0.25, 0.95)}
    centre = np.array([2.6 + 0.5 * np.sin(0.4 * number), 0.4 * np.cos(0.7 * number), 0.0])
    out = []
    for name in JOINT_NAMES:
        side, _, kind = name.rpartition("_")
        sign = {"r": 1.0, "l": -1.0, "": 0.0}[side]  # who faces the camera has the right where y is positive
        if kind in arm:
            y, z = arm[kind]
            out.append((sign * swing * (0.4 if kind == "elbow" else 1.0), sign * y, z))
        else:
            out.append((0.0, sign * aside.get(kind, 0.0), height[kind]))
    return np.array(out) + centre


def painted(joints):
    """(120, 160) uint16 [mm]: balls of 6 cm, 14 cm along the trunk, seen by the camera.

    Args:
        joints: (15, 3) camera frame [m].
    """
    trunk = {"head", "neck", "torso", "r_hip", "l_hip", "r_shoulder", "l_shoulder"}
    depth = np.full((CAMERA.height, CAMERA.width), np.inf)
    v, u = np.indices(depth.shape)
    for a, b in BONES:
        radius = 0.11 if {JOINT_NAMES[a], JOINT_NAMES[b]} <= trunk else BALL_M
        for share in np.linspace(0.0, 1.0, 12):
            ball = (1.0 - share) * joints[a] + share * joints[b]
            centre = CAMERA.project(ball)
            square = ((u - centre[0]) ** 2 + (v - centre[1]) ** 2) * (ball[2] / CAMERA.fx) ** 2
            depth = np.minimum(
                depth,
                np.where(square < radius**2, ball[2] - np.sqrt(radius**2 - square.clip(0, radius**2)), np.inf),
            )
    return np.where(np.isfinite(depth), np.round(1000.0 * depth), 0).astype(np.uint16)


def write_recording(folder, n_frames=24, known=NAMES, pose=""):
    """Writes frames and a layout.

    Args:
        folder: Where to.
        n_frames: How many.
        known: Joints that the layout names.
        pose: Camera pose for the layout, as ", height_m = 1.0".

    Returns:
        The layout's path as text.
    """
    T_camera_world = inverse(camera_pose(HEIGHT_M, TILT_DEG))
    for number in range(n_frames):
        joints = transform_points(T_camera_world, walking(number))
        cv2.imwrite(str(folder / f"d_{number}.png"), painted(joints))
        np.savetxt(folder / f"j_{number}.txt", joints)
    text = LAYOUT.format(pose=pose)
    if known:
        text += ANNOTATION.format(
            names=json.dumps(NAMES), joints=", ".join(f'{name} = "{name}"' for name in known)
        )
    (folder / "layout.toml").write_text(text)
    return str(folder / "layout.toml")


def import_recording(folder, out, layout, splits="train=0.5,val=0.25,test=0.25"):
    """Imports the frames into a corpus."""
    write_shown(out, DepthSettings(folder, out, layout, splits=splits).order()[1])
    return out
