"""Furniture and other objects: specs are drawn by `sample`, and `make` builds them into closed labelled meshes.

from synth import occluders

spec = occluders.sample("table", rng, kind="desk", height=0.74)
desk = occluders.make(spec)
"""

from typing import TYPE_CHECKING

from storage.lazy import exports

if TYPE_CHECKING:
    from synth.occluders.model import Anchor, Occluder
    from synth.occluders.registry import GENERATORS, KINDS, from_plain, make, sample, to_plain

__all__ = [
    "GENERATORS",
    "KINDS",
    "Anchor",
    "Occluder",
    "from_plain",
    "make",
    "sample",
    "to_plain",
]

__getattr__, __dir__ = exports(
    __name__,
    {
        "synth.occluders.model": (
            "Anchor",
            "Occluder",
        ),
        "synth.occluders.registry": (
            "GENERATORS",
            "KINDS",
            "from_plain",
            "make",
            "sample",
            "to_plain",
        ),
    },
)
