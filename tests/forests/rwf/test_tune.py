"""What is chosen on validation frames: steps, walks, and the probability of being near."""

import numpy as np
import pytest

from forests.frames import LabelTable
from forests.rwf.config import RWFConfig
from forests.rwf.model import ExpertTree, Limbs, RWFModel
from forests.rwf.tune import View, choose_walks, least_worth, step_budgets
from forests.rwf.walk import WalkPlan
from forests.tree import LEAF_THRESHOLD, NODE_DTYPE


def test_walks_get_fewer_when_their_steps_get_more():
    assert step_budgets(8, 10) == [(8, 7), (5, 14), (8, 10), (4, 20)]
    assert step_budgets(1, 1) == [(1, 1)]
    for n_walks, n_steps in ((3, 4), (4, 12), (2, 40)):
        budgets = step_budgets(n_walks, n_steps)
        assert (n_walks, n_steps) in budgets
        assert all(1 <= walks <= n_walks and walks * steps <= n_walks * n_steps for walks, steps in budgets)


def test_the_first_score_near_the_best_is_taken():
    assert least_worth([0.5, 0.59, 0.6, 0.58], 0.02) == 1
    assert least_worth([0.5, 0.59, 0.6, 0.61], 0.0) == 3


def model_that_steps_right(**config):
    nodes = np.zeros(1, NODE_DTYPE)
    nodes["threshold"] = LEAF_THRESHOLD
    to_the_right = ExpertTree(nodes, np.float32([[[1, 0, 0]]]), np.ones((1, 1), np.float32))
    one, length = np.ones(1, np.float32), np.zeros((1, 2), np.float32)
    gate = np.float32([[-np.inf, np.inf]])
    plan = WalkPlan(np.zeros(1, np.int32), np.int32([-1]), 9 * one, one, np.int32([5]), gate, 8, 10, 1)
    labels = LabelTable(("body",), (), ("neck",))
    limbs = Limbs(np.int32([-1]), length)
    settings = RWFConfig(joints=("neck",), n_clusters=1, **config)
    return RWFModel(settings, labels, ("neck",), ((to_the_right,),), plan, limbs, np.float32([[np.nan, np.nan]]))


def view_of(joint_m):
    wall, intrinsics = np.full((72, 96), 2000, np.uint16), np.float32([100, 100, 47.5, 35.5])
    return View(wall, intrinsics, np.float32([0, 0, 2]), np.float32([joint_m]))


@pytest.mark.parametrize(("joint_m", "is_reached"), [((0.25, 0.0, 2.0), True), ((-1.0, 0.0, 2.0), False)])
def test_tuning_takes_the_fewest_steps_that_reach_the_joint(joint_m, is_reached):
    model, view = model_that_steps_right(), view_of(joint_m)
    tuned = choose_walks(model, [view] * 30)
    assert (tuned.plan.n_walks, tuned.plan.n_steps) == (8, 7)
    assert (tuned.plan.step_m < 1).all()
    probability = 1 / (1 + np.exp(-tuned.within_weights[0, 0]))
    assert (probability > 0.9) if is_reached else (probability < 0.1)
    assert choose_walks(model, []) is model


def test_walks_are_as_long_as_the_config_lets_them_choose():
    ways = {}
    for ways_m in ((0.3,), (1.2,), (0.3, 1.2)):
        plan = choose_walks(model_that_steps_right(ways_m=ways_m), [view_of((0.25, 0.0, 2.0))] * 3).plan
        ways[ways_m] = round(float(plan.step_m[0]) * plan.n_steps, 3)
    assert ways == {(0.3,): 0.3, (1.2,): 1.2, (0.3, 1.2): 0.3}


@pytest.mark.parametrize("ways_m", [(), (0.3, 0.0), (-1.0,)])
def test_walks_without_length_are_refused(ways_m):
    with pytest.raises(ValueError, match="ways_m"):
        RWFConfig(ways_m=ways_m)
