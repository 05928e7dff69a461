"""The fixed skin: triangles, labels, weights and segment coordinates, read from the package's data."""

from functools import cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.bodies.body import SkinWeights
from synth.bodies.shape.laying import Laying, laying_of
from synth.vocabulary import MIRRORED_PART

SKIRT_EASE, SKIRT_FLARE = 0.02, 0.06
"""The skirt of the templates: cloth's distance from the skin, and how much wider the hem is [m]."""
LEAST_ASIDE = 5e-4
"""Vertices off the midline stay at least so far from it [m]."""


class Template(NamedTuple):
    """One skin topology; the first n_half vertices are the left half with the midline, the rest their images.

    Attributes:
        laying: Where the left half's vertices lie about the segments that hold them.
        on_plane: (n_half,) bool, on the midline.
        faces: (n_faces, 3) int32.
        face_label: (n_faces,) uint8.
        weights: Skin weights of all vertices.
        mirror: (n_vertices,) int64 index of each vertex's image.
        ring_start: (n_half + 1,) int32 CSR starts of the vertices' neighbours in the left half.
        ring: (n_edges,) int32 the neighbours.
        ring_weight: (n_edges,) float64 their mean value weights; those of a vertex sum to 1.
    """

    laying: Laying
    on_plane: NDArray[np.bool_]
    faces: NDArray[np.int32]
    face_label: NDArray[np.uint8]
    weights: SkinWeights
    mirror: NDArray[np.int64]
    ring_start: NDArray[np.int32]
    ring: NDArray[np.int32]
    ring_weight: NDArray[np.float64]


@cache
def template(name: str) -> Template:
    """Reads a template.

    Args:
        name: "template", "template_skirt" or "template_long_skirt".
    """
    with np.load(str(files("synth.bodies") / "data" / f"{name}.npz")) as data:
        on_plane = data["on_plane"]
        n_half = len(on_plane)
        off_plane = np.flatnonzero(~on_plane)
        image = np.arange(n_half)
        image[off_plane] = n_half + np.arange(len(off_plane))
        half, label = data["faces"], data["face_label"]
        return Template(
            laying_of(
                data["segment"].astype(np.int64),
                data["share"].astype(np.float64),
                data["coords"].astype(np.float64),
            ),
            on_plane,
            np.concatenate([half, image[half][:, ::-1]]).astype(np.int32),
            np.concatenate([label, np.array(MIRRORED_PART)[label]]).astype(np.uint8),
            SkinWeights(data["indptr"], data["link"].astype(np.int32), data["weight"]),
            np.concatenate([image, off_plane]),
            data["ring_start"],
            data["ring"],
            data["ring_weight"].astype(np.float64),
        )


def mirrored_vertices(skin: Template, half: NDArray[np.float64]) -> NDArray[np.float64]:
    """All vertices from the left half's.

    Args:
        skin: The template.
        half: (n_half, 3) [m].
    """
    return _mirrored(half, skin.on_plane, LEAST_ASIDE)


@njit(cache=True, nogil=True)
def _mirrored(half: NDArray[np.float64], on_plane: NDArray[np.bool_], least: float) -> NDArray[np.float64]:
    """The left half with its points put on or off the midline, then the images of those that are off it."""
    n = half.shape[0]
    out = np.empty((2 * n - np.sum(on_plane), 3))
    image = n
    for v in range(n):
        out[v, 0], out[v, 2] = half[v, 0], half[v, 2]
        out[v, 1] = 0.0 if on_plane[v] else max(half[v, 1], least)
        if not on_plane[v]:
            out[image, 0], out[image, 1], out[image, 2] = out[v, 0], -out[v, 1], out[v, 2]
            image += 1
    return out
