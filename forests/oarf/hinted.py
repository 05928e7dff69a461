"""Descending in trees that ask for hints beside depth: experiments alone have them (`forests.frames.Hints`)."""

from typing import NamedTuple

import numpy as np
from numba import int32, njit
from numpy.typing import NDArray

from forests.crops import Crops, crop_classes
from forests.features import difference, hint_value, pixels_per_metre, probe
from forests.frames import Hints, Pinhole
from forests.oarf.descend import FlatTrees


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
    _descend(crops, columns, rows, trees.nodes, trees.roots, leaves)
    return leaves


@njit(cache=True, nogil=True)
def _descend(
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
