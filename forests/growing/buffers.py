"""A node's samples, copied out of images and samples into compact buffers that the feature kernels run along."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.crops import Crops
from forests.features import pixels_per_metre
from forests.hashing import hash4, splitmix64
from forests.samples import Samples

_PICK_STREAM = 0x7_0000_0000
"""Beyond the numbers of candidates, which are hashed with the same seed, tree and node."""


class Target(NamedTuple):
    """What a tree separates; n_classes = 0 means directions.

    With classes and directions, nodes that hold one class alone are split by directions.

    Attributes:
        classes: (n,) uint8, or empty.
        n_classes: Classes are 0..n_classes-1.
        directions: (n, 3) int16, or empty.
    """

    classes: NDArray[np.uint8]
    n_classes: int
    directions: NDArray[np.int16]


class NodeSamples(NamedTuple):
    """Up to m samples of a node; x, y, right and bottom with the half of `forests.features.probe_places` added.

    Attributes:
        x: (m,) float32 [px].
        y: (m,) float32 [px].
        fx_z: (m,) float32 [px/m].
        fy_z: (m,) float32 [px/m].
        right: (m,) float32 [px].
        bottom: (m,) float32 [px].
        width: (m,) int32 [px].
        start: (m,) int64, of the crop in `Crops.pixels`.
        z_mm: (m,) int32.
        frame: (m,) int32.
        column: (m,) int32, the sample's class among the classes alive in the node.
        direction: (m, 3) int32, or (0, 3).
    """

    x: NDArray[np.float32]
    y: NDArray[np.float32]
    fx_z: NDArray[np.float32]
    fy_z: NDArray[np.float32]
    right: NDArray[np.float32]
    bottom: NDArray[np.float32]
    width: NDArray[np.int32]
    start: NDArray[np.int64]
    z_mm: NDArray[np.int32]
    frame: NDArray[np.int32]
    column: NDArray[np.int32]
    direction: NDArray[np.int32]


@njit(cache=True, nogil=True)
def empty_buffers(m: int, n_directions: int) -> NodeSamples:
    """Buffers for m samples."""
    return NodeSamples(
        np.empty(m, np.float32),
        np.empty(m, np.float32),
        np.empty(m, np.float32),
        np.empty(m, np.float32),
        np.empty(m, np.float32),
        np.empty(m, np.float32),
        np.empty(m, np.int32),
        np.empty(m, np.int64),
        np.empty(m, np.int32),
        np.empty(m, np.int32),
        np.empty(m, np.int32),
        np.empty((n_directions, 3), np.int32),
    )


@njit(cache=True, nogil=True)
def first(buffers: NodeSamples, m: int) -> NodeSamples:
    """The first m samples: one view for all candidates, since taking views costs as much as a few probes."""
    return NodeSamples(
        buffers.x[:m],
        buffers.y[:m],
        buffers.fx_z[:m],
        buffers.fy_z[:m],
        buffers.right[:m],
        buffers.bottom[:m],
        buffers.width[:m],
        buffers.start[:m],
        buffers.z_mm[:m],
        buffers.frame[:m],
        buffers.column[:m],
        buffers.direction[:m],
    )


@njit(cache=True, nogil=True)
def gather_node(
    crops: Crops, samples: Samples, target: Target, members: np.ndarray, m: int,
    seed: int, tree: int, node: int, column_of: np.ndarray, buffers: NodeSamples,
) -> None:  # fmt: skip
    """Fills buffers with m of a node's samples, in their order: one out of each of m equal stretches, by hash.

    Args:
        crops: Images.
        samples: Pixels.
        target: What they are.
        members: (n,) int32, n >= m, the node's samples.
        m: How many are taken.
        seed: Of the forest.
        tree: The tree's number.
        node: The node's number in the full binary tree.
        column_of: (256,) int32, class -> class alive.
        buffers: To fill, m or longer.
    """
    n = len(members)
    half = np.float32(0.5)
    key = hash4(seed, tree, node, _PICK_STREAM + m)
    for k in range(m):
        begin = k * n // m
        end = (k + 1) * n // m
        place = begin
        if end - begin > 1:
            place += int(splitmix64(key + np.uint64(k)) % np.uint64(end - begin))
        s = members[place]
        frame = samples.frame[s]
        z_mm = samples.z_mm[s]
        buffers.x[k] = np.float32(samples.x[s]) + half
        buffers.y[k] = np.float32(samples.y[s]) + half
        buffers.fx_z[k] = pixels_per_metre(crops.intrinsics[frame, 0], z_mm)
        buffers.fy_z[k] = pixels_per_metre(crops.intrinsics[frame, 1], z_mm)
        buffers.right[k] = np.float32(crops.width[frame]) - half
        buffers.bottom[k] = np.float32(crops.height[frame]) - half
        buffers.width[k] = crops.width[frame]
        buffers.start[k] = crops.start[frame]
        buffers.z_mm[k] = z_mm
        buffers.frame[k] = frame
        if target.n_classes:
            buffers.column[k] = column_of[target.classes[s]]
        else:
            for axis in range(3):
                buffers.direction[k, axis] = target.directions[s, axis]
