"""Which classes a forest tells apart: body parts, and occluders as its mode has it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forests.frames import LabelTable
from forests.oarf.config import Mode


@dataclass(frozen=True)
class ClassTable:
    """Classes of one mode: the body parts first, then the occluders.

    Attributes:
        names: By class.
        n_parts: The first so many classes are body parts.
    """

    names: tuple[str, ...]
    n_parts: int

    @classmethod
    def of(cls, labels: LabelTable, mode: Mode) -> "ClassTable":
        """The classes that a mode tells apart."""
        occluders = {"baseline": (), "occluders": ("occluder",), "semantic": labels.occluders}[mode]
        if not labels.occluders:
            occluders = ()
        return cls((*labels.parts, *occluders), labels.n_parts)

    @property
    def n_classes(self) -> int:
        """Number of classes."""
        return len(self.names)

    def of_label(self, labels: LabelTable) -> NDArray[np.uint8]:
        """(n_labels + 1,) uint8: class by label; index with an array of labels above 0."""
        lookup = np.arange(-1, labels.n_labels, dtype=np.int16)
        return np.clip(lookup, 0, self.n_classes - 1).astype(np.uint8)
