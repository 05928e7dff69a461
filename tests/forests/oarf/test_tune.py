"""lambda_j and b_j are found where the truth has them; probabilities say what comes true."""

from dataclasses import replace

import numpy as np
import pytest
from sklearn.linear_model import LogisticRegression

from forests.calibration import fit_logistic, logistic, reliability
from forests.frames import FrameBatch, FrameSubset, Intrinsics, LabelTable
from forests.oarf.classes import ClassTable
from forests.oarf.config import OARFConfig
from forests.oarf.evidence import TERMS, Evidence, terms
from forests.oarf.model import ForestTree, OARFModel
from forests.oarf.packed import LeafTable, pack_leaves
from forests.oarf.predict import Predictor
from forests.oarf.tune import BANDWIDTHS_M, calibrated, tune, untuned
from forests.tree import LEAF_THRESHOLD, NODE_DTYPE

CAMERA = Intrinsics(120.0, 120.0, 39.5, 29.5)
LABELS = LabelTable(("body",), ("box",), ("near", "far"))


def two_leaves() -> ForestTree:
    """Tells pixels with something below them from pixels without; offsets of the first leaf are heavy and long.

    Of the joint "near", the long offset is wrong and the short one right; "far" has long offsets alone.
    """
    nodes = np.zeros(3, NODE_DTYPE)
    nodes["u"][0] = (0.0, 0.1)
    nodes["threshold"] = (1000, LEAF_THRESHOLD, LEAF_THRESHOLD)
    nodes["left"], nodes["leaf"] = (1, 1, 2), (-1, 0, 1)
    vote, weight = np.zeros((2, 2, 2, 2, 3), np.float32), np.zeros((2, 2, 2, 2), np.float32)
    vote[:, 0, 0, 0], weight[:, 0, 0, 0] = (0.0, -0.7, 0.0), 0.6
    vote[:, 0, 0, 1], weight[:, 0, 0, 1] = (0.0, 0.05, 0.0), 0.3
    vote[:, 0, 1, 0], weight[:, 0, 1, 0] = (0.0, 0.7, 0.0), 0.5
    probability = np.array([[1.0, 0.0], [0.5, 0.5]], np.float32)
    return ForestTree(nodes, pack_leaves(LeafTable(probability, vote, weight)))


def patches(n: int, seed: int, noise_m: float = 0.0) -> FrameBatch:
    """Small square patches, 2-3 m away, whose joints are where the right offsets put them, and noise beside."""
    rng = np.random.default_rng(seed)
    depth = np.zeros((n, 60, 80), np.uint16)
    joints = np.empty((n, 2, 3), np.float32)
    for i in range(n):
        left, top, z = rng.integers(5, 60), rng.integers(5, 45), rng.uniform(2.0, 3.0)
        depth[i, top : top + 4, left : left + 4] = round(1000 * z)
        centre = np.array([(left + 1.5 - 39.5) * z / 120.0, (top + 1.5 - 29.5) * z / 120.0, z])
        joints[i] = (
            centre + np.array([[0.0, 0.05, 0.0], [0.0, 0.7, 0.0]]) + rng.normal(0.0, noise_m + 1e-9, (2, 3))
        )
    label = (depth > 0).astype(np.uint8)
    return FrameBatch(depth, label, joints, CAMERA, LABELS, is_occluded=rng.random((n, 2)) < (0.0, 0.7))


def forest() -> OARFModel:
    config = OARFConfig(n_trees=1, n_voting_pixels=16)
    return OARFModel(config, LABELS, ClassTable.of(LABELS, "semantic"), (two_leaves(),), untuned(2))


def test_wrong_long_offsets_are_cut_off_and_right_ones_kept():
    tuned = tune(forest(), patches(12, 0)).tuning
    assert 0.05 < tuned.max_offset_m[0] < 0.7 < tuned.max_offset_m[1]
    assert set(tuned.bandwidth_m.tolist()) <= set(np.float32(BANDWIDTHS_M).tolist())


def test_tuning_makes_the_frames_joints_found():
    frames = patches(12, 1)
    before, after = Predictor(forest()), Predictor(tune(forest(), frames))
    for frame in frames:
        assert np.linalg.norm(before.predict(frame.depth, CAMERA).joints[0] - frame.joints[0]) > 0.5
        assert np.linalg.norm(after.predict(frame.depth, CAMERA).joints - frame.joints, axis=1).max() < 0.03


def test_tuning_is_the_same_for_any_number_of_threads():
    one, two = (tune(forest(), patches(20, 2, 0.1), n_threads=n).tuning for n in (1, 2))
    for name in ("max_offset_m", "bandwidth_m", "within_weights", "hidden_weights"):
        assert getattr(one, name).tobytes() == getattr(two, name).tobytes(), name


def test_probabilities_match_the_shares():
    """Errors of the joints are noise that nothing tells of, so the share itself is all there is to say."""
    frames, fresh = patches(150, 3, 0.06), patches(150, 4, 0.06)
    predictor = Predictor(tune(forest(), frames))
    estimates = [predictor.predict(frame.depth, CAMERA) for frame in fresh]
    within = np.stack([e.probability for e in estimates])
    hidden = np.stack([e.hidden_probability for e in estimates])
    error = np.stack([np.linalg.norm(e.joints - f.joints, axis=1) for e, f in zip(estimates, fresh, strict=True)])
    assert ((within >= 0) & (within <= 1) & (hidden >= 0) & (hidden <= 1)).all()
    assert np.allclose(within.mean(axis=0), (error <= 0.1).mean(axis=0), atol=0.12)
    assert hidden[:, 0].max() < 0.05
    assert abs(hidden[:, 1].mean() - 0.7) < 0.12


def test_a_joint_without_votes_is_not_within_reach():
    model = calibrated(tune(forest(), patches(12, 5)), patches(12, 5))
    estimate = Predictor(model).predict(np.zeros((60, 80), np.uint16), CAMERA)
    assert (estimate.probability == 0).all()
    assert ((estimate.hidden_probability >= 0) & (estimate.hidden_probability <= 1)).all()


def test_tuning_needs_frames_with_the_forests_joints():
    with pytest.raises(ValueError, match="no frames to tune on"):
        tune(forest(), FrameSubset(patches(1, 0), ()))
    other = replace(forest(), labels=replace(LABELS, joints=("near", "elsewhere")))
    with pytest.raises(ValueError, match="are not the forest's"):
        tune(other, patches(1, 0))


def logistic_truth(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Terms, the probabilities' weights, and outcomes drawn from them."""
    rng = np.random.default_rng(0)
    values = np.concatenate([np.ones((n, 1)), rng.normal(0.0, (1.0, 0.5, 2.0), (n, 3))], axis=1)
    weights = np.array([0.5, 1.5, -1.0, 0.4])
    return values, weights, rng.random(n) < 1.0 / (1.0 + np.exp(-values @ weights))


def test_weights_of_a_logistic_truth_are_recovered_as_scikit_learn_does():
    values, weights, outcome = logistic_truth(20_000)
    found = fit_logistic(values, outcome)
    assert np.allclose(found, weights, atol=0.1)
    scale = np.concatenate([[1.0], values[:, 1:].std(axis=0)])
    peer = LogisticRegression(C=1.0, tol=1e-8).fit(values[:, 1:] / scale[1:], outcome)
    assert np.allclose(found[1:] * scale[1:], peer.coef_[0], atol=0.01)


def test_a_logistic_truth_is_reliable_and_a_bold_one_is_not():
    values, weights, outcome = logistic_truth(20_000)
    honest = reliability(logistic(weights, values), outcome)
    bold = reliability(logistic(3.0 * weights, values), outcome)
    assert honest.n_samples.sum() == 20_000
    assert np.abs(honest.predicted - honest.observed).max() < 0.05
    assert honest.expected_error < 0.015 < 0.1 < bold.expected_error


def test_reliability_by_hand():
    found = reliability([0.0, 0.04, 0.96, 1.0, 0.5], [False, True, True, True, False], n_bins=4)
    assert found.n_samples.tolist() == [2, 0, 1, 2]
    assert np.allclose(found.predicted, [0.02, np.nan, 0.5, 0.98], equal_nan=True)
    assert np.allclose(found.observed, [0.5, np.nan, 0.0, 1.0], equal_nan=True)
    assert np.isclose(found.expected_error, (2 * 0.48 + 0.5 + 2 * 0.02) / 5)


@pytest.mark.parametrize("outcome", [False, True])
def test_what_always_happens_gets_a_sure_but_finite_probability(outcome):
    values = np.stack([np.ones(100), np.linspace(0.0, 1.0, 100)], axis=1)
    probability = logistic(fit_logistic(values, np.full(100, outcome)), values)
    assert ((probability > 0.97) if outcome else (probability < 0.03)).all()
    assert ((probability > 0) & (probability < 1)).all()


def test_a_constant_term_gets_no_weight():
    values = np.stack([np.ones(50), np.full(50, 3.0), np.arange(50.0)], axis=1)
    found = fit_logistic(values, np.arange(50) > 25)
    assert found[1] == 0.0
    assert np.isfinite(found).all()


def test_terms_are_finite_whatever_is_missing():
    nothing = np.full(2, np.nan, np.float32)
    values = terms(Evidence(np.zeros((2, 3), np.float32), nothing, nothing, nothing, nothing))
    assert values.shape == (2, len(TERMS))
    assert np.isfinite(values).all()
    assert terms(Evidence(np.ones((2, 1), np.float32), nothing, nothing, nothing, nothing))[0, 2] == 0.0


@pytest.mark.parametrize(
    ("probability", "outcome", "message"),
    [
        ([], [], r"\(n,\) both, n > 0"),
        ([0.5], [True, False], r"\(n,\) both"),
        ([1.5], [True], "must be in 0..1"),
        ([np.nan], [True], "must be in 0..1"),
    ],
)
def test_what_is_no_probability_is_refused(probability, outcome, message):
    with pytest.raises(ValueError, match=message):
        reliability(probability, outcome)


def test_terms_that_are_not_finite_are_refused():
    with pytest.raises(ValueError, match="finite"):
        fit_logistic(np.array([[1.0, np.nan]]), [True])
