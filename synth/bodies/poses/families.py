"""The pose families that bodies are drawn in."""

from dataclasses import dataclass
from typing import Literal

Posture = Literal["standing", "sitting"]
Context = Literal["none", "table", "laptop_table", "laptop_lap", "stroller"]


@dataclass(frozen=True)
class PoseFamily:
    """One named way to stand or sit.

    Attributes:
        name: Key in `FAMILIES`.
        posture: Whether the feet or a seat carry the person.
        context: What the scene must offer the hands; "none" needs nothing.
        weight: How often it is drawn, relative to the others; 0 = only where a scene's settings ask for it.
    """

    name: str
    posture: Posture
    context: Context
    weight: float


_ROWS: tuple[tuple[str, Posture, Context, float], ...] = (
    ("standing", "standing", "none", 2.0),
    ("walking", "standing", "none", 2.0),
    ("bending", "standing", "none", 1.0),
    ("reaching", "standing", "none", 1.5),
    ("arms_crossed", "standing", "none", 1.0),
    ("hands_on_hips", "standing", "none", 1.0),
    ("hand_at_face", "standing", "none", 1.0),
    ("phone", "standing", "none", 1.0),
    ("carrying", "standing", "none", 1.0),
    ("pointing", "standing", "none", 1.0),
    ("waving", "standing", "none", 0.5),
    ("exercising", "standing", "none", 0.0),
    ("sitting_feet_down", "sitting", "none", 2.0),
    ("sitting_legs_crossed", "sitting", "none", 1.0),
    ("sitting_leaning", "sitting", "none", 1.0),
    ("sitting_slouching", "sitting", "none", 1.0),
    ("table_hands", "sitting", "table", 1.5),
    ("table_elbows", "sitting", "table", 1.0),
    ("table_writing", "sitting", "table", 1.0),
    ("table_eating", "sitting", "table", 1.0),
    ("table_drinking", "sitting", "table", 1.0),
    ("typing_table", "sitting", "laptop_table", 2.0),
    ("typing_lap", "sitting", "laptop_lap", 1.0),
    ("pushing_both_hands", "standing", "stroller", 2.0),
    ("pushing_one_hand", "standing", "stroller", 1.0),
)
FAMILIES: dict[str, PoseFamily] = {row[0]: PoseFamily(*row) for row in _ROWS}
"""All pose families by name."""


def family_named(name: str) -> PoseFamily:
    """The family of a name; an unknown one is an error that lists the known ones."""
    if name not in FAMILIES:
        raise ValueError(f"pose family {name!r} is unknown; known are {', '.join(FAMILIES)}")
    return FAMILIES[name]
