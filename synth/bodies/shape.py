"""BodySpec: a person's measures, drawn from published statistics."""

from dataclasses import dataclass


@dataclass(frozen=True)
class BodySpec:
    """A person's measures.

    Attributes:
        stature: Standing height without shoes [m].
        mass: [kg].
        sex: 0 = female .. 1 = male.
        age: [years].
    """

    stature: float
    mass: float
    sex: float
    age: float
