"""What heat map nets learn from: patches of people, and where their joints lie in them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.boxes import upper_body_box
from forests.frames import DepthFrame, FrameSequence, Pinhole, in_order, is_known
from nets.heatmap.config import STATES, HeatmapConfig, Layer
from nets.patches import Window, body_window, cut_patch
from nets.views import View


class JointPatches(NamedTuple):
    """Patches of n frames, and their joints.

    Attributes:
        relative: (n, height, width) int16, see `nets.patches.Patch`.
        label: (n, height, width) uint8 by the label table, of what lies there.
        part: (n, height, width) uint8, parts of the person alone, behind objects too.
        place: (n, n_joints, 2) float32, row and column in the patch [px]; NaN = unknown.
        depth: (n, n_joints) float32, of the joint minus the person's distance [m]; NaN = unknown.
        state: (n, n_joints) int64, number in `STATES`; -1 = unknown.
    """

    relative: NDArray[np.int16]
    label: NDArray[np.uint8]
    part: NDArray[np.uint8]
    place: NDArray[np.float32]
    depth: NDArray[np.float32]
    state: NDArray[np.int64]


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


def collect_patches(frames: FrameSequence, config: HeatmapConfig, n_threads: int = 1) -> JointPatches:
    """Cuts the patches of all frames of which a joint is known and something is seen.

    Args:
        frames: The frames.
        config: How the net is trained.
        n_threads: Frames that are read at a time; the patches do not depend on it.
    """
    view, n, n_joints = config.view, len(frames), frames.labels.n_joints
    relative = np.empty((n, *view.patch), np.int16)
    label, part = np.empty((n, *view.patch), np.uint8), np.empty((n, *view.patch), np.uint8)
    places: list[NDArray[np.float64]] = []
    states: list[NDArray[np.int64]] = []
    for frame in in_order(frames.__getitem__, n, n_threads):
        depth, labels = frame.depth, frame.label
        if config.layer == "body":
            depth, labels = frame.body_depth, frame.body_label
        box = upper_body_box(frame.joints, frame.camera)
        if box is None:
            continue
        try:
            window = body_window(depth, frame.camera, box, view.height * view.pixel_m)
        except ValueError:  # nothing is seen where the person is
            continue
        where, size = (frame.camera, window), (view.patch, view.pixel_m)
        row = len(places)
        relative[row], label[row] = cut_patch(depth, *where, *size, labels)
        part[row] = cut_patch(frame.body_depth, *where, *size, frame.body_label).kind
        known = is_known(frame.joints)[:, None]
        filled = np.where(known, frame.joints, 1.0)
        places.append(np.where(known, to_patch(filled, *where, view), np.nan))
        states.append(_state(frame, depth.shape, config.layer))
    n = len(places)
    at = np.array(places, np.float32).reshape(n, n_joints, 3)
    state = np.array(states, np.int64).reshape(n, n_joints)
    return JointPatches(relative[:n], label[:n], part[:n], at[:, :, :2], at[:, :, 2], state)


def _state(frame: DepthFrame, shape: tuple[int, ...], layer: Layer) -> NDArray[np.int64]:
    """(n_joints,) numbers in `STATES`, of what the layer shows; -1 = unknown."""
    state = np.zeros(len(frame.joints), np.int64)
    if frame.is_self_occluded is not None:
        state[frame.is_self_occluded] = STATES.index("self_hidden")
    if layer == "composite":
        state[frame.is_occluded] = STATES.index("hidden")
    state[_is_outside(frame, shape)] = STATES.index("outside")
    return np.where(is_known(frame.joints), state, -1)


def _is_outside(frame: DepthFrame, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """(n_joints,) bool, which of the known joints lie outside the image."""
    x, y, z = np.nan_to_num(frame.joints.astype(np.float64), nan=1.0).T
    z = np.maximum(z, 0.05)
    u, v = frame.camera.fx * x / z + frame.camera.cx, frame.camera.fy * y / z + frame.camera.cy
    is_inside = (u >= -0.5) & (u < shape[1] - 0.5) & (v >= -0.5) & (v < shape[0] - 0.5)
    return is_known(frame.joints) & ~is_inside


def mirrored_order(names: tuple[str, ...]) -> NDArray[np.int64]:
    """(n,) for each joint or part, the number of the one on the other side; of those in the middle, their own."""

    def other(name: str) -> str:
        side, _, rest = name.partition("_")
        if side[:1] not in ("l", "r") or side[1:] not in ("", "u", "w"):
            return name
        return f"{'l' if side[0] == 'r' else 'r'}{side[1:]}_{rest}"

    return np.array([names.index(other(name)) if other(name) in names else k for k, name in enumerate(names)])
