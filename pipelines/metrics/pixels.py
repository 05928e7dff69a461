"""How well pixels are labelled: confusion matrices of body parts and occluder classes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Confusion:
    """How many pixels of each label were given each class.

    Attributes:
        counts: (n_labels, n_classes) int64; rows are the truth's labels from 1 on, parts first, columns the
            model's classes, parts first.
        labels: Names of the rows.
        classes: Names of the columns.
        n_parts: The first so many rows and columns are body parts.
    """

    counts: NDArray[np.int64]
    labels: tuple[str, ...]
    classes: tuple[str, ...]
    n_parts: int

    @property
    def n_occluder_classes(self) -> int:
        """Occluder classes that the model tells apart: none for a baseline, 1 without semantics."""
        return len(self.classes) - self.n_parts

    @property
    def part_accuracy(self) -> float:
        """Mean over body parts of the share of their pixels that are labelled right (Shotton et al. 2011)."""
        n = self.n_parts
        return _mean_share(self.counts[:n, :n].diagonal(), self.counts[:n].sum(axis=1))

    @property
    def occluder_accuracy(self) -> float:
        """Mean over occluder classes of the share labelled right; one class for all is right for each.

        NaN if the model has no occluder classes.
        """
        n = self.n_parts
        if not self.n_occluder_classes:
            return np.nan
        own = self.counts[n:, n:]
        return _mean_share(
            own[:, 0] if self.n_occluder_classes == 1 else own.diagonal(), self.counts[n:].sum(axis=1)
        )

    @property
    def object_recall(self) -> float:
        """Share of the objects' pixels that are given an occluder class, whichever; 0 for a baseline."""
        n = self.n_parts
        return _mean_share(self.counts[None, n:, n:].sum(axis=(1, 2)), self.counts[None, n:].sum(axis=(1, 2)))

    @property
    def body_recall(self) -> float:
        """Share of the person's pixels that are given a body part, whichever."""
        n = self.n_parts
        return _mean_share(self.counts[None, :n, :n].sum(axis=(1, 2)), self.counts[None, :n].sum(axis=(1, 2)))

    @property
    def class_accuracy(self) -> float:
        """Mean over all labels, parts and occluders, of the share labelled right.

        A model without occluder classes gets every pixel of an object wrong: it was made to call it a body part.
        """
        right = np.zeros(len(self.labels))
        n = self.n_parts
        right[:n] = self.counts[:n, :n].diagonal()
        if self.n_occluder_classes:
            own = self.counts[n:, n:]
            right[n:] = own[:, 0] if self.n_occluder_classes == 1 else own.diagonal()
        return _mean_share(right, self.counts.sum(axis=1))


def _mean_share(right: NDArray, n: NDArray) -> float:
    """Mean of right / n over the labels that occur; NaN if none does."""
    is_there = n > 0
    return float((right[is_there] / n[is_there]).mean()) if is_there.any() else np.nan


def count_pixels(
    label: NDArray[np.uint8], given: NDArray[np.uint8], n_labels: int, n_classes: int
) -> NDArray[np.int64]:
    """Counts one image's pixels by label and class.

    Args:
        label: (height, width) uint8, the truth, 0 = nothing.
        given: (height, width) uint8, the model's class + 1, 0 = nothing; such pixels are not counted: the sensor
            measured nothing there.
        n_labels: Labels besides 0.
        n_classes: Classes of the model.

    Returns:
        (n_labels, n_classes) int64.

    Raises:
        ValueError: A class that the model does not have.
    """
    is_counted = (label > 0) & (given > 0)
    rows, columns = label[is_counted].astype(np.int64) - 1, given[is_counted].astype(np.int64) - 1
    if columns.size and columns.max() >= n_classes:
        raise ValueError(f"class {columns.max()} is not in 0..{n_classes - 1}")
    return np.bincount(rows * n_classes + columns, minlength=n_labels * n_classes).reshape(n_labels, n_classes)
