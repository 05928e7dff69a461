"""Numba kernels on packed pixel buffers: merging an object into the composite, unpacking to images."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.render.kernels import CODE_BITS, CODE_MASK, FAST, OBJECT_CODE


@njit(cache=True, nogil=True, error_model="numpy")
def merge_object(
    composite: NDArray[np.int32], alone: NDArray[np.int32], width: int, bounds: NDArray[np.int64], least: int
) -> int:
    """Puts an object's own buffer into the composite, and empties it.

    Args:
        composite: (height * width,) int32 packed pixels, changed.
        alone: (height * width,) int32 packed pixels of the object, zero again afterwards.
        width: Image width [px].
        bounds: (4,) int64 box of the object.
        least: Packed pixels below this are beyond the greatest depth.

    Returns:
        Number of pixels that the object covers alone.
    """
    n_pixels = 0
    n_columns = bounds[1] - bounds[0] + 1
    for row in range(bounds[2], bounds[3] + 1):
        base = row * width + bounds[0]
        for column in range(n_columns):
            index = np.uint64(base + column)
            value = alone[index]
            n_pixels += int(value >= least)
            composite[index] = max(composite[index], value)
            alone[index] = 0
    return n_pixels


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def unpack(
    packed: NDArray[np.int32],
    bounds: NDArray[np.int64],
    width: int,
    millimetres: float,
    least: int,
    class_of_instance: NDArray[np.uint8],
    depth: NDArray[np.uint16],
    part: NDArray[np.uint8],
    occluder: NDArray[np.uint8],
    instance: NDArray[np.uint8],
) -> None:
    """Splits packed pixels into images; outputs start as zeros.

    Args:
        packed: (height * width,) int32.
        bounds: (4,) int64 box that holds all that was drawn.
        width: Image width [px].
        millimetres: Depth times q [mm].
        least: Packed pixels below this are beyond the greatest depth and stay 0.
        class_of_instance: (256,) uint8 class code of each object number.
        depth: (height * width,) uint16 [mm].
        part: (height * width,) uint8.
        occluder: (height * width,) uint8.
        instance: (height * width,) uint8.
    """
    n_columns = bounds[1] - bounds[0] + 1
    scale = np.float32(millimetres)
    for row in range(bounds[2], bounds[3] + 1):
        base = row * width + bounds[0]
        for column in range(n_columns):
            index = np.uint64(base + column)
            value = packed[index] if packed[index] >= least else np.int32(0)
            q = np.float32(np.int32(max(value >> CODE_BITS, 1)))
            depth[index] = np.uint16(np.int32(scale / q + np.float32(0.5))) if value > 0 else np.uint16(0)
            code = np.int32(value & CODE_MASK)
            part[index] = np.uint8(code if code <= OBJECT_CODE else 0)
            instance[index] = np.uint8(code - OBJECT_CODE if code > OBJECT_CODE else 0)
        for column in range(n_columns):
            index = np.uint64(base + column)
            occluder[index] = class_of_instance[instance[index]]


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def unpack_body(
    packed: NDArray[np.int32],
    bounds: NDArray[np.int64],
    width: int,
    millimetres: float,
    least: int,
    depth: NDArray[np.uint16],
    part: NDArray[np.uint8],
) -> None:
    """Splits packed pixels that hold the person alone; arguments as for `unpack`."""
    n_columns = bounds[1] - bounds[0] + 1
    scale = np.float32(millimetres)
    for row in range(bounds[2], bounds[3] + 1):
        base = row * width + bounds[0]
        for column in range(n_columns):
            index = np.uint64(base + column)
            value = packed[index] if packed[index] >= least else np.int32(0)
            q = np.float32(np.int32(max(value >> CODE_BITS, 1)))
            depth[index] = np.uint16(np.int32(scale / q + np.float32(0.5))) if value > 0 else np.uint16(0)
            part[index] = np.uint8(value & CODE_MASK)


@njit(cache=True, nogil=True, error_model="numpy")
def unpack_metres(packed: NDArray[np.int32], metres: float, least: int, depth: NDArray[np.float32]) -> None:
    """Depth of packed pixels as float32 [m], 0 where nothing.

    Args:
        packed: (n,) int32.
        metres: Depth times q [m].
        least: Packed pixels below this are beyond the greatest depth.
        depth: (n,) float32, receives the depth.
    """
    for i in range(packed.size):
        value = packed[i]
        depth[i] = np.float32(metres / (value >> CODE_BITS)) if value >= least else np.float32(0.0)
