"""How methods are called and drawn: colours of Okabe and Ito, told apart by dashes and markers too."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Marker = Literal["disc", "square", "diamond", "triangle", "cross"]


@dataclass(frozen=True)
class Method:
    """A method, or another series of a chart.

    Attributes:
        name: In tables.
        short: Over pictures.
        colour: As CSS has it.
        dash: SVG dash pattern, empty for a full line.
        marker: At points.
    """

    name: str
    short: str
    colour: str
    dash: str
    marker: Marker


METHODS: Mapping[str, Method] = {
    "baseline": Method("Baseline", "baseline", "currentColor", "2 3", "disc"),
    "occluders": Method("OARF without semantics", "without semantics", "#0072b2", "7 3", "square"),
    "semantic": Method("OARF with semantics", "with semantics", "#d55e00", "", "diamond"),
    "rwf_body": Method("Random walks, learned from bodies", "random walks, bodies", "#cc79a7", "1 2", "triangle"),
    "rwf": Method("Random walks, learned with objects", "random walks", "#009e73", "8 3 2 3", "cross"),
}
"""By row of the ablation, in the order in which they are shown."""


def pair_name(key: str) -> str:
    """What "first - second" of an ablation compares, in words."""
    first, second = (METHODS[name].short for name in key.split(" - "))
    return f"{first} \N{MINUS SIGN} {second}"
