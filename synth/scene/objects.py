"""Imported objects among the procedural ones."""

from dataclasses import dataclass

import numpy as np

from synth.occluders.meshlib import MeshLibrary, MeshModel
from synth.vocabulary import SPLITS


@dataclass(frozen=True)
class ObjectMix:
    """A library of objects and how it is used.

    Attributes:
        library: The models; a frame takes only those of its own split.
        share: Share of the draws of an object, of a class that the library has, that take from it.
        splits: Splits that use it at all.
    """

    library: MeshLibrary
    share: float = 0.5
    splits: tuple[str, ...] = SPLITS

    def __post_init__(self) -> None:
        if not 0.0 <= self.share <= 1.0:
            raise ValueError(f"share={self.share} of the objects from the library must be in 0..1")
        unknown = [split for split in self.splits if split not in SPLITS]
        if unknown:
            raise ValueError(f"split {unknown[0]!r} is unknown; known are {', '.join(SPLITS)}")
        for split in self.splits:
            if not self.library.of(split):
                raise ValueError(f"the object library has no models for split {split!r}; leave that split out")

    def draw(
        self, class_name: str, split: str, kinds: tuple[str, ...], rng: np.random.Generator
    ) -> MeshModel | None:
        """A model that can stand in for one of the kinds (any use if there are none); None for a procedural one.

        No randomness is used where the library has nothing to offer.
        """
        if split not in self.splits:
            return None
        models = [m for m in self.library.of(split, class_name) if not kinds or m.role in kinds]
        if not models or rng.random() >= self.share:
            return None
        return models[int(rng.integers(len(models)))]
