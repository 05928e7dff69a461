"""Which classes a forest tells apart: body parts, and occluders as its mode has it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forests.frames import LabelTable
from forests.oarf.config import Mode


@dataclass(frozen=True)
class ClassTable:
    """Classes of one mode: the body parts first, then the occluders, then the surroundings.

    Attributes:
        names: By class.
        n_parts: The first so many classes are body parts.
        n_silent: The last so many classes are surroundings, which vote for no joint.
    """

    names: tuple[str, ...]
    n_parts: int
    n_silent: int = 0

    @classmethod
    def of(cls, labels: LabelTable, mode: Mode) -> "ClassTable":
        """The classes that a mode tells apart."""
        occluders = {"baseline": (), "occluders": ("occluder",), "semantic": labels.occluders}[mode]
        if not labels.occluders:
            occluders = ()
        silent = () if mode == "baseline" else labels.surroundings
        return cls((*labels.parts, *occluders, *silent), labels.n_parts, len(silent))

    @property
    def n_classes(self) -> int:
        """Number of classes."""
        return len(self.names)

    def of_label(self, labels: LabelTable) -> NDArray[np.uint8]:
        """(n_labels + 1,) uint8: class by label; index with an array of labels above 0."""
        lookup = np.arange(-1, labels.n_labels, dtype=np.int16)
        if not self.n_silent:
            return np.clip(lookup, 0, self.n_classes - 1).astype(np.uint8)
        n_voting = self.n_classes - self.n_silent
        first_silent = labels.n_labels - len(labels.surroundings)
        lookup = np.where(
            lookup < first_silent, np.clip(lookup, 0, n_voting - 1), lookup - first_silent + n_voting
        )
        return lookup.astype(np.uint8)
