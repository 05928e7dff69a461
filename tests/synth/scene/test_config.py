"""Settings of scenes are refused with one clear sentence where they make no sense."""

import numpy as np
import pytest

from synth.scene.config import DRAWS_PER_BLOCK, SceneConfig, SceneWeights, SplitShares
from synth.scene.pools import Pools, per_block


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"camera": "kinect_v9"}, "kinect_v9.*kinect_v2"),
        ({"mounting": "roof"}, "roof.*tripod"),
        ({"camera": "custom"}, "intrinsics"),
        ({"intrinsics": (320, 240, 285.0, 285.0, 160.0, 120.0)}, "custom"),
        ({"camera": "custom", "intrinsics": (320, 240, -285.0, 285.0, 160.0, 120.0)}, "positive"),
        ({"distance": (3.0, 2.0)}, "distance"),
        ({"distance": (-1.0, 2.0)}, "distance"),
        ({"clearance": (0.05, 0.03)}, "clearance"),
        ({"visible_share": (0.2, 1.2)}, "visible_share"),
        ({"frames_per_subject": 0}, "frames_per_subject"),
        ({"child_share": 1.5}, "child_share"),
        ({"seated_share": -0.1}, "seated_share"),
        ({"exercising_share": 1.1}, "exercising_share"),
        ({"standing_at_table_share": 2.0}, "standing_at_table_share"),
        ({"stature": (1.9, 1.5)}, "stature"),
        ({"stature": (0.5, 1.5)}, "stature"),
    ],
)
def test_a_setting_that_makes_no_sense_is_refused(settings: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        SceneConfig(**settings)


def test_weights_and_shares_must_be_positive_somewhere() -> None:
    with pytest.raises(ValueError, match="at least one"):
        SceneWeights(*[0.0] * len(SceneWeights.names()))
    with pytest.raises(ValueError, match="table=-1"):
        SceneWeights(table=-1.0)
    with pytest.raises(ValueError, match="not be all zero"):
        SplitShares(0.0, 0.0, 0.0)


@pytest.mark.parametrize("n_frames", [1, 2, 3, 7, 64, 1550])
def test_split_counts_add_up_and_follow_the_shares(n_frames: int) -> None:
    counts = SplitShares(0.7, 0.1, 0.2).counts(n_frames)
    assert sum(counts) == n_frames
    assert all(abs(count - share * n_frames) < 1.0 for count, share in zip(counts, (0.7, 0.1, 0.2), strict=True))


@pytest.mark.parametrize("frames_each", range(1, DRAWS_PER_BLOCK + 1))
def test_no_subject_serves_more_frames_on_average_than_asked_for(frames_each: int) -> None:
    assert DRAWS_PER_BLOCK / per_block(frames_each) <= frames_each


def test_adults_take_the_statures_asked_for_and_keep_their_mass_index() -> None:
    def people(**settings) -> list:
        pools = Pools(SceneConfig(child_share=0.3, **settings), seed=3)
        return [pools._subject_spec("train", number) for number in range(40)]

    as_drawn, asked = people(stature_share=0.0), people(stature=(1.85, 2.0), stature_share=1.0)
    assert {spec.age < 18 for spec in as_drawn} == {True, False}
    for before, after in zip(as_drawn, asked, strict=True):
        if before.age < 18:
            assert after == before
            continue
        assert 1.85 <= after.stature <= 2.0
        assert after.mass / after.stature**2 == pytest.approx(before.mass / before.stature**2, abs=0.05)
    assert np.ptp([spec.stature for spec in asked if spec.age >= 18]) > 0.08
    some = people(stature=(2.05, 2.1), stature_share=0.5)
    n_adults, n_tall = sum(s.age >= 18 for s in some), sum(s.stature >= 2.05 for s in some)
    assert 0.25 < n_tall / n_adults < 0.75
