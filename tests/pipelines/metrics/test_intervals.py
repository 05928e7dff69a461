"""Confidence intervals and paired tests against scipy, simulations and laws."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.stats
from toy_results import all_joints, measured, results_of, truths_of

from pipelines.metrics import (
    MEASURES,
    MeanAveragePrecision,
    by_state,
    compare,
    draw_frames,
    every_frame_once,
    interval,
    rank_proposals,
    summarise,
)


class TestIntervals:
    def test_hold_the_estimate(self):
        for seed in range(5):
            results = results_of(truths_of(), error=0.08, seed=seed, ties=True)
            weights = draw_frames(60, 300, np.random.default_rng(seed))
            for is_counted in by_state(results.truths).values():
                for measure in summarise(results, is_counted, weights).measures.values():
                    assert measure.low <= measure.estimate <= measure.high

    def test_of_a_mean_equal_scipys(self):
        results = results_of(truths_of(200), error=0.06, missing=0)
        weights = draw_frames(200, 4000, np.random.default_rng(1))
        measure = summarise(results, all_joints(results.truths), weights).measures["mean_error_cm"]
        error = 100 * np.linalg.norm(results.proposals[:, :, 0].astype(float) - results.truths.xyz, axis=2)
        theirs = scipy.stats.bootstrap(
            (error.mean(axis=1),), np.mean, n_resamples=4000, method="BCa", rng=np.random.default_rng(2)
        )
        width = theirs.confidence_interval.high - theirs.confidence_interval.low
        assert measure.low == pytest.approx(theirs.confidence_interval.low, abs=0.08 * width)
        assert measure.high == pytest.approx(theirs.confidence_interval.high, abs=0.08 * width)

    def test_are_percentiles_where_nothing_is_to_be_corrected(self):
        values = np.arange(1001.0)
        assert interval(500.0, values) == pytest.approx((25, 975), abs=1)
        low, high = interval(400.0, values)
        assert low < 25
        assert high < 975

    def test_cover_the_truth_of_average_precision_better_than_plain_percentiles(self):
        rng = np.random.default_rng(6)

        def drawn(n):
            is_true = rng.random((n, 2)) < (0.3, 0.1)
            confidence = rng.normal(size=(n, 2)) + is_true - (0.0, 0.7)
            order = np.argsort(-confidence, axis=1)
            rows = (np.take_along_axis(v, order, 1) for v in (confidence, np.where(is_true, 0.0, 1.0)))
            return rank_proposals(*rows, np.arange(n), 0.1)

        truth = MeanAveragePrecision((drawn(100_000),))(every_frame_once(100_000))[0]
        n_held = n_plain = 0
        for _ in range(60):
            score = MeanAveragePrecision(tuple(drawn(50) for _ in range(20)))
            estimate, values = score(every_frame_once(50))[0], score(draw_frames(50, 300, rng))
            low, high = interval(estimate, values)
            n_held += low <= truth <= high
            low, high = np.quantile(values, (0.025, 0.975))
            n_plain += low <= truth <= high
        # Few frames a joint and many joints: the bias of average precision is as large as its spread.
        assert n_held >= 47
        assert n_held > n_plain + 5

    def test_of_one_seed_are_equal(self):
        results = results_of(truths_of())
        one, two = (
            summarise(results, all_joints(results.truths), draw_frames(60, 50, np.random.default_rng(7)))
            for _ in range(2)
        )
        assert one == two

    def test_draws_are_as_many_as_frames(self):
        weights = draw_frames(17, 40, np.random.default_rng(0))
        assert (weights.sum(axis=1) == 17).all()


class TestComparing:
    def test_a_method_with_itself_has_no_difference(self):
        results = results_of(truths_of())
        for found in compare(results, results, all_joints(results.truths), np.random.default_rng(0), 200).values():
            assert (found.estimate, found.low, found.high, found.p_value) == (0, 0, 0, 1)

    def test_tells_a_better_method_and_by_how_much(self):
        truths = truths_of(150)
        good, bad = results_of(truths, 0.03, seed=1), results_of(truths, 0.08, seed=2, k=1)
        found = compare(good, bad, all_joints(truths), np.random.default_rng(0), 500)
        for name in ("map_10cm", "accuracy_10cm", "auc_20cm"):
            alone = measured(good)[name], measured(bad)[name]
            assert (found[name].first, found[name].second) == pytest.approx(alone)
            assert 0 < found[name].low <= found[name].estimate <= found[name].high
            assert found[name].p_value == pytest.approx(1 / 501)
        assert found["mean_error_cm"].high < 0

    def test_exchanging_the_methods_turns_the_sign(self):
        truths = truths_of()
        pair = results_of(truths, 0.06, seed=1), results_of(truths, 0.06, seed=2)
        there, back = (
            compare(*order, all_joints(truths), np.random.default_rng(0), 300) for order in (pair, pair[::-1])
        )
        for name in MEASURES:
            assert there[name].estimate == pytest.approx(-back[name].estimate)
            assert there[name].p_value == back[name].p_value

    def test_the_unit_of_confidences_is_nothing(self):
        truths = truths_of()
        first, second = results_of(truths, 0.06, seed=1), results_of(truths, 0.06, seed=2)
        scaled = replace(second, proposal_confidence=second.proposal_confidence * 1000)
        plain, other = (
            compare(first, item, all_joints(truths), np.random.default_rng(0), 100) for item in (second, scaled)
        )
        assert plain == other

    def test_p_values_of_equal_methods_are_uniform(self):
        p = []
        for seed in range(80):
            truths = truths_of(40, seed)
            pair = (results_of(truths, 0.07, seed=1000 + 2 * seed + i) for i in range(2))
            p.append(compare(*pair, all_joints(truths), np.random.default_rng(seed), 100)["map_10cm"].p_value)
        assert scipy.stats.kstest(p, "uniform").pvalue > 0.01

    def test_the_sign_flip_test_equals_scipys(self):
        truths = truths_of(50, joints=("head",))
        first, second = results_of(truths, 0.06, seed=1, missing=0), results_of(truths, 0.07, seed=2, missing=0)
        found = compare(first, second, all_joints(truths), np.random.default_rng(0), 4000)["auc_20cm"]
        near = [
            1 - np.minimum(np.linalg.norm(m.proposals[:, 0, 0].astype(float) - truths.xyz[:, 0], axis=1) / 0.2, 1)
            for m in (first, second)
        ]
        theirs = scipy.stats.permutation_test(
            near, lambda a, b, axis: (a - b).mean(axis=axis), permutation_type="samples", n_resamples=4000,
            vectorized=True, rng=np.random.default_rng(1),
        )  # fmt: skip
        assert found.p_value == pytest.approx(theirs.pvalue, abs=0.04)

    def test_other_frames_are_refused(self):
        with pytest.raises(ValueError, match="same frames"):
            compare(
                results_of(truths_of(5)), results_of(truths_of(6)), np.ones((5, 3), bool), np.random.default_rng(0)
            )

    def test_an_empty_group_has_no_difference(self):
        results = results_of(truths_of())
        found = compare(results, results, ~all_joints(results.truths), np.random.default_rng(0), 20)
        assert all(np.isnan([d.estimate, d.low, d.p_value]).all() for d in found.values())
