"""Walkers come down their trees together, level by level, so that they wait for memory together."""

from typing import Any

import numpy as np
from llvmlite import ir
from numba import float32, int32, njit, types, uint32
from numba.extending import intrinsic

from forests.crops import NOTHING
from forests.features import difference
from forests.rwf.tables import WalkTables

_LANES = 8
"""Walkers are projected in groups of so many, the last of them filled up: half groups cost as much as whole ones."""

_READ, _KEEP, _DATA = 0, 3, 1
"""Of the instruction `llvm.prefetch`: fetched to be read, to stay in all caches, no code."""


@intrinsic
def prefetch(typing_context: Any, array: Any, index: Any) -> Any:
    """Has an element of a contiguous array of one dimension fetched into the cache. It changes nothing but speed.

    Args:
        typing_context: Given by numba; kernels call `prefetch(array, index)`.
        array: Of any element type.
        index: Of the element; not checked, since what is fetched is not read.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> None:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        place = context.cast(builder, arguments[1], signature.args[1], types.intp)
        pointer = builder.bitcast(builder.gep(data, [place]), ir.IntType(8).as_pointer())
        number = ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [pointer.type, number, number, number])
        fetch = builder.module.declare_intrinsic("llvm.prefetch", [pointer.type], kind)
        builder.call(fetch, [pointer, number(_READ), number(_KEEP), number(_DATA)])

    return types.void(array, index), generate


@njit(cache=True, nogil=True)
def descend(
    depth: np.ndarray, intrinsics: np.ndarray, tables: WalkTables, point: np.ndarray, column: np.ndarray,
    row: np.ndarray, number: np.ndarray,
) -> None:  # fmt: skip
    """Finds the leaves of walkers. One that has reached its leaf leaves the group.

    A probe without offset reads the point's own depth.

    Args:
        depth: (height, width) uint16 [mm], 0 = nothing, contiguous.
        intrinsics: (4,) float32, (fx, fy, cx, cy) [px].
        tables: The experts.
        point: (n, 3) float32, camera frame [m].
        column: (n,) float32, pixels plus one half.
        row: (n,) float32, likewise.
        number: (n,) int32, the nodes where they start; changed to the rows of the leaves where they end.
    """
    nodes, n = tables.nodes, len(number)
    n_clusters, votes = tables.vote.shape[1], tables.vote.reshape(-1)
    height, width = depth.shape
    pixels = depth.reshape(-1)
    walker, own_mm, at = np.empty(n, np.int32), np.empty(n, np.int32), np.empty(n, np.int32)
    left, threshold = np.empty(n, np.int32), np.empty(n, np.int32)
    here, offset = np.zeros((4, n + _LANES), np.float32), np.zeros((4, n + _LANES), np.int16)
    one, two = np.empty(n + _LANES, np.int32), np.empty(n + _LANES, np.int32)
    for k in range(n):
        walker[k], at[k] = k, number[k]
        own_mm[k] = int32(point[k, 2] * float32(1e3) + float32(0.5))
        here[0, k], here[1, k] = column[k], row[k]
        here[2, k] = tables.probe_m * intrinsics[0] / point[k, 2]
        here[3, k] = tables.probe_m * intrinsics[1] / point[k, 2]
    while n > 0:
        n_going = 0
        for k in range(n):
            node = nodes[uint32(at[k])]
            if node.next < 0:
                number[walker[k]] = -1 - node.next
                prefetch(votes, number[walker[k]] * n_clusters * 4)
                continue
            prefetch(nodes, node.next)
            offset[0, n_going], offset[1, n_going] = node.u[0], node.u[1]
            offset[2, n_going], offset[3, n_going] = node.v[0], node.v[1]
            left[n_going], threshold[n_going] = node.next, node.threshold
            if n_going < k:
                walker[n_going], own_mm[n_going] = walker[k], own_mm[k]
                for i in range(4):
                    here[i, n_going] = here[i, k]
            n_going += 1
        n = n_going
        n_filled = (n + _LANES - 1) // _LANES * _LANES
        _places(here, offset[0], offset[1], width, height, one[:n_filled])
        _places(here, offset[2], offset[3], width, height, two[:n_filled])
        for k in range(n):
            second = _read(pixels, two[k])
            second = own_mm[k] if (offset[2, k] == 0) & (offset[3, k] == 0) else second
            at[k] = left[k] + int32(difference(_read(pixels, one[k]), second) > threshold[k])


@njit(cache=True, nogil=True, inline="always")
def _read(pixels: np.ndarray, place: int) -> int:
    """Depth at a place of `_places` [mm]; NOTHING outside the image and where nothing is."""
    value = int32(pixels[uint32(max(place, int32(0)))])
    return int32(NOTHING) if (place < 0) | (value == 0) else value


@njit(cache=True, nogil=True)
def _places(here: np.ndarray, dx: np.ndarray, dy: np.ndarray, width: int, height: int, out: np.ndarray) -> None:
    """Numbers of the pixels that probes read, row-major; -1 outside the image. Vectorises: no branch, no load by index.

    Args:
        here: (4, n or more) float32: column and row plus one half, and what turns the offsets into pixels.
        dx: (n or more,) int16, offsets along x in units.
        dy: (n or more,) int16, along y.
        width: Columns of the image.
        height: Rows of the image.
        out: (n,) int32 to fill.
    """
    one, before = float32(1.0), float32(-0.5)
    right, bottom = float32(width) + float32(0.5), float32(height) + float32(0.5)
    n_columns, n_rows = int32(width), int32(height)
    for k in range(len(out)):
        # From 1 on, so that what is cut off lies below 0 after rounding towards it.
        column = int32(min(max(here[0, k] + here[2, k] * float32(dx[k]), before), right) + one)
        row = int32(min(max(here[1, k] + here[3, k] * float32(dy[k]), before), bottom) + one)
        place = (row - int32(1)) * n_columns + column - int32(1)
        place = place if column > int32(0) else int32(-1)
        place = place if column <= n_columns else int32(-1)
        place = place if row > int32(0) else int32(-1)
        out[k] = place if row <= n_rows else int32(-1)
