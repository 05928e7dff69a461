"""How methods are called and drawn: colours of Okabe and Ito, told apart by dashes and markers too."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from pipelines.models.kinds import KINDS, Marker


@dataclass(frozen=True)
class Method:
    """A method, or another series of a chart.

    Attributes:
        kind: Of model; empty for a series that is no method.
        name: In tables.
        short: Over pictures.
        colour: As CSS has it.
        dash: SVG dash pattern, empty for a full line.
        marker: At points.
    """

    kind: str
    name: str
    short: str
    colour: str
    dash: str
    marker: Marker


METHODS: Mapping[str, Method] = {
    name: Method(kind.name, variant.title, variant.short, variant.colour, variant.dash, variant.marker)
    for kind in KINDS.values()
    for name, variant in kind.variants.items()
}
"""By row of the ablation, in the order in which they are shown; of a kind, the one that knows most comes last."""
DIFFERENCE = Method("", "difference", "difference", "#d55e00", "", "diamond")
"""How the difference of two methods is drawn."""

HEADLINES = ("semantic - occluders", "semantic - baseline")
"""Differences that the page begins with, and that every question is about."""
CLASS_PAIRS = (("semantic", "occluders"), ("occluders", "baseline"), ("semantic", "baseline"))
"""Pairs of methods that are compared by class of object: first minus second."""
EXAMPLE_PAIRS = (
    ("semantic", "occluders"),
    ("semantic", "baseline"),
    ("occluders", "baseline"),
    ("rwf", "rwf_body"),
    ("heat", "heat_body"),
    ("heat_classes", "heat_object"),
)
"""Example frames are ordered by the gain of the first of these pairs that is there."""


def pair_name(key: str) -> str:
    """What "first - second" of an ablation compares, in words."""
    first, second = (METHODS[name].short for name in key.split(" - "))
    return f"{first} \N{MINUS SIGN} {second}"


def shown_methods(names: Iterable[str]) -> tuple[str, ...]:
    """Those of some methods that are drawn over recordings: of each kind, the last in `METHODS`."""
    given = set(names)
    last = {method.kind: name for name, method in METHODS.items() if name in given}
    return tuple(last.values())


def kinds_of(names: Iterable[str]) -> tuple[str, ...]:
    """The kinds of models of some methods, each once."""
    return tuple(dict.fromkeys(METHODS[name].kind for name in names))
