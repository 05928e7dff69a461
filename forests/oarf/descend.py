"""Pixels go down all trees of a forest, many in lockstep; one by one where trees ask for hints beside depth."""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import int32, njit
from numpy.typing import NDArray

from forests.crops import Crops, crop_classes
from forests.features import difference, hint_value, pixels_per_metre, probe
from forests.frames import Hints, Pinhole
from forests.samples import Samples
from forests.tree import check_tree

PACKED_NODE = np.dtype(
    [
        ("ux", np.float32),
        ("uy", np.float32),
        ("vx", np.float32),
        ("vy", np.float32),
        ("threshold", np.int32),
        ("left", np.int32),
        ("leaf", np.int32),
        ("hint", np.int32),
    ]
)
"""As `forests.tree.NODE_DTYPE` numbered through all trees, in 32 bytes: two to a cache line. hint: what a node asks
(`forests.features`); 0 in all nodes but of forests that are told more than depth."""

GROUP = 128
"""Pixels that go down together: the misses of one are waited for while the others are at work."""


class FlatTrees(NamedTuple):
    """All trees of a forest behind one another.

    Attributes:
        nodes: (n_nodes,) of PACKED_NODE.
        roots: (n_trees,) int32, numbers of the roots.
        leaf_start: (n_trees + 1,) int32: the leaves of tree t are numbered from leaf_start[t] on.
    """

    nodes: NDArray
    roots: NDArray[np.int32]
    leaf_start: NDArray[np.int32]


def flatten(
    trees: Sequence[NDArray], n_leaves: Sequence[int], hints: Sequence[NDArray[np.int16] | None] = ()
) -> FlatTrees:
    """Puts trees behind one another.

    Args:
        trees: Nodes of each, (n_nodes,) of NODE_DTYPE.
        n_leaves: Leaves of each.
        hints: What the nodes of each ask, (n_nodes,), where not all ask for depth.

    Raises:
        ValueError: No tree, or one that a descent would not end in.
    """
    if not trees:
        raise ValueError("a forest needs at least one tree")
    for nodes, n in zip(trees, n_leaves, strict=True):
        check_tree(nodes, n)
    roots = _starts([len(nodes) for nodes in trees])
    leaf_start = _starts(n_leaves)
    flat = np.zeros(roots[-1], PACKED_NODE)
    for nodes, root, leaf in zip(trees, roots, leaf_start, strict=False):
        packed = flat[root : root + len(nodes)]
        packed["ux"], packed["uy"] = nodes["u"].T
        packed["vx"], packed["vy"] = nodes["v"].T
        packed["threshold"] = nodes["threshold"]
        packed["left"] = nodes["left"] + root
        packed["leaf"] = np.where(nodes["leaf"] >= 0, nodes["leaf"] + leaf, -1)
    for asked, root in zip(hints, roots, strict=False):
        if asked is not None:
            flat["hint"][root : root + len(asked)] = asked
    return FlatTrees(flat, roots[:-1], leaf_start)


def _starts(counts: Sequence[int]) -> NDArray[np.int32]:
    return np.concatenate([np.zeros(1, np.int32), np.cumsum(counts, dtype=np.int32)])


def leaves_of_samples(crops: Crops, samples: Samples, nodes: NDArray, n_leaves: int) -> NDArray[np.int32]:
    """(n,) int32: the leaves of one tree that samples reach.

    Args:
        crops: The images that the samples are of.
        samples: (n,) pixels in order of frame.
        nodes: (n_nodes,) of NODE_DTYPE.
        n_leaves: Leaves of the tree.
    """
    flat = flatten([nodes], [n_leaves])
    first = np.searchsorted(samples.frame, np.arange(len(crops.start) + 1))
    leaves = np.empty((1, len(samples.frame)), np.int32)
    for frame, (begin, end) in enumerate(itertools.pairwise(first)):
        width, height = int(crops.width[frame]), int(crops.height[frame])
        pixels = crops.pixels[crops.start[frame] : crops.start[frame] + width * height]
        columns, rows = samples.x[begin:end].astype(np.int32), samples.y[begin:end].astype(np.int32)
        fx, fy = crops.intrinsics[frame, :2]
        reached = np.empty((1, end - begin), np.int32)
        descend(pixels, width, height, columns, rows, fx, fy, flat.nodes, flat.roots, reached)
        leaves[:, begin:end] = reached
    return leaves[0]


@njit(cache=True, nogil=True)
def descend(
    pixels: np.ndarray, width: int, height: int, columns: np.ndarray, rows: np.ndarray,
    fx: float, fy: float, nodes: np.ndarray, roots: np.ndarray, leaves: np.ndarray,
) -> None:  # fmt: skip
    """Finds the leaves of many pixels of one image.

    A pixel that has reached its leaf leaves the group, so that a level costs what is still on its way.

    Args:
        pixels: (height * width,) uint16 crop with a border [mm].
        width: Columns of the crop.
        height: Rows of the crop.
        columns: (n,) int32 in the crop, of pixels with depth.
        rows: (n,) int32 in the crop.
        fx: Focal length [px], float32.
        fy: Focal length [px], float32.
        nodes: (n_nodes,) of PACKED_NODE.
        roots: (n_trees,) int32.
        leaves: (n_trees, n) int32 to fill: leaves, numbered through all trees.
    """
    n = len(columns)
    half = np.float32(0.5)
    right, bottom = np.float32(width) - half, np.float32(height) - half
    pixel = np.empty((4, GROUP), np.float32)  # x, y plus one half, fx / z, fy / z
    here, offset = np.empty((4, GROUP), np.float32), np.empty((4, GROUP), np.float32)
    at, going = np.empty(GROUP, np.int32), np.empty(GROUP, np.int32)
    one, two = np.empty(GROUP, np.int32), np.empty(GROUP, np.int32)
    for first in range(0, n, GROUP):
        n_group = min(GROUP, n - first)
        for i in range(n_group):
            column, row = columns[first + i], rows[first + i]
            z_mm = pixels[row * width + column]
            pixel[0, i], pixel[1, i] = np.float32(column) + half, np.float32(row) + half
            pixel[2, i], pixel[3, i] = pixels_per_metre(fx, z_mm), pixels_per_metre(fy, z_mm)
        for tree in range(len(roots)):
            n_going = n_group
            for i in range(n_group):
                at[i], going[i] = roots[tree], i
            while n_going > 0:
                for k in range(n_going):
                    i = going[k]
                    node = nodes[at[i]]
                    offset[0, k], offset[1, k], offset[2, k], offset[3, k] = node.ux, node.uy, node.vx, node.vy
                    for row in range(4):
                        here[row, k] = pixel[row, i]
                _places(here, offset[0], offset[1], right, bottom, int32(width), one[:n_going])
                _places(here, offset[2], offset[3], right, bottom, int32(width), two[:n_going])
                n_left = 0
                for k in range(n_going):
                    i = going[k]
                    node = nodes[at[i]]
                    goes_right = difference(pixels[one[k]], pixels[two[k]]) > node.threshold
                    at[i] = node.left + int32(goes_right)
                    going[n_left] = i
                    n_left += int(node.leaf < 0)
                n_going = n_left
            for i in range(n_group):
                leaves[tree, first + i] = nodes[at[i]].leaf


@njit(cache=True, nogil=True)
def _places(
    here: np.ndarray, dx: np.ndarray, dy: np.ndarray, right: float, bottom: float, width: int, out: np.ndarray
) -> None:
    """Where probes read, with the arithmetic of `forests.features.probe`; an offset a pixel. Vectorises."""
    half = np.float32(0.5)
    for k in range(len(out)):
        column = min(max(here[0, k] + here[2, k] * dx[k], half), right)
        row = min(max(here[1, k] + here[3, k] * dy[k], half), bottom)
        out[k] = int32(row) * width + int32(column)


class Asked(NamedTuple):
    """What the trees of a forest ask for beside depth.

    Attributes:
        n_facts: They ask for some of the first so many facts.
        has_classes: Whether they ask for classes of pixels.
    """

    n_facts: int
    has_classes: bool


def asked_of(trees: FlatTrees) -> Asked:
    """What trees ask for beside depth."""
    hint = trees.nodes["hint"]
    return Asked(max(0, -int(hint.min(initial=0))), bool(hint.max(initial=0) > 0))


def check_hints(asked: Asked, hints: Hints, shape: tuple[int, ...]) -> None:
    """Makes sure that hints tell what trees ask for.

    Args:
        asked: What the trees ask for.
        hints: What is told of an image.
        shape: (height, width) of the image.

    Raises:
        ValueError: They do not.
    """
    if len(hints.facts) < asked.n_facts or (hints.classes is None and asked.has_classes):
        what = [f"{asked.n_facts} facts"] * (asked.n_facts > 0) + ["classes of pixels"] * asked.has_classes
        raise ValueError(f"the trees of this forest ask for hints, which must be given: {' and '.join(what)}")
    if asked.has_classes and hints.classes is not None and hints.classes.shape != shape:
        raise ValueError(f"hints have classes of shape {hints.classes.shape}, must be that of the depth, {shape}")


def with_hints(
    pixels: NDArray[np.uint16], width: int, height: int, left: int, top: int, camera: Pinhole, hints: Hints
) -> Crops:
    """One image's crop with what is told of it.

    Args:
        pixels: (height * width,) uint16 crop with a border [mm].
        width: Columns of the crop.
        height: Rows of the crop.
        left: Column in the image of the crop's first column.
        top: Row in the image of the crop's first row.
        camera: Intrinsics of the image.
        hints: What is told.
    """
    classes = np.zeros(0, np.uint8)
    if hints.classes is not None:
        classes = crop_classes(hints.classes, left, top, (height, width))
    return Crops(
        pixels,
        np.zeros(1, np.int64),
        np.array([width], np.int32),
        np.array([height], np.int32),
        np.array([[left, top]], np.int32),
        np.array([[camera.fx, camera.fy, camera.cx, camera.cy]], np.float32),
        classes,
        np.ascontiguousarray(hints.facts[None]),
    )


def leaves_with_hints(
    trees: FlatTrees, crops: Crops, columns: NDArray[np.int32], rows: NDArray[np.int32]
) -> NDArray[np.int32]:
    """Leaves of many pixels of one image.

    Args:
        trees: Trees that ask for no more than is told.
        crops: The image, with its hints.
        columns: (n,) in the crop, of pixels with depth.
        rows: (n,) in the crop.

    Returns:
        (n_trees, n) numbered through all trees.
    """
    leaves = np.empty((len(trees.roots), len(columns)), np.int32)
    _descend_with_hints(crops, columns, rows, trees.nodes, trees.roots, leaves)
    return leaves


@njit(cache=True, nogil=True)
def _descend_with_hints(
    crops: Crops, columns: np.ndarray, rows: np.ndarray, nodes: np.ndarray, roots: np.ndarray, leaves: np.ndarray
) -> None:
    """Pixel by pixel; fills in leaves."""
    pixels, width, height = crops.pixels, crops.width[0], crops.height[0]
    half, offset = np.float32(0.5), np.empty(2, np.float32)
    for i in range(len(columns)):
        z_mm = pixels[rows[i] * width + columns[i]]
        x, y = np.float32(columns[i]) + half, np.float32(rows[i]) + half
        fx_z = pixels_per_metre(crops.intrinsics[0, 0], z_mm)
        fy_z = pixels_per_metre(crops.intrinsics[0, 1], z_mm)
        for tree in range(len(roots)):
            at = roots[tree]
            while nodes[at].leaf < 0:
                node = nodes[at]
                if node.hint == 0:
                    one = probe(pixels, 0, width, height, x, y, fx_z, fy_z, node.ux, node.uy)
                    two = probe(pixels, 0, width, height, x, y, fx_z, fy_z, node.vx, node.vy)
                    value = difference(one, two)
                else:
                    offset[0], offset[1] = node.ux, node.uy
                    value = hint_value(
                        crops.classes, crops.facts, 0, 0, width, height, x, y, fx_z, fy_z, offset, node.hint
                    )
                at = node.left + int32(value > node.threshold)
            leaves[tree, i] = nodes[at].leaf
