"""Places are given to people once, the surest first; recall counts wanted people alone."""

import numpy as np
import pytest

from pipelines.corpus.rooms.matching import REACH_M, Truths, judge, judge_axes, level_distances, recall_at


def truths(*places, wanted=None, seen=None):
    """People who stand upright at (x, y)."""
    n = len(places)
    trunk = np.array([[(x, y, 1.6), (x, y, 1.5), (x, y, 1.2)] for x, y in places], dtype=float).reshape(n, 3, 3)
    flags = [np.ones(n, bool) if flag is None else np.array(flag) for flag in (wanted, seen)]
    return Truths(trunk, *flags, np.full(n, 3.0), np.ones(n), np.ones(n))


def test_the_nearest_person_gets_the_place():
    verdict = judge(truths((0, 0), (0.5, 0)), np.array([(0.3, 0.0), (0.2, 0.0), (2.0, 0.0)]))
    assert verdict.person.tolist() == [1, 0, -1]
    assert verdict.is_true.tolist() == [True, True, False]
    assert verdict.is_false.tolist() == [False, False, True]


def test_a_second_place_on_one_person_is_false():
    verdict = judge(truths((0, 0)), np.array([(0.1, 0.0), (0.0, 0.0)]))
    assert verdict.is_true.tolist() == [True, False]
    assert verdict.is_false.tolist() == [False, True]


def test_who_need_not_be_found_is_neither_true_nor_false():
    verdict = judge(truths((0, 0), (1, 0), wanted=[False, True]), np.array([(0.1, 0.0), (1.0, 0.0)]))
    assert verdict.is_true.tolist() == [False, True]
    assert verdict.is_false.tolist() == [False, False]
    assert verdict.n_wanted == 1


def test_who_is_not_seen_cannot_be_found():
    verdict = judge(truths((0, 0), wanted=[False], seen=[False]), np.array([(0.1, 0.0)]))
    assert verdict.is_false.tolist() == [True]


def test_a_scene_without_people_or_places_is_judged():
    assert judge(truths(), np.array([(0.0, 0.0)])).is_false.tolist() == [True]
    assert judge(truths((0, 0)), np.empty((0, 2))).n_wanted == 1


def test_distances_are_to_the_line_not_to_its_ends():
    trunk = np.array([[(0.0, 0.0, 1.6), (0.4, 0.0, 1.5), (0.4, 1.0, 1.2)]])
    places = np.array([(0.2, 0.3), (0.7, 0.5), (0.4, 1.5), (-0.1, 0.0)])
    assert level_distances(trunk, places)[:, 0] == pytest.approx([0.2, 0.3, 0.5, 0.1])


def test_camera_points_are_judged_in_the_world():
    T = np.array([[0, 0, 1, 1.0], [-1, 0, 0, 2.0], [0, -1, 0, 1.5], [0, 0, 0, 1]], dtype=float)
    verdict = judge_axes(truths((4.0, 2.5)), [np.array([-0.5, 0.2, 3.0])], T)
    assert verdict.is_true.tolist() == [True]
    assert judge_axes(truths((4.0, 2.5)), [], T).n_wanted == 1


def test_recall_is_that_at_the_score_where_false_places_are_few_enough():
    first = judge(truths((0, 0), (1, 0)), np.array([(0, 0.0), (5, 5.0), (1, 0.0), (6, 6.0)]))
    scores = np.array([4.0, 3.0, 2.0, 1.0], np.float32)
    verdicts, all_scores = [first] * 10, [scores] * 10
    assert recall_at(verdicts, all_scores, 0.1)[0] == pytest.approx(0.5)
    assert recall_at(verdicts, all_scores, 1.0)[0] == pytest.approx(1.0)
    recall, bound = recall_at(verdicts, all_scores, 5.0)
    assert (recall, bound) == (1.0, -np.inf)


def test_the_reach_is_a_bound():
    near, far = REACH_M - 0.01, REACH_M + 0.01
    assert judge(truths((0, 0)), np.array([(near, 0.0)])).is_true[0]
    assert not judge(truths((0, 0)), np.array([(far, 0.0)])).is_true[0]
