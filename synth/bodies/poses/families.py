"""The pose families that bodies are drawn in: one table of what each needs, how often it is drawn, and how."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from synth.bodies.life.model import Posture
from synth.bodies.poses import arms, exercise, table
from synth.bodies.poses.draft import Draft
from synth.bodies.poses.hands import HandTargets
from synth.bodies.poses.recorded import Recorded
from synth.bodies.poses.sit import Range, Sitting, TrunkRanges
from synth.bodies.poses.stand import stand_bent, stand_leaning_to_push, stand_upright, walk

Context = Literal["none", "table", "laptop_table", "laptop_lap", "stroller"]
Occasion = Literal["daily", "exercise", "life"]
StandingBase = Callable[[Draft, np.random.Generator, float], None]
"""Sets trunk, head and legs of someone who stands; the number scales the variation, 1 as in life."""
Arms = Callable[[Draft, np.random.Generator, HandTargets | None], bool]
"""Moves the arms on top of a base; False if the hands do not get where they should."""


@dataclass(frozen=True)
class PoseFamily:
    """One named way to stand or sit.

    Attributes:
        name: Key in `FAMILIES`.
        context: What the scene must offer the hands; "none" needs nothing.
        weight: How often it is drawn, relative to the others of its posture, context and occasion.
        base: What draws trunk, head and legs of who stands, how people sit, or which recorded poses they take.
        arms: What draws the arms.
        occasion: "exercise" and "life" (wider than "daily") are drawn only where a scene's settings ask for it.
    """

    name: str
    context: Context
    weight: float
    base: StandingBase | Sitting | Recorded
    arms: Arms
    occasion: Occasion = "daily"

    @property
    def posture(self) -> Posture:
        """Whether the feet or a seat carry the person."""
        if isinstance(self.base, Recorded):
            return self.base.posture
        return "sitting" if isinstance(self.base, Sitting) else "standing"


_UPRIGHT = Sitting()
_CROSSED = Sitting(apart=(0.0, 5.0), forward=(-0.25, 0.1), are_legs_crossed=True, n_skipped=1)
_SLOUCHING = Sitting(
    (TrunkRanges((-38.0, -24.0), (14.0, 30.0), (8.0, 20.0), look=(0.0, 25.0)),), forward=(0.15, 0.55), n_skipped=1
)
_AT_EASE = Sitting(
    (
        TrunkRanges((-25.0, 0.0), (2.0, 18.0), (-5.0, 14.0), look=(-10.0, 25.0)),
        TrunkRanges((-8.0, 35.0), (4.0, 36.0), (2.0, 26.0), aside=(0.0, 12.0), look=(-5.0, 40.0)),
        TrunkRanges((-36.0, -18.0), (-6.0, 14.0), (-6.0, 8.0), aside=(0.0, 18.0), look=(-10.0, 15.0)),
    ),
    apart=(0.0, 24.0),
    forward=(-0.3, 0.5),
    unlike=1.0,
)
_LEANING = Sitting(
    (
        TrunkRanges((5.0, 20.0), (12.0, 28.0), (6.0, 18.0), look=(0.0, 30.0)),
        TrunkRanges((-30.0, -20.0), (0.0, 8.0), (-4.0, 5.0), look=(-5.0, 10.0)),
        TrunkRanges((-18.0, -6.0), (4.0, 12.0), (0.0, 10.0), aside=(10.0, 24.0), look=(0.0, 15.0)),
    )
)


def _at_table(pelvis: Range, lumbar: Range, thorax: Range, look: Range) -> Sitting:
    """Sitting with the feet under a table."""
    return Sitting((TrunkRanges(pelvis, lumbar, thorax, look=look),), forward=(-0.2, 0.15))


def _typing(pelvis: Range, lumbar: Range, thorax: Range, look: Range) -> Sitting:
    """Sitting with the eyes on a screen."""
    return Sitting((TrunkRanges(pelvis, lumbar, thorax, look=look),))


_HANDS_ON_TABLE = _at_table((-14.0, 0.0), (4.0, 15.0), (3.0, 14.0), look=(5.0, 28.0))
_DRINKING = _at_table((-14.0, 0.0), (4.0, 15.0), (3.0, 14.0), look=(0.0, 20.0))
_BENT_OVER_TABLE = _at_table((-6.0, 8.0), (8.0, 20.0), (6.0, 18.0), look=(15.0, 40.0))
_ON_ELBOWS = _at_table((0.0, 14.0), (14.0, 28.0), (8.0, 22.0), look=(-5.0, 15.0))
_TYPING_AT_TABLE = _typing((-14.0, 0.0), (4.0, 15.0), (3.0, 14.0), look=(8.0, 28.0))
_TYPING_ON_LAP = _typing((-18.0, -4.0), (6.0, 18.0), (4.0, 16.0), look=(15.0, 35.0))

_ROWS: tuple[PoseFamily, ...] = (
    PoseFamily("standing", "none", 2.0, stand_upright, arms.stand_idle),
    PoseFamily("walking", "none", 2.0, walk, arms.keep_relaxed),
    PoseFamily("bending", "none", 1.0, stand_bent, arms.bend_arms),
    PoseFamily("reaching", "none", 1.5, stand_upright, arms.reach_out),
    PoseFamily("arms_crossed", "none", 1.0, stand_upright, arms.cross_arms),
    PoseFamily("hands_on_hips", "none", 1.0, stand_upright, arms.hands_to_hips),
    PoseFamily("hand_at_face", "none", 1.0, stand_upright, arms.hand_to_face),
    PoseFamily("phone", "none", 1.0, stand_upright, arms.use_phone),
    PoseFamily("carrying", "none", 1.0, stand_upright, arms.carry),
    PoseFamily("pointing", "none", 1.0, stand_upright, arms.point_out),
    PoseFamily("waving", "none", 0.5, stand_upright, arms.wave),
    PoseFamily("exercising", "none", 1.0, exercise.stand_exercising, exercise.move_arms, "exercise"),
    PoseFamily("recorded_standing", "none", 8.0, Recorded("standing"), arms.keep_relaxed, "life"),
    PoseFamily("stretching", "none", 1.0, stand_upright, exercise.move_arms, "life"),
    PoseFamily("stooping", "none", 1.0, exercise.stand_stooped, arms.bend_arms, "life"),
    PoseFamily("squatting", "none", 0.8, exercise.squat, exercise.move_arms, "life"),
    PoseFamily("sitting_feet_down", "none", 2.0, _UPRIGHT, arms.sit_idle),
    PoseFamily("sitting_legs_crossed", "none", 1.0, _CROSSED, arms.sit_idle),
    PoseFamily("sitting_leaning", "none", 1.0, _LEANING, arms.sit_leaning),
    PoseFamily("sitting_slouching", "none", 1.0, _SLOUCHING, arms.sit_idle),
    PoseFamily("recorded_sitting", "none", 5.0, Recorded("sitting"), arms.keep_relaxed, "life"),
    PoseFamily("sitting_at_ease", "none", 1.0, _AT_EASE, arms.sit_idle, "life"),
    PoseFamily("sitting_gesturing", "none", 1.0, _AT_EASE, exercise.move_arms, "life"),
    PoseFamily("table_hands", "table", 1.5, _HANDS_ON_TABLE, table.hands_on_table),
    PoseFamily("table_elbows", "table", 1.0, _ON_ELBOWS, table.elbows_on_table),
    PoseFamily("table_writing", "table", 1.0, _BENT_OVER_TABLE, table.write),
    PoseFamily("table_eating", "table", 1.0, _BENT_OVER_TABLE, table.eat),
    PoseFamily("table_drinking", "table", 1.0, _DRINKING, table.drink),
    PoseFamily("typing_table", "laptop_table", 2.0, _TYPING_AT_TABLE, table.type_keys),
    PoseFamily("typing_lap", "laptop_lap", 1.0, _TYPING_ON_LAP, table.type_keys),
    PoseFamily("pushing_both_hands", "stroller", 2.0, stand_leaning_to_push, table.push_both),
    PoseFamily("pushing_one_hand", "stroller", 1.0, stand_leaning_to_push, table.push_one),
)
FAMILIES: dict[str, PoseFamily] = {row.name: row for row in _ROWS}
"""All pose families by name."""


def family_named(name: str) -> PoseFamily:
    """The family of a name; an unknown one is an error that lists the known ones."""
    if name not in FAMILIES:
        raise ValueError(f"pose family {name!r} is unknown; known are {', '.join(FAMILIES)}")
    return FAMILIES[name]


def families_for(posture: Posture, context: Context = "none", occasion: Occasion = "daily") -> list[PoseFamily]:
    """The families of a posture that suit what the scene offers the hands and what people do there."""
    return [f for f in FAMILIES.values() if (f.posture, f.context, f.occasion) == (posture, context, occasion)]
