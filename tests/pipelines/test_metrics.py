"""Metrics against cases with known answers, scikit-learn, scipy, slow twins, and laws."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.stats
from sklearn.metrics import average_precision_score, balanced_accuracy_score, confusion_matrix

from pipelines.metrics import (
    MEASURES,
    Confusion,
    MeanAveragePrecision,
    accuracy_curve,
    by_family,
    by_hiding_class,
    by_joint,
    by_object_in_frame,
    by_state,
    by_visible_fraction,
    compare,
    count_pixels,
    draw_frames,
    errors_2d,
    every_frame_once,
    interval,
    rank_proposals,
    statistics_of,
    summarise,
)
from pipelines.metrics.document import score_document, table_lines
from pipelines.metrics.truths import upper_body_px
from pipelines.results import Results, Truths, read_results, write_results
from tests import reference_metrics as reference

JOINTS = ("head", "neck", "torso")


def truths_of(n=60, seed=0, joints=JOINTS):
    rng = np.random.default_rng(seed)
    state = rng.choice(4, (n, len(joints)), p=(0.6, 0.25, 0.1, 0.05)).astype(np.uint8)
    return Truths(
        joints=joints,
        occluders=("none", "table", "laptop"),
        families=("desk", "free"),
        frame=np.arange(n) * 3,
        intrinsics=np.tile([365.0, 365.0, 255.5, 211.5], (n, 1)),
        upper_body_px=rng.uniform(50, 100, n).astype(np.float32),
        visible_fraction=rng.choice([0.2, 0.6, 1.0], n).astype(np.float32),
        family=rng.integers(0, 2, n).astype(np.uint8),
        object_classes=rng.choice([0, 2, 4, 6], n).astype(np.uint16),
        xyz=(rng.normal(size=(n, len(joints), 3)) * 0.3 + [0, 0, 2.5]).astype(np.float32),
        state=state,
        hiding_class=np.where(state == 1, rng.integers(1, 3, state.shape), 0).astype(np.uint8),
    )


def results_of(truths, error=0.05, seed=1, k=3, missing=0.05, ties=False, method="forest"):
    rng = np.random.default_rng(seed)
    shape = truths.state.shape
    proposals = truths.xyz[:, :, None] + rng.normal(size=(*shape, k, 3)).astype(np.float32) * error
    confidence = -np.sort(-rng.random((*shape, k)), axis=2)
    confidence = (np.ceil(confidence * 5) / 5 if ties else confidence).astype(np.float32)
    n_made = np.where(rng.random(shape) < missing, 0, rng.integers(1, k + 1, shape))
    is_missing = np.arange(k) >= n_made[..., None]
    proposals[is_missing], confidence[is_missing] = np.nan, 0
    unknown = np.full(shape, np.nan, np.float32)
    seconds = np.full(len(truths), 0.001, np.float32)
    return Results(method, truths, proposals.astype(np.float32), confidence, unknown, unknown, seconds)


def perfect(truths):
    return replace(results_of(truths, k=1, missing=0), proposals=truths.xyz[:, :, None].copy())


def all_joints(truths):
    return np.ones(truths.state.shape, bool)


def measured(results, is_counted=None):
    is_counted = all_joints(results.truths) if is_counted is None else is_counted
    once = every_frame_once(len(results.truths))
    return {name: float(f(once)[0]) for name, f in statistics_of(results, is_counted).items()}


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


class TestPixels:
    names = ("head", "arm", "table", "laptop")

    def confusion(self, label, given, classes):
        counts = count_pixels(np.array(label, np.uint8), np.array(given, np.uint8), 4, len(classes))
        return Confusion(counts, self.names, classes, 2)

    def test_by_hand(self):
        label = [[1, 1, 2, 3, 3, 4, 0, 2]]
        given = [[1, 2, 2, 3, 1, 3, 1, 0]]
        found = self.confusion(label, given, self.names)
        assert found.counts.sum() == 6
        assert found.part_accuracy == 0.75
        assert found.occluder_accuracy == 0.25
        assert found.class_accuracy == 0.5
        assert found.object_recall == pytest.approx(2 / 3)
        assert found.body_recall == 1.0

    def test_one_class_of_occluders_is_right_for_all(self):
        found = self.confusion([[1, 2, 3, 4]], [[1, 2, 3, 3]], ("head", "arm", "occluder"))
        assert found.occluder_accuracy == found.object_recall == found.class_accuracy == 1.0

    def test_without_occluder_classes_objects_are_wrong(self):
        found = self.confusion([[1, 2, 3, 4]], [[1, 2, 1, 2]], ("head", "arm"))
        assert np.isnan(found.occluder_accuracy)
        assert (found.object_recall, found.part_accuracy, found.class_accuracy) == (0.0, 1.0, 0.5)

    def test_equals_scikit_learn(self):
        rng = np.random.default_rng(0)
        label, given = rng.integers(1, 5, (2, 30, 40))
        found = self.confusion(label, given, self.names)
        np.testing.assert_array_equal(found.counts, confusion_matrix(label.ravel(), given.ravel()))
        assert found.class_accuracy == pytest.approx(balanced_accuracy_score(label.ravel(), given.ravel()))

    def test_nothing_to_label_has_no_accuracy(self):
        found = self.confusion([[0, 0]], [[0, 0]], self.names)
        assert np.isnan([found.part_accuracy, found.class_accuracy, found.object_recall]).all()

    def test_a_class_that_is_not_there_is_refused(self):
        with pytest.raises(ValueError, match="class 4"):
            self.confusion([[1]], [[5]], self.names)


class TestRows:
    def test_come_back_as_they_were(self, tmp_path):
        truths = truths_of()
        written = [results_of(truths, method="a"), results_of(truths, seed=2, k=1, method="b")]
        write_results(tmp_path / "r.npz", written, {"split": "test"})
        read, context = read_results(tmp_path / "r.npz")
        assert context == {"split": "test"}
        assert [item.method for item in read] == ["a", "b"]
        for there, here in zip(written, read, strict=True):
            assert measured(there) == measured(here)
            k = there.proposals.shape[2]
            np.testing.assert_array_equal(here.proposals[:, :, :k], there.proposals)
            assert np.isnan(here.proposals[:, :, k:]).all()
            for name, values in vars(there.truths).items():
                np.testing.assert_array_equal(getattr(here.truths, name), values)

    def test_are_one_a_frame_joint_and_method(self, tmp_path):
        truths = truths_of(7)
        write_results(tmp_path / "r.npz", [results_of(truths, method=m) for m in "ab"], {})
        with np.load(tmp_path / "r.npz") as file:
            keys = np.stack([file["method"], file["frame"], file["joint"]], axis=1)
            assert all(len(file[name]) == 2 * 7 * 3 for name in file if name != "header")
        assert len(np.unique(keys, axis=0)) == len(keys)

    def test_are_the_same_bytes_again(self, tmp_path):
        for name in "ab":
            write_results(tmp_path / name, [results_of(truths_of())], {"seed": 1})
        assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
        assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b"]

    def test_two_methods_of_one_name_are_refused(self, tmp_path):
        results = results_of(truths_of())
        with pytest.raises(ValueError, match="different names"):
            write_results(tmp_path / "r.npz", [results, results], {})

    def test_a_wrong_shape_is_told(self):
        results = results_of(truths_of())
        with pytest.raises(ValueError, match="probability has shape"):
            replace(results, probability=results.probability[:, :2])


def test_the_document_of_a_corpus_without_hidden_joints_has_nulls():
    truths = truths_of()
    truths.state[:], truths.hiding_class[:] = 0, 0
    document = score_document(results_of(truths), draw_frames(60, 20, np.random.default_rng(0)))
    assert document["occluded"]["map_10cm"] is document["occluded"]["map_10cm_ci"] is None
    assert document["by_hiding_class"] == {}
    assert document["non_occluded"] == document["visible"]
    assert all("nan" not in line for line in table_lines(document))
