from typing import get_args

import numpy as np
import pytest

from synth.bodies.body import Body
from synth.bodies.poses.draft import Draft
from synth.bodies.poses.draw import draw_arms, draw_base
from synth.bodies.poses.families import FAMILIES, Context, Occasion, PoseFamily, Posture, families_for
from synth.bodies.poses.sit import Sitting, TrunkRanges
from synth.bodies.shape.make import make_body
from synth.bodies.spec import BodySpec
from synth.geometry import inverse


@pytest.fixture(scope="module")
def body() -> Body:
    return make_body(BodySpec(1.76, 72.0, 1.0, 35.0))


def test_every_family_is_drawn_for_one_posture_context_and_occasion() -> None:
    occasions = get_args(Occasion)
    groups = [
        families_for(posture, context, occasion)
        for posture in get_args(Posture)
        for context in get_args(Context)
        for occasion in occasions
    ]
    names = [family.name for group in groups for family in group]
    assert sorted(names) == sorted(FAMILIES)
    assert all(family.weight > 0.0 for family in FAMILIES.values())


def test_only_what_settings_ask_for_is_left_out_of_daily_life() -> None:
    assert [family.name for family in families_for("standing", occasion="exercise")] == ["exercising"]
    assert {family.posture for family in FAMILIES.values() if family.occasion == "life"} == set(get_args(Posture))
    assert all(family.occasion == "daily" for family in families_for("standing"))


def test_one_row_is_all_that_a_new_way_to_sit_needs(body: Body) -> None:
    """A family that no module knows by name is drawn as its row says."""

    def leave_arms(draft: Draft, rng: np.random.Generator, targets: object) -> bool:
        return True

    level = Sitting((TrunkRanges((-30.0, -30.0), (20.0, 20.0), (5.0, 5.0)),), apart=(8.0, 8.0), forward=(0.1, 0.1))
    family = PoseFamily("lounging", "none", 1.0, level, leave_arms)
    base = draw_base(family, body, np.random.default_rng(0), 0.45)
    assert family.posture == "sitting"
    assert base.family == "lounging"
    lean = np.degrees(np.arcsin(inverse(base.T_world_root)[0, 2]))
    assert lean == pytest.approx(30.0, abs=0.5)
    arms = draw_arms(family, body, base, np.random.default_rng(1))
    assert arms is not None
    assert np.array_equal(arms.angles, base.angles)
