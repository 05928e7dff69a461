"""What sensor models share: angle of incidence, shadow of a second viewpoint, window support, smooth noise."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.camera import Camera

_RING = np.array(
    [
        (math.cos(a), math.sin(a))
        for a in (2.0 * math.pi * k / 16 for k in (0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13))
    ]
)
"""Twelve directions (x, y), opposite ones first, so that a count can stop early."""


def disparity_of(depth_mm: NDArray[np.uint16], scale: float) -> NDArray[np.float32]:
    """Turns depth into disparity.

    Args:
        depth_mm: (height, width) uint16 [mm], 0 = no return.
        scale: Baseline times focal length [m px].

    Returns:
        (height, width) float32 [px], 0 = no return.
    """
    disparity = np.zeros(depth_mm.shape, np.float32)
    np.divide(np.float32(1000.0 * scale), depth_mm, out=disparity, where=depth_mm > 0)
    return disparity


class _Intrinsics(NamedTuple):
    fx: float
    fy: float
    cx: float
    cy: float


def incidence_cosine(disparity: NDArray[np.float32], camera: Camera) -> NDArray[np.float32]:
    """Cosine of the angle between the surface normal and the ray to the pixel.

    On a plane the inverse depth w is linear in the pixel, w = n.(ray), and the normal is
    (fx dw/du, fy dw/dv, w - (u - cx) dw/du - (v - cy) dw/dv) up to scale; so the differences of w are exact there.

    Args:
        disparity: (height, width) float32, inverse depth in any unit, 0 = no return.
        camera: The camera.

    Returns:
        (height, width) float32 in (0, 1]; 1 where there is no return.
    """
    cosine = np.ones(disparity.shape, np.float32)
    _incidence_cosine(disparity, _Intrinsics(camera.fx, camera.fy, camera.cx, camera.cy), cosine)
    return cosine


@njit(cache=True, nogil=True)
def _slope(w: float, before: float, after: float) -> float:
    """Change of inverse depth a step.

    Both sides agree on a plane, however steep, and their mean is taken. Where they do not, one of them looks
    across an edge, and the flatter one is taken; on a ridge narrower than the step, or beside no return, none.
    """
    left = w - before
    right = after - w
    if abs(left - right) < 0.02 * w + 0.25 * max(abs(left), abs(right)):
        return 0.5 * (left + right)
    flatter = left if abs(left) < abs(right) else right
    if abs(flatter) > 0.3 * w or (left * right < 0.0 and abs(flatter) > 0.02 * w):
        return 0.0
    return flatter


@njit(cache=True, nogil=True)
def _incidence_cosine(disparity: NDArray[np.float32], camera: _Intrinsics, cosine: NDArray[np.float32]) -> None:
    height, width = disparity.shape
    step = 2  # two pixels: millimetre steps of the input would otherwise tilt flat surfaces
    for v in range(height):
        y = (v - camera.cy) / camera.fy
        for u in range(width):
            w = float(disparity[v, u])
            if w <= 0.0:
                continue
            west = float(disparity[v, u - step]) if u >= step else 0.0
            east = float(disparity[v, u + step]) if u + step < width else 0.0
            north = float(disparity[v - step, u]) if v >= step else 0.0
            south = float(disparity[v + step, u]) if v + step < height else 0.0
            nx = camera.fx * _slope(w, west, east) / step
            ny = camera.fy * _slope(w, north, south) / step
            x = (u - camera.cx) / camera.fx
            nz = w - x * nx - y * ny
            length = math.sqrt((nx * nx + ny * ny + nz * nz) * (x * x + y * y + 1.0))
            cosine[v, u] = min(w / length, 1.0)


@njit(cache=True, nogil=True)
def bend(cosine: float) -> float:
    """Gives theta / (pi/2 - theta), by which published noise grows with the angle; held beyond 86 degrees."""
    theta = min(math.acos(cosine), 1.5)
    return theta / (0.5 * math.pi - theta)


@njit(cache=True, nogil=True)
def is_grazing(cosine: float, mean: float, spread: float, noise: float) -> bool:
    """Whether the angle of incidence exceeds mean + spread * noise [rad]."""
    return cosine < 0.5 and math.acos(cosine) > mean + spread * noise


def hidden_from_right(disparity: NDArray[np.float32], *, is_left_border_hidden: bool) -> NDArray[np.bool_]:
    """Finds pixels that a second viewpoint to the camera's right cannot see.

    The second viewpoint (a projector, or the right imager) lies at +x on the camera's own rows. It sees a point of
    column u at column u - disparity. Per row the nearest surface of each of its columns is kept; what lies more
    than one pixel of disparity behind it is hidden. A box before a wall hides a strip of the wall to the box's
    left that is as wide as the difference of their disparities, b f (1/z_near - 1/z_far).

    Args:
        disparity: (height, width) float32, baseline times focal length over depth [px], 0 = no return.
        is_left_border_hidden: Whether points left of the second viewer's image count as hidden.

    Returns:
        (height, width) bool.
    """
    is_hidden = np.zeros(disparity.shape, np.bool_)
    _hidden_from_right(disparity, is_left_border_hidden, is_hidden)
    return is_hidden


@njit(cache=True, nogil=True)
def _hidden_from_right(
    disparity: NDArray[np.float32], is_left_border_hidden: bool, is_hidden: NDArray[np.bool_]
) -> None:
    height, width = disparity.shape
    margin = 256 if not is_left_border_hidden else 0
    nearest = np.empty(width + margin + 2, np.float32)
    for v in range(height):
        nearest[:] = 0.0
        for u in range(width):
            d = disparity[v, u]
            if d > 0.0:
                column = math.floor(u - d) + margin
                for k in range(column, column + 2):  # the pixel covers up to two columns there
                    if 0 <= k < nearest.size and nearest[k] < d:
                        nearest[k] = d
        for u in range(width):
            d = disparity[v, u]
            if d <= 0.0:
                continue
            k = math.floor(u - d + 0.5) + margin
            if k < 0:
                is_hidden[v, u] = is_left_border_hidden
            else:
                is_hidden[v, u] = nearest[k] > d + 1.0


def drop_unsupported(
    disparity: NDArray[np.float32], radius: float, jump: float, n_needed: int
) -> NDArray[np.float32]:
    """Removes pixels whose matching window holds too little of their own surface (thin rods, tips, specks).

    Args:
        disparity: (height, width) float32 [px], 0 = no return.
        radius: Radius of the ring of twelve samples [px].
        jump: Relative difference of disparity that parts two surfaces.
        n_needed: Samples of the ring, of 12, that must lie on the pixel's surface.

    Returns:
        (height, width) float32, a copy with the unsupported pixels at 0. Samples outside the image support.
    """
    out = disparity.copy()
    offsets = np.rint(_RING * radius).astype(np.int64)
    _drop_unsupported(disparity, offsets, jump, n_needed, out)
    return out


@njit(cache=True, nogil=True)
def _drop_unsupported(
    disparity: NDArray[np.float32],
    offsets: NDArray[np.int64],
    jump: float,
    n_needed: int,
    out: NDArray[np.float32],
) -> None:
    height, width = disparity.shape
    for v in range(height):
        for u in range(width):
            d = disparity[v, u]
            if d <= 0.0:
                continue
            n_support = 0
            for k in range(offsets.shape[0]):
                x = u + offsets[k, 0]
                y = v + offsets[k, 1]
                if x < 0 or y < 0 or x >= width or y >= height or abs(disparity[y, x] - d) < jump * d:
                    n_support += 1
                    if n_support >= n_needed:
                        break
            if n_support < n_needed:
                out[v, u] = 0.0


def fill_gaps(disparity: NDArray[np.float32], radius: float, jump: float, n_needed: int) -> NDArray[np.float32]:
    """Gives pixels the nearer surface that fills their matching window, as between fingers.

    Args:
        disparity: (height, width) float32 [px], 0 = no return.
        radius: Radius of the ring of twelve samples [px].
        jump: Relative difference of disparity that parts two surfaces.
        n_needed: Samples of the ring, of 12, that must lie nearer.

    Returns:
        (height, width) float32, a copy in which the gaps have the median disparity of the nearer samples.
    """
    out = disparity.copy()
    offsets = np.rint(_RING * radius).astype(np.int64)
    _fill_gaps(disparity, offsets, jump, n_needed, out)
    return out


@njit(cache=True, nogil=True)
def _fill_gaps(
    disparity: NDArray[np.float32],
    offsets: NDArray[np.int64],
    jump: float,
    n_needed: int,
    out: NDArray[np.float32],
) -> None:
    height, width = disparity.shape
    n_ring = offsets.shape[0]
    near = np.empty(n_ring, np.float32)
    for v in range(height):
        for u in range(width):
            d = disparity[v, u]
            n = 0
            for k in range(n_ring):
                x = u + offsets[k, 0]
                y = v + offsets[k, 1]
                if 0 <= x < width and 0 <= y < height and disparity[y, x] * (1.0 - jump) > d:
                    near[n] = disparity[y, x]
                    n += 1
                if n + n_ring - 1 - k < n_needed:
                    break
            if n >= n_needed:
                out[v, u] = np.sort(near[:n])[n // 2]


def smooth_noise(rng: np.random.Generator, shape: tuple[int, int], sigma: float) -> NDArray[np.float32]:
    """Draws a stationary Gaussian field of unit variance, correlated over a few pixels.

    Args:
        rng: Source of randomness.
        shape: (height, width).
        sigma: Standard deviation of the Gaussian kernel that smooths white noise [px]; below 1 the field
            is white.

    Returns:
        (height, width) float32, mean 0, variance 1 in every pixel, borders included.
    """
    if sigma < 1.0:
        return rng.standard_normal(shape, dtype=np.float32)
    reach = max(1, math.ceil(2.0 * sigma))
    taps = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    taps = (taps / math.sqrt(float(np.sum(taps**2)))).astype(np.float32)
    # The sum of some dozen uniform numbers is as good as normal, and they are six times as fast to draw.
    white = rng.random((shape[0] + 2 * reach, shape[1] + 2 * reach), dtype=np.float32) - np.float32(0.5)
    taps *= np.float32(12.0**0.25)  # both passes together undo a uniform number's variance of 1/12
    out = np.empty(shape, np.float32)
    _smooth(white, taps, out)
    return out


@njit(cache=True, nogil=True)
def _smooth(white: NDArray[np.float32], taps: NDArray[np.float32], out: NDArray[np.float32]) -> None:
    height, width = out.shape
    row = np.empty(white.shape[1], np.float32)
    for v in range(height):
        row[:] = 0.0
        for k in range(taps.size):
            tap = taps[k]
            for x in range(row.size):
                row[x] += tap * white[v + k, x]
        for u in range(width):
            out[v, u] = 0.0
        for k in range(taps.size):
            tap = taps[k]
            for u in range(width):
                out[v, u] += tap * row[u + k]


@njit(cache=True, nogil=True)
def bridge_pinholes(disparity: NDArray[np.float32]) -> NDArray[np.float32]:
    """Gives pixels without a return the median of their neighbours, where at least six of the eight have one.

    Args:
        disparity: (height, width), 0 = no return.

    Returns:
        (height, width) a new image; what had a return keeps it, and the border stays as it is.
    """
    height, width = disparity.shape
    out = disparity.copy()
    near = np.empty(8, np.float32)
    for v in range(1, height - 1):
        for u in range(1, width - 1):
            if disparity[v, u] > 0.0:
                continue
            n = 0
            for y in range(v - 1, v + 2):
                for x in range(u - 1, u + 2):
                    if disparity[y, x] > 0.0:
                        near[n] = disparity[y, x]
                        n += 1
            if n >= 6:
                out[v, u] = np.sort(near[:n])[n // 2]
    return out
