"""Boxes around a person in the image: what a detector gives, and what stands in for it."""

import math

import numpy as np
from numpy.typing import NDArray

from forests.frames import Pinhole, is_known

Box = tuple[float, float, float, float]
"""(left, top, right, bottom) [px], right and bottom excluded."""

BOX_MARGIN_M = 0.1
"""An upper-body box ends this far beyond the joints [m]."""
HEAD_M = 0.15
"""A head is sought so far to the left and right of the foreground's middle [m]."""
UPPER_M = 0.6
"""Height and width of a box around head, shoulders and torso [m]."""


def upper_body_box(joints: NDArray[np.float32], camera: Pinhole, margin_m: float = BOX_MARGIN_M) -> Box | None:
    """A box around joints in the image, as a detector of upper bodies gives.

    Args:
        joints: (n, 3) float32, camera frame [m], before the camera; NaN = unknown.
        camera: Intrinsics.
        margin_m: Added on each side, at the joints' mean depth [m].

    Returns:
        The box around the joints that are known; None if none is.
    """
    joints = joints[is_known(joints)]
    if not len(joints):
        return None
    z = np.maximum(joints[:, 2], 0.1)
    u = camera.fx * joints[:, 0] / z + camera.cx
    v = camera.fy * joints[:, 1] / z + camera.cy
    margin = camera.fx * margin_m / float(z.mean())
    return (
        float(u.min()) - margin,
        float(v.min()) - margin,
        float(u.max()) + margin + 1,
        float(v.max()) + margin + 1,
    )


def upper_foreground_box(depth: NDArray[np.uint16], camera: Pinhole) -> Box | None:
    """A box like that of `upper_body_box`, of a person who is cut out, where no detector gives one.

    The columns about the foreground's middle show where the head ends; from there down to the waist the middle is
    found anew. Arms held up or out do not move it much, furniture that is not cut away does.

    Args:
        depth: (height, width) uint16 [mm], 0 = nothing.
        camera: Intrinsics.

    Returns:
        The box; None if the image shows nothing.
    """
    v, u = np.nonzero(depth)
    if not len(v):
        return None
    z = depth[v, u].astype(np.float64) * 1e-3
    middle, distance = float(np.median(u)), float(np.median(z))
    for _ in range(2):
        top = int(v[np.abs(u - middle) <= HEAD_M * camera.fx / distance].min(initial=int(v.max())))
        is_upper = (v >= top) & (v <= top + UPPER_M * camera.fy / distance)
        middle, distance = float(np.median(u[is_upper])), float(np.median(z[is_upper]))
    half = UPPER_M / 2 * camera.fx / distance
    return middle - half, float(top), middle + half + 1, top + UPPER_M * camera.fy / distance


def inside_crop(box: Box | None, left: int, top: int, width: int, height: int) -> tuple[int, int, int, int]:
    """A box of the image as a box of the crop, border left out."""
    if box is None:
        return 1, 1, width - 1, height - 1
    if not (all(math.isfinite(edge) for edge in box) and box[0] < box[2] and box[1] < box[3]):
        raise ValueError(
            f"box {tuple(box)} is empty: it must be (left, top, right, bottom) with right > left, bottom > top"
        )
    first_column, first_row = max(1, math.ceil(box[0]) - left), max(1, math.ceil(box[1]) - top)
    return (
        first_column,
        first_row,
        max(first_column, min(width - 1, math.ceil(box[2]) - left)),
        max(first_row, min(height - 1, math.ceil(box[3]) - top)),
    )
