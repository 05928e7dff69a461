"""The depth comparison feature of Shotton et al. 2011 (equation 1): two probes, scaled by the pixel's depth.

In experiments trees may ask for hints (`forests.frames.Hints`) instead. What a node asks is a number: 0 = the
difference of depths; c > 0 = whether its first probe hits class c; -1 - k = fact k of the frame.
"""

import numpy as np
from numba import int32, njit

from forests.hashing import hash4

FEATURE_LIMIT_MM = 2000
"""Differences are cut to +-this [mm]: beyond it, one probe is off the person, and how far does not matter."""

_N_DIRECTIONS = 1024
_DIRECTIONS = np.stack(
    [
        np.cos(np.arange(_N_DIRECTIONS) * (2 * np.pi / _N_DIRECTIONS)),
        np.sin(np.arange(_N_DIRECTIONS) * (2 * np.pi / _N_DIRECTIONS)),
    ],
    axis=1,
).astype(np.float32)
_DIRECTION_BITS = np.uint64(_N_DIRECTIONS - 1)
_LENGTH_BITS = np.uint64(2**20 - 1)
_LENGTH_STEP = 1.0 / 2**20
_HIT_STREAM = 0x3_0000_0000
"""Beyond the numbers of candidates, which are hashed with the same seed, tree and node."""


@njit(cache=True, nogil=True)
def draw_feature(seed: int, tree: int, node: int, candidate: int, max_offset: float, out: np.ndarray) -> None:
    """Draws the offsets of one candidate from (seed, tree, node, candidate) alone.

    Direction and length are uniform; in half of the candidates the second probe has no offset: it reads the
    sample's own depth, which for a point off the surface is not the depth of its pixel.

    Args:
        seed: Of the forest.
        tree: The tree's number.
        node: The node's number in the full binary tree (root 1, children 2i and 2i + 1).
        candidate: The candidate's number.
        max_offset: Longest offset [m].
        out: (4,) float32 (ux, uy, vx, vy) [m] to fill.
    """
    key = hash4(seed, tree, node, candidate)
    for probe_idx in range(2):
        direction = key & _DIRECTION_BITS
        length = np.float32(max_offset * _LENGTH_STEP * float((key >> np.uint64(10)) & _LENGTH_BITS))
        out[2 * probe_idx] = length * _DIRECTIONS[direction, 0]
        out[2 * probe_idx + 1] = length * _DIRECTIONS[direction, 1]
        key >>= np.uint64(30)
    if key & np.uint64(1):
        out[2] = 0.0
        out[3] = 0.0


@njit(cache=True, nogil=True)
def draw_hit(
    seed: int, tree: int, node: int, candidate: int, n_classes: int, max_offset: float, out: np.ndarray
) -> int:
    """Draws a candidate that asks whether its first probe hits a class; in one of eight it is the pixel itself.

    Args:
        seed: Of the forest.
        tree: The tree's number.
        node: The node's number in the full binary tree.
        candidate: The candidate's number among those of its kind.
        n_classes: Classes are 1..n_classes.
        max_offset: Longest offset [m].
        out: (4,) float32 (ux, uy, 0, 0) [m] to fill.

    Returns:
        The class.
    """
    key = hash4(seed, tree, node, _HIT_STREAM + candidate)
    direction = key & _DIRECTION_BITS
    length = np.float32(max_offset * _LENGTH_STEP * float((key >> np.uint64(10)) & _LENGTH_BITS))
    key >>= np.uint64(30)
    if key & np.uint64(7) == 0:
        length = np.float32(0.0)
    out[:] = 0.0
    out[0], out[1] = length * _DIRECTIONS[direction, 0], length * _DIRECTIONS[direction, 1]
    return 1 + int((key >> np.uint64(3)) % np.uint64(n_classes))


@njit(cache=True, nogil=True, inline="always")
def pixels_per_metre(focal_px: float, z_mm: int) -> np.float32:
    """What scales an offset in metres to pixels at a depth, float32: focal length [px] / depth [m]."""
    return np.float32(focal_px) * np.float32(1000.0) / np.float32(z_mm)


@njit(cache=True, nogil=True)
def probe_places(
    x: np.ndarray, y: np.ndarray, fx_z: np.ndarray, fy_z: np.ndarray,
    right: np.ndarray, bottom: np.ndarray, width: np.ndarray, dx: float, dy: float, out: np.ndarray,
) -> None:  # fmt: skip
    """Where one probe of every pixel reads, relative to its crop's start. Vectorises: no branch, no load by index.

    Args:
        x: (n,) float32, columns in the crop, plus one half for rounding.
        y: (n,) float32, rows in the crop, plus one half.
        fx_z: (n,) float32, fx / depth [px/m].
        fy_z: (n,) float32, fy / depth [px/m].
        right: (n,) float32, last column of the crop plus one half: reads beyond land in the border.
        bottom: (n,) float32, last row plus one half.
        width: (n,) int32, columns of the crop.
        dx: Offset along x [m], float32.
        dy: Offset along y [m], float32.
        out: (n,) int32 to fill.
    """
    half = np.float32(0.5)
    for i in range(len(out)):
        column = min(max(x[i] + fx_z[i] * dx, half), right[i])
        row = min(max(y[i] + fy_z[i] * dy, half), bottom[i])
        out[i] = int32(row) * width[i] + int32(column)


@njit(cache=True, nogil=True)
def feature_values(
    pixels: np.ndarray, x: np.ndarray, y: np.ndarray, fx_z: np.ndarray, fy_z: np.ndarray, right: np.ndarray,
    bottom: np.ndarray, width: np.ndarray, start: np.ndarray, z_mm: np.ndarray, feature: np.ndarray,
    places: np.ndarray, values: np.ndarray,
) -> None:  # fmt: skip
    """One feature of many pixels (equation 1, without the threshold); arguments as in `probe_places`.

    Args:
        pixels: (n_pixels,) uint16, `Crops.pixels`.
        x: (n,) float32.
        y: (n,) float32.
        fx_z: (n,) float32.
        fy_z: (n,) float32.
        right: (n,) float32.
        bottom: (n,) float32.
        width: (n,) int32.
        start: (n,) int64, where the pixel's crop starts.
        z_mm: (n,) int32, the pixels' own depth: what a probe without an offset reads.
        feature: (4,) float32 (ux, uy, vx, vy) [m].
        places: (n,) int32, scratch.
        values: (n,) int32 to fill [mm].
    """
    probe_places(x, y, fx_z, fy_z, right, bottom, width, feature[0], feature[1], places)
    for i in range(len(values)):
        values[i] = pixels[start[i] + places[i]]
    if feature[2] == 0.0 and feature[3] == 0.0:
        for i in range(len(values)):
            values[i] = difference(values[i], z_mm[i])
        return
    probe_places(x, y, fx_z, fy_z, right, bottom, width, feature[2], feature[3], places)
    for i in range(len(values)):
        places[i] = pixels[start[i] + places[i]]
    for i in range(len(values)):
        values[i] = difference(values[i], places[i])


@njit(cache=True, nogil=True, inline="always")
def difference(first: int, second: int) -> int:
    """Depth at the first probe minus depth at the second [mm], cut to +-FEATURE_LIMIT_MM."""
    return min(max(int32(first) - int32(second), int32(-FEATURE_LIMIT_MM)), int32(FEATURE_LIMIT_MM))


@njit(cache=True, nogil=True, inline="always")
def probe(
    pixels: np.ndarray, start: int, width: int, height: int, x: float, y: float,
    fx_z: float, fy_z: float, dx: float, dy: float,
) -> int:  # fmt: skip
    """One probe of one pixel: the same arithmetic as `probe_places`, for a single pixel. x, y plus one half."""
    half = np.float32(0.5)
    column = min(max(x + fx_z * dx, half), np.float32(width) - half)
    row = min(max(y + fy_z * dy, half), np.float32(height) - half)
    return pixels[start + np.int64(int32(row) * width + int32(column))]


@njit(cache=True, nogil=True)
def hit_values(classes: np.ndarray, start: np.ndarray, places: np.ndarray, hint: int, values: np.ndarray) -> None:
    """Whether the probes of many pixels hit a class: FEATURE_LIMIT_MM or 0.

    Args:
        classes: (n_pixels,) uint8, `Crops.classes`.
        start: (n,) int64, where the pixel's crop starts.
        places: (n,) int32 of `probe_places`.
        hint: The class.
        values: (n,) int32 to fill.
    """
    for i in range(len(values)):
        values[i] = int32(FEATURE_LIMIT_MM) if classes[start[i] + places[i]] == hint else int32(0)


@njit(cache=True, nogil=True)
def fact_values(facts: np.ndarray, frame: np.ndarray, hint: int, values: np.ndarray) -> None:
    """Fact -1 - hint of many pixels' frames.

    Args:
        facts: (n_frames, n_facts) int16, `Crops.facts`.
        frame: (n,) int32.
        hint: Below 0.
        values: (n,) int32 to fill.
    """
    for i in range(len(values)):
        values[i] = int32(facts[frame[i], -1 - hint])


@njit(cache=True, nogil=True)
def hint_value(
    classes: np.ndarray, facts: np.ndarray, frame: int, start: int, width: int, height: int,
    x: float, y: float, fx_z: float, fy_z: float, feature: np.ndarray, hint: int,
) -> int:  # fmt: skip
    """What `hit_values` or `fact_values` tells of a single pixel; x, y plus one half."""
    if hint < 0:
        return int32(facts[frame, -1 - hint])
    is_hit = probe(classes, start, width, height, x, y, fx_z, fy_z, feature[0], feature[1]) == hint
    return int32(FEATURE_LIMIT_MM) if is_hit else int32(0)
