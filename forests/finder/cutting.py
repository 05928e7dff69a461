"""Cuts a found person out of the depth image: what is near the axis, above the floor, not behind, and nobody else's."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.finder.find import Found
from forests.finder.floor import NOISE_M, NOISE_PER_M2, Floor
from forests.frames import Pinhole, check_depth

REACH_M = 0.7
"""What lies farther from the axis, seen from above, is no part of a person who does not stretch out [m]."""
BEHIND_M = 0.25
"""What lies farther than this behind the axis, seen from the camera, is what stands behind the person [m]."""
ABOVE_M = 0.5
"""Raised arms reach this far above the top [m]."""
DEPTH_M = 2.0
"""Where no floor is known, a person reaches this far below the top [m]."""


def cut_person(depth: NDArray, camera: Pinhole, found: Found, number: int) -> NDArray[np.uint16]:
    """The depth image without what is not near a found person.

    Kept is what lies within 0.7 m of the axis, seen from above, nearer to it than to any other person's, at most
    0.25 m behind it, and above the floor. Objects about the person stay: they tell where hidden joints are.

    Args:
        depth: (height, width) integers [mm], 0 = nothing; the image that people were found in.
        camera: Its intrinsics.
        found: Who was found.
        number: Of the person in `found.people`.

    Returns:
        (height, width) uint16 [mm], 0 elsewhere.

    Raises:
        IndexError: There is no such person.
        ValueError: The depth is no depth image.
    """
    if not 0 <= number < len(found.people):
        raise IndexError(f"person {number} is not in 0..{len(found.people) - 1}")
    axes = np.array([person.axis for person in found.people], np.float64)
    return cut_axis(depth, camera, axes, number, found.floor)


def cut_axis(
    depth: NDArray, camera: Pinhole, axes: NDArray[np.float64], number: int, floor: Floor | None
) -> NDArray[np.uint16]:
    """The same for people who are given by points on their axes.

    Args:
        depth: (height, width) integers [mm], 0 = nothing.
        camera: Its intrinsics.
        axes: (n, 3) float64, the middle of each person at the height of the top, camera frame [m].
        number: Whose image is made.
        floor: The floor; None = not known, and up is the image's up.
    """
    image = check_depth(depth)
    up = np.array([0.0, -1.0, 0.0]) if floor is None else floor.normal
    ground = np.nan if floor is None else floor.height
    out = np.zeros_like(image)
    fx, fy, cx, cy = (float(value) for value in (camera.fx, camera.fy, camera.cx, camera.cy))
    _cut(image, fx, fy, cx, cy, up, ground, np.ascontiguousarray(axes, np.float64), number, out)
    return out


@njit(cache=True, nogil=True)
def _cut(depth, fx, fy, cx, cy, up, ground, axes, number, out):  # type: ignore[no-untyped-def]
    """Copies the person's pixels into `out`, zeros on entry."""
    rows, columns = depth.shape
    axis = axes[number]
    rise_of_axis = axis[0] * up[0] + axis[1] * up[1] + axis[2] * up[2]
    ahead = axis - rise_of_axis * up
    distance = np.sqrt((ahead * ahead).sum())
    ahead = ahead / max(distance, 1e-9)
    for row in range(rows):
        for column in range(columns):
            z = depth[row, column] * 1e-3
            if z == 0.0:
                continue
            x, y = (column - cx) / fx * z, (row - cy) / fy * z
            rise = x * up[0] + y * up[1] + z * up[2]
            dx, dy, dz = x - axis[0], y - axis[1], z - axis[2]
            lift = rise - rise_of_axis
            square = dx * dx + dy * dy + dz * dz - lift * lift
            if square > REACH_M * REACH_M or lift > ABOVE_M or lift < -DEPTH_M:
                continue
            # Without a floor the height is NaN, and the comparison false.
            if rise + ground < NOISE_M + NOISE_PER_M2 * z * z:
                continue
            if x * ahead[0] + y * ahead[1] + z * ahead[2] > distance + BEHIND_M:
                continue
            is_own = True
            for j in range(len(axes)):
                if j != number:
                    ex, ey, ez = x - axes[j, 0], y - axes[j, 1], z - axes[j, 2]
                    fall = ex * up[0] + ey * up[1] + ez * up[2]
                    if ex * ex + ey * ey + ez * ez - fall * fall < square:
                        is_own = False
                        break
            if is_own:
                out[row, column] = depth[row, column]
