"""Metrics against cases with known answers, scikit-learn, scipy, slow twins, and laws."""

from dataclasses import replace

import numpy as np
import pytest
from sklearn.metrics import average_precision_score
from toy_results import all_joints, measured, perfect, results_of, truths_of

from pipelines.metrics import (
    MEASURES,
    MeanAveragePrecision,
    accuracy_curve,
    by_family,
    by_hiding_class,
    by_joint,
    by_object_in_frame,
    by_state,
    by_visible_fraction,
    draw_frames,
    errors_2d,
    every_frame_once,
    rank_proposals,
    summarise,
)
from pipelines.metrics.document import score_document, table_lines
from pipelines.metrics.truths import upper_body_px
from tests import reference_metrics as reference


def area(confidence, distance):
    confidence, distance = np.array(confidence, float), np.array(distance, float)
    ranked = rank_proposals(confidence, distance, np.arange(len(distance)), 0.1)
    return MeanAveragePrecision((ranked,))(every_frame_once(len(distance)))[0]


class TestAveragePrecision:
    def test_by_hand(self):
        near, far = 0.02, 0.5
        assert area([[0.9], [0.8]], [[near], [near]]) == 1.0
        assert area([[0.9], [0.8]], [[near], [far]]) == 0.5
        # The false one comes first: precision 1/2 at recall 1/2.
        assert area([[0.8], [0.9]], [[near], [far]]) == 0.25
        # A second proposal at the right place is false, and here the most confident of all others.
        assert area([[0.9, 0.8], [0.7, 0.1]], [[near, near], [near, far]]) == pytest.approx(0.5 + 0.5 * 2 / 3)
        # A nearer one of less confidence does not count.
        assert area([[0.9, 0.5]], [[0.09, 0.01]]) == 1.0
        # A frame without any proposal is missed.
        assert area([[0.9], [0.0]], [[near], [np.nan]]) == 0.5
        assert area([[0.0], [0.0]], [[np.nan], [np.nan]]) == 0.0
        assert area([[1.0]], [[0.1]]) == 1.0

    def test_equal_confidences_stand_and_fall_together(self):
        assert area([[0.5], [0.5]], [[0.0], [1.0]]) == area([[0.5], [0.5]], [[1.0], [0.0]]) == 0.25

    @pytest.mark.parametrize("ties", [False, True])
    def test_equals_the_slow_twin(self, ties):
        rng = np.random.default_rng(2)
        for _ in range(20):
            confidence = -np.sort(-rng.random((30, 3)), axis=1)
            confidence = np.round(confidence, 1) if ties else confidence
            distance = rng.uniform(0, 0.3, (30, 3))
            distance[rng.random((30, 3)) < 0.2] = np.nan
            assert area(confidence, distance) == pytest.approx(reference.average_precision(confidence, distance))

    def test_equals_scikit_learn_where_every_truth_is_found(self):
        rng = np.random.default_rng(3)
        for _ in range(10):
            confidence = np.round(rng.random((50, 1)), 1)
            is_true = rng.random((50, 1)) < 0.6
            theirs = average_precision_score(is_true.ravel(), confidence.ravel())
            # Their recall counts the true proposals, ours the frames with the joint.
            assert area(confidence, np.where(is_true, 0.0, 1.0)) == pytest.approx(theirs * is_true.mean())

    def test_a_false_proposal_of_lowest_confidence_never_helps(self):
        rng = np.random.default_rng(4)
        for _ in range(20):
            confidence, distance = rng.random((20, 1)), rng.uniform(0, 0.2, (20, 1))
            more = np.full((20, 1), np.nan)
            more[rng.integers(20)] = 1.0
            assert area(np.hstack([confidence, 0 * confidence]), np.hstack([distance, more])) <= area(
                confidence, distance
            )

    def test_a_resample_equals_the_frames_repeated(self):
        rng = np.random.default_rng(5)
        confidence, distance = np.round(-np.sort(-rng.random((25, 2)), axis=1), 1), rng.uniform(0, 0.2, (25, 2))
        weights = draw_frames(25, 30, rng)
        ranked = rank_proposals(confidence, distance, np.arange(25), 0.1)
        areas = MeanAveragePrecision((ranked,))(weights)
        for counts, value in zip(weights, areas, strict=True):
            rows = [reference.repeated(values, counts) for values in (confidence, distance)]
            assert value == pytest.approx(reference.average_precision(*rows))


class TestMeasures:
    def test_a_perfect_predictor_scores_one(self):
        found = measured(perfect(truths_of()))
        assert [found[name] for name in MEASURES] == [1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]

    def test_by_hand(self):
        truths = truths_of(4, joints=("head",))
        results = perfect(truths)
        results.proposals[:, 0, 0, 0] += np.array([0.02, 0.08, 0.14, np.nan], np.float32)
        found = measured(results)
        assert found["accuracy_10cm"] == 0.5
        assert found["mean_error_cm"] == pytest.approx(8.0, abs=1e-4)
        assert found["median_error_cm"] == pytest.approx(11.0, abs=1e-4)
        assert found["auc_20cm"] == pytest.approx((0.9 + 0.6 + 0.3 + 0.0) / 4, abs=1e-5)
        assert found["missing"] == 0.25

    def test_the_median_is_infinite_where_most_joints_are_missed(self):
        results = perfect(truths_of(3, joints=("head",)))
        results.proposals[:2] = np.nan
        assert measured(results)["median_error_cm"] == np.inf

    def test_the_median_equals_numpys(self):
        for n in (9, 10):
            results = results_of(truths_of(n, joints=("head",)), missing=0)
            error = np.linalg.norm(results.proposals[:, :, 0].astype(float) - results.truths.xyz, axis=2)
            assert measured(results)["median_error_cm"] == pytest.approx(100 * np.median(error))

    def test_the_image_error_is_a_share_of_the_upper_body(self):
        truths = truths_of(20)
        results = perfect(truths)
        z = truths.xyz[:, :, 2]
        share = np.linspace(0.05, 0.15, 20)[:, None]
        results.proposals[:, :, 0, 0] += (share * truths.upper_body_px[:, None] * z / 365.0).astype(np.float32)
        np.testing.assert_allclose(errors_2d(results), np.broadcast_to(share, z.shape), rtol=1e-4)
        assert measured(results)["accuracy_2d"] == 0.5
        results.proposals[..., 2] = -1.0
        assert measured(results)["accuracy_2d"] == 0.0

    def test_bending_towards_the_camera_does_not_shrink_the_upper_body(self):
        xyz = np.zeros((2, 15, 3), np.float32)
        xyz[:, :, 2] = 2.0
        xyz[0, 1] = (0.0, -0.5, 2.0)
        xyz[1, 1], xyz[1, 9:11] = (0.0, 0.0, 1.75), (0.0, 0.0, 2.25)
        size = upper_body_px(xyz, np.tile([400.0, 400.0, 0.0, 0.0], (2, 1)))
        np.testing.assert_allclose(size, 100.0)

    def test_shares_lie_in_0_to_1(self):
        for seed in range(5):
            found = measured(results_of(truths_of(), error=0.1, seed=seed, ties=True))
            assert all(0 <= found[name] <= 1 for name in MEASURES if not name.endswith("_cm"))

    def test_the_order_of_frames_is_nothing(self):
        truths = truths_of()
        results = results_of(truths, ties=True)
        order = np.random.default_rng(0).permutation(len(truths))

        def shuffled(record):
            return {n: v[order] for n, v in vars(record).items() if isinstance(v, np.ndarray)}

        other = replace(results, truths=replace(truths, **shuffled(truths)), **shuffled(results))
        there, here = measured(results), measured(other)
        assert there == pytest.approx(here, rel=1e-12)

    def test_the_curve_rises_and_its_area_is_the_measure(self):
        results = results_of(truths_of(300), error=0.06)
        curve = accuracy_curve(results, all_joints(results.truths))
        assert (np.diff(curve) >= 0).all()
        assert curve[10] == measured(results)["accuracy_10cm"]
        assert np.trapezoid(curve, dx=1 / 20) == pytest.approx(measured(results)["auc_20cm"], abs=0.01)

    def test_a_joint_without_truth_is_not_counted(self):
        truths = truths_of()
        truths.xyz[:10, 0] = np.nan
        results = perfect(truths_of())
        summary = summarise(replace(results, truths=truths), all_joints(truths), every_frame_once(60))
        assert summary.n_joints == 60 * 3 - 10
        assert summary.measures["map_10cm"].estimate == summary.measures["accuracy_10cm"].estimate == 1.0

    def test_an_empty_group_has_no_measures(self):
        results = results_of(truths_of())
        nothing = ~all_joints(results.truths)
        summary = summarise(results, nothing, draw_frames(60, 10, np.random.default_rng(0)))
        assert summary.n_frames == summary.n_joints == 0
        assert all(np.isnan([m.estimate, m.low, m.high]).all() for m in summary.measures.values())
        assert np.isnan(accuracy_curve(results, nothing)).all()


class TestGroups:
    def test_states_part_the_joints(self):
        truths = truths_of()
        states = by_state(truths)
        four = [states[name] for name in ("visible", "occluded", "self_occluded", "outside")]
        assert (np.sum(four, axis=0) == 1).all()
        assert (states["non_occluded"] == ~states["occluded"]).all()

    @pytest.mark.parametrize("split", [by_joint, by_visible_fraction, by_family])
    def test_parts_the_joints(self, split):
        truths = truths_of()
        assert (np.sum(list(split(truths).values()), axis=0) == 1).all()

    def test_hiding_classes_part_the_occluded(self):
        truths = truths_of()
        assert (np.sum(list(by_hiding_class(truths).values()), axis=0) == (truths.state == 1)).all()

    def test_a_frame_with_two_classes_is_in_both_groups(self):
        truths = truths_of(2)
        truths.object_classes[:] = (0b110, 0)
        found = {name: is_in[:, 0].tolist() for name, is_in in by_object_in_frame(truths).items()}
        assert found == {"none": [False, True], "table": [True, False], "laptop": [True, False]}


def test_the_document_of_a_corpus_without_hidden_joints_has_nulls():
    truths = truths_of()
    truths.state[:], truths.hiding_class[:] = 0, 0
    document = score_document(results_of(truths), draw_frames(60, 20, np.random.default_rng(0)))
    assert document["occluded"]["map_10cm"] is document["occluded"]["map_10cm_ci"] is None
    assert document["by_hiding_class"] == {}
    assert document["non_occluded"] == document["visible"]
    assert all("nan" not in line for line in table_lines(document))
