"""Puts the parts of a scene together."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from synth.occluders.imported.shape import Triangles

MAX_FACES_READ = 20_000_000
"""No file may hold or place more triangles than this."""
_NODE = 1000
"""A node of a scene counts as so many triangles, since it takes time even without any."""


def placed(part: Triangles, T: NDArray[np.float64]) -> Triangles:
    """A part after an affine transform (4, 4); its faces keep looking outwards where that mirrors."""
    faces = part.faces[:, ::-1] if np.linalg.det(T[:3, :3]) < 0.0 else part.faces
    return Triangles(part.vertices @ T[:3, :3].T + T[:3, 3], faces)


def together(parts: Sequence[Triangles]) -> Triangles:
    """All parts as one mesh.

    Raises:
        ValueError: They have no triangles.
    """
    if not any(len(part.faces) for part in parts):
        raise ValueError("there are no triangles in it")
    first = np.cumsum([0, *(len(part.vertices) for part in parts)])
    return Triangles(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.faces + n for part, n in zip(parts, first, strict=False)]),
    )


class FaceBudget:
    """Counts the triangles that a scene places, since a small file can place one mesh ever so often."""

    def __init__(self) -> None:
        self._left = MAX_FACES_READ

    def take(self, n: int = 0) -> None:
        """Takes a node, or a part with n triangles.

        Raises:
            ValueError: There would be more than `MAX_FACES_READ`.
        """
        self._left -= n + _NODE
        if self._left < 0:
            raise ValueError(
                f"its scene places more than {MAX_FACES_READ:,} triangles, or {MAX_FACES_READ // _NODE:,} nodes"
            )
