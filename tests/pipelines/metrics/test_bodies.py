"""Headings and sides of whole skeletons, on people whose answers are known."""

from dataclasses import replace

import numpy as np
import pytest
from toy_results import results_of, truths_of

from pipelines.metrics import draw_frames
from pipelines.metrics.bodies import BODY_MEASURES, measure_bodies

JOINTS = ("head", "r_shoulder", "l_shoulder", "r_hand", "l_hand")
FACING = np.float32([[0, -0.5, 2.5], [-0.2, -0.3, 2.5], [0.2, -0.3, 2.5], [-0.4, 0.1, 2.4], [0.4, 0.1, 2.4]])
N = 40


def answered(xyz: np.ndarray):
    truths = replace(truths_of(N, joints=JOINTS), xyz=np.tile(FACING, (N, 1, 1)))
    results = results_of(truths, k=2, missing=0)
    return replace(results, proposals=np.stack([xyz, xyz + 1.0], axis=2).astype(np.float32))


def measured(xyz: np.ndarray):
    measures = measure_bodies(answered(xyz), draw_frames(N, 200, np.random.default_rng(0)))
    assert tuple(measures) == BODY_MEASURES
    for measure in measures.values():
        assert measure.low <= measure.estimate <= measure.high
    return {name: measure.estimate for name, measure in measures.items()}


def test_right_answers_face_the_right_way():
    assert measured(np.tile(FACING, (N, 1, 1))) == pytest.approx(
        {"heading_flipped": 0.0, "heading_error_deg": 0.0, "swapped": 0.0}, abs=0.05
    )


def test_left_for_right_is_a_flip_and_swaps_hands_and_shoulders():
    xyz = np.tile(FACING, (N, 1, 1))
    xyz[:10] = xyz[:10, [0, 2, 1, 4, 3]]
    found = measured(xyz)
    assert found["heading_flipped"] == pytest.approx(0.25)
    assert found["swapped"] == pytest.approx(0.25)


def test_hands_alone_can_be_swapped_and_a_turn_is_told_in_degrees():
    xyz = np.tile(FACING, (N, 1, 1))
    xyz[:, 1:3, 2] += np.float32([0.2, -0.2]) * np.tan(np.radians(30))
    xyz[:20, 3:] = xyz[:20, :2:-1]
    found = measured(xyz)
    assert found["heading_flipped"] == 0.0
    assert found["heading_error_deg"] == pytest.approx(30.0, abs=0.1)
    assert found["swapped"] == pytest.approx(0.25)


def test_missing_answers_are_neither_flipped_nor_swapped():
    xyz = np.tile(FACING, (N, 1, 1))
    xyz[:, 1:] = np.nan
    measures = measure_bodies(answered(xyz), draw_frames(N, 50, np.random.default_rng(0)))
    assert np.isnan(measures["heading_flipped"].estimate)
    assert measures["swapped"].estimate == 0.0
