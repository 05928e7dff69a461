"""What heat map nets learn from: patches of people, and where their joints lie in them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.boxes import upper_body_box
from forests.frames import DepthFrame, FrameSequence, Pinhole, is_known
from nets.heatmap.config import HeatmapConfig
from nets.patches import Patch, Window, body_window, cut_patch
from nets.views import View


class JointPatches(NamedTuple):
    """Patches of n frames, and their joints.

    Attributes:
        relative: (n, height, width) int16, see `nets.patches.Patch`.
        kind: (n, height, width) uint8.
        place: (n, n_joints, 2) float32, row and column in the patch [px]; NaN = unknown.
        depth: (n, n_joints) float32, of the joint minus the person's distance [m]; NaN = unknown.
        is_hidden: (n, n_joints) bool, an object hides the joint.
        is_outside: (n, n_joints) bool, the joint is not in the image.
    """

    relative: NDArray[np.int16]
    kind: NDArray[np.uint8]
    place: NDArray[np.float32]
    depth: NDArray[np.float32]
    is_hidden: NDArray[np.bool_]
    is_outside: NDArray[np.bool_]


def to_patch(joints: NDArray[np.floating], camera: Pinhole, window: Window, view: View) -> NDArray[np.float64]:
    """(n, 3) row and column in the patch [px] and depth minus the person's distance [m] of joints.

    Args:
        joints: (n, 3) camera frame [m].
        camera: Intrinsics.
        window: Where the patch was cut.
        view: What is looked at.
    """
    x, y, z = np.asarray(joints, np.float64).T
    z = np.maximum(z, 0.05)
    height, width = view.patch
    # A pixel of the patch is pixel_m * f / distance pixels of the image.
    column = (camera.fx * x / z + camera.cx - window.u) * window.distance / (camera.fx * view.pixel_m)
    row = (camera.fy * y / z + camera.cy - window.v) * window.distance / (camera.fy * view.pixel_m)
    return np.stack([row + (height - 1) / 2.0, column + (width - 1) / 2.0, z - window.distance], axis=1)


def from_patch(places: NDArray[np.floating], camera: Pinhole, window: Window, view: View) -> NDArray[np.float64]:
    """(..., 3) joints, camera frame [m], out of rows and columns in the patch [px] and depths [m]; undoes `to_patch`.

    Args:
        places: (..., 3).
        camera: Intrinsics.
        window: Where the patch was cut.
        view: What is looked at.
    """
    row, column, depth = np.moveaxis(np.asarray(places, np.float64), -1, 0)
    height, width = view.patch
    u = window.u + (column - (width - 1) / 2.0) * view.pixel_m * camera.fx / window.distance
    v = window.v + (row - (height - 1) / 2.0) * view.pixel_m * camera.fy / window.distance
    z = depth + window.distance
    return np.stack([(u - camera.cx) * z / camera.fx, (v - camera.cy) * z / camera.fy, z], axis=-1)


def collect_patches(frames: FrameSequence, config: HeatmapConfig) -> JointPatches:
    """Cuts the patches of all frames of which a joint is known and something is seen.

    Args:
        frames: The frames.
        config: How the net is trained.
    """
    view, n_joints = config.view, frames.labels.n_joints
    patches: list[Patch] = []
    places, hidden, outside = [], [], []
    for number in range(len(frames)):
        frame = frames[number]
        depth = frame.depth if config.layer == "composite" else frame.body_depth
        box = upper_body_box(frame.joints, frame.camera)
        if box is None:
            continue
        try:
            window = body_window(depth, frame.camera, box, view.height * view.pixel_m)
        except ValueError:  # nothing is seen where the person is
            continue
        kinds = _kinds(frame, config, frames.labels.n_parts)
        patches.append(cut_patch(depth, frame.camera, window, view.patch, view.pixel_m, kinds))
        known = is_known(frame.joints)[:, None]
        filled = np.where(known, frame.joints, 1.0)
        places.append(np.where(known, to_patch(filled, frame.camera, window, view), np.nan))
        hidden.append(frame.is_occluded)
        outside.append(_is_outside(frame, depth.shape))
    n = len(patches)
    at = np.array(places, np.float32).reshape(n, n_joints, 3)
    return JointPatches(
        np.array([patch.relative for patch in patches], np.int16).reshape(n, *view.patch),
        np.array([patch.kind for patch in patches], np.uint8).reshape(n, *view.patch),
        at[:, :, :2],
        at[:, :, 2],
        np.array(hidden, bool).reshape(n, n_joints),
        np.array(outside, bool).reshape(n, n_joints),
    )


def _kinds(frame: DepthFrame, config: HeatmapConfig, n_parts: int) -> NDArray[np.uint8]:
    """0 nothing, 1 the person, 2 an object, by pixel."""
    label = frame.label if config.layer == "composite" else frame.body_label
    return np.where(label == 0, 0, np.where(label <= n_parts, 1, 2)).astype(np.uint8)


def _is_outside(frame: DepthFrame, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """(n_joints,) bool, which of the known joints lie outside the image."""
    x, y, z = np.nan_to_num(frame.joints.astype(np.float64), nan=1.0).T
    z = np.maximum(z, 0.05)
    u, v = frame.camera.fx * x / z + frame.camera.cx, frame.camera.fy * y / z + frame.camera.cy
    is_inside = (u >= -0.5) & (u < shape[1] - 0.5) & (v >= -0.5) & (v < shape[0] - 0.5)
    return is_known(frame.joints) & ~is_inside


def mirrored_order(names: tuple[str, ...]) -> NDArray[np.int64]:
    """(n_joints,) for each joint, the number of the one on the other side; of those in the middle, their own."""

    def other(name: str) -> str:
        return {"r_": "l_", "l_": "r_"}.get(name[:2], name[:2]) + name[2:]

    return np.array([names.index(other(name)) if other(name) in names else k for k, name in enumerate(names)])
