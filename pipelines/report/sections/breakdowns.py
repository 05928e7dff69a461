"""Sections that are counted from the rows: curves, joints, classes of objects, reliability."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.calibration import WITHIN_M, reliability
from pipelines.metrics import (
    CURVE_CM,
    Groups,
    accuracy_curve,
    by_hiding_class,
    by_joint,
    by_state,
    compare_seeds,
    draw_frames,
    errors,
    every_frame_once,
    interval,
    statistics_of,
)
from pipelines.metrics.comparing import Difference
from pipelines.metrics.document import number as known
from pipelines.metrics.resampling import Mean
from pipelines.metrics.results import Results, Truths
from pipelines.report.chart import Axis, Point, Series, line_chart, round_axis, row_chart
from pipelines.report.methods import CLASS_PAIRS, DIFFERENCE, METHODS, Method, pair_name
from pipelines.report.page import Chart, Section, Table
from pipelines.report.source import Source
from pipelines.report.text import counted, number, p_value, with_interval
from synth.vocabulary import JointState

_STATES: Mapping[str, str] = {"occluded": "occluded joints", "non_occluded": "non-occluded joints"}
_PERCENT = Axis("joints [%]", 0.0, 100.0, (0.0, 20.0, 40.0, 60.0, 80.0, 100.0))
_SHARE_TICKS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
LEAST_FRAMES = 10
"""Of fewer frames, resampled frames say nothing on others: no interval is shown."""
LEAST_JOINTS = 20
"""A bin of fewer joints is not drawn."""
_GAIN_MEASURES: Mapping[str, str] = {
    "accuracy_10cm": "within 10 cm",
    "map_10cm": "mean average precision at 10 cm",
}

Gains = Mapping[str, Mapping[str, Difference]]
"""Differences of two methods by class of object and measure."""


class Count(NamedTuple):
    """How much there is of a group.

    Attributes:
        n_frames: Frames that hold a joint of it.
        n_joints: Joints of it.
    """

    n_frames: int
    n_joints: int


def curves_section(source: Source) -> Section:
    """Share of joints within each distance from 0 to 20 cm."""
    x = Axis("distance from the true joint, at most [cm]", 0.0, 20.0, (0.0, 5.0, 10.0, 15.0, 20.0))
    charts = []
    for group, words in {"": "All joints", "occluded": "Occluded joints", "non_occluded": "Others"}.items():
        n_joints = int(group_of(source.truths, group).sum())
        lines = [Series(METHODS[name], _curve(source.answers[name], group), 5) for name in source.rows]
        caption = f"{words}: {counted(n_joints, 'joint', 'joints')}"
        charts.append(Chart(caption, line_chart(caption, lines, x, _PERCENT)))
    return Section("curves", "Accuracy by distance", {"charts": charts, "methods": _methods(source)})


def _methods(source: Source) -> list[Method]:
    """For a legend."""
    return [METHODS[name] for name in source.rows]


def group_of(truths: Truths, group: str) -> NDArray[np.bool_]:
    """(n, n_joints) bool: a state's joints, or all for an empty name."""
    return by_state(truths)[group] if group else np.ones(truths.state.shape, np.bool_)


def _curve(seeds: Sequence[Results], group: str) -> tuple[Point, ...]:
    curve = np.mean([accuracy_curve(results, group_of(results.truths, group)) for results in seeds], axis=0)
    return tuple(
        Point(cm, None if np.isnan(share) else 100.0 * float(share))
        for cm, share in zip(CURVE_CM, curve, strict=True)
    )


def joints_section(source: Source) -> Section:
    """Accuracy at 10 cm by joint, occluded and not."""
    charts = []
    for state, words in _STATES.items():
        rows = []
        for joint in source.truths.joints:
            n_joints = int((by_joint(source.truths)[joint] & by_state(source.truths)[state]).sum())
            shares = {name: _share_of_joint(source, name, joint, state) for name in source.rows}
            series = [Series(METHODS[name], (point,)) for name, point in shares.items()]
            rows.append((f"{joint.replace('_', ' ')} ({n_joints})", series))
        title = f"{words[0].upper()}{words[1:]} within 10 cm"
        charts.append(Chart(title, row_chart(title, rows, _PERCENT, is_bar=True)))
    values = {"charts": charts, "methods": _methods(source), "least_frames": LEAST_FRAMES}
    return Section("joints", "Joint by joint", values)


def _share_of_joint(source: Source, name: str, joint: str, state: str) -> Point:
    seeds = source.answers[name]
    truths = seeds[0].truths
    if joint not in truths.joints:
        return Point(0.0, None)
    is_counted = by_joint(truths)[joint] & by_state(truths)[state]
    mean = Mean(tuple(statistics_of(results, is_counted)["accuracy_10cm"] for results in seeds))
    estimate = float(mean(every_frame_once(len(truths)))[0])
    if is_counted.any(axis=1).sum() < LEAST_FRAMES:
        return Point(0.0, None if np.isnan(estimate) else 100.0 * estimate)
    low, high = interval(estimate, mean(draw_frames(len(truths), source.n_resamples, source.rng())))
    return Point(0.0, *(None if np.isnan(v) else 100.0 * v for v in (estimate, low, high)))


def classes_section(source: Source) -> Section:
    """What semantics gain where an object of a class hides the joint."""
    title = "Gain by class of object"
    pairs = {(a, b): source.pairs(a, b) for a, b in CLASS_PAIRS}
    pairs = {key: both for key, both in pairs.items() if both}
    if not pairs:
        return Section("classes", title, missing="it needs two of the regression forests")
    truths = source.truths
    groups = dict(by_hiding_class(truths))
    if not groups:
        return Section("classes", title, missing="no joint of the test frames is hidden by an object")
    groups = {"any object": by_state(truths)["occluded"], **groups}
    gains = {pair_name(" - ".join(key)): _gains(source, both, groups) for key, both in pairs.items()}
    counts = {name: _counted(is_in) for name, is_in in groups.items()}
    tables = [_gain_table(key, words, gains, counts) for key, words in _GAIN_MEASURES.items()]
    values = {"charts": _gain_charts(gains, counts), "tables": tables, "least_frames": LEAST_FRAMES}
    return Section("classes", title, values)


def _counted(is_in: NDArray[np.bool_]) -> Count:
    return Count(int(is_in.any(axis=1).sum()), int(is_in.sum()))


def _gains(source: Source, pairs: list[tuple[Results, Results]], groups: Groups) -> Gains:
    return {name: compare_seeds(pairs, is_in, source.rng(), source.n_resamples) for name, is_in in groups.items()}


def _gain_table(measure: str, words: str, gains: Mapping[str, Gains], counts: Mapping[str, Count]) -> Table:
    rows = [
        [
            name,
            *map(str, count),
            *(_gain_cell(gain[name][measure], count.n_frames >= LEAST_FRAMES) for gain in gains.values()),
        ]
        for name, count in counts.items()
    ]
    caption = f"Occluded joints, {words}: paired differences [percentage points], 95 % intervals, p-values"
    return Table(f"gain-{measure}", caption, ["hidden by", "frames", "joints", *gains], rows)


def _gain_cell(gain: Difference, is_sure: bool) -> str:
    estimate = known(gain.estimate)
    if estimate is None or not is_sure:
        return number(estimate, 100.0, sign=True)
    shown = with_interval(estimate, (known(gain.low), known(gain.high)), 100.0, sign=True)
    return f"{shown}, {p_value(known(gain.p_value))}"


def _gain_charts(gains: Mapping[str, Gains], counts: Mapping[str, Count]) -> list[Chart]:
    """One chart a pair of methods, all on one axis."""
    points = {
        pair: {name: _gain_point(of["accuracy_10cm"], counts[name].n_frames) for name, of in gain.items()}
        for pair, gain in gains.items()
    }
    ends = [end for of in points.values() for point in of.values() for end in point[1:]]
    x = round_axis("difference within 10 cm [points]", ends, (-1.0, 1.0))
    charts = []
    for pair, of in points.items():
        rows = [
            (f"{name} ({counts[name].n_joints})", [Series(DIFFERENCE, (point,))]) for name, point in of.items()
        ]
        charts.append(Chart(pair, row_chart(pair, rows, x, is_bar=False)))
    return charts


def _gain_point(gain: Difference, n_frames: int) -> Point:
    values = (gain.estimate, gain.low, gain.high) if n_frames >= LEAST_FRAMES else (gain.estimate, np.nan, np.nan)
    return Point(0.0, *(None if np.isnan(value) else 100.0 * value for value in values))


def reliability_section(source: Source) -> Section:
    """Whether probabilities are what they say."""
    title = "Reliability of probabilities"
    questions: dict[str, Callable[[Results], tuple[NDArray, NDArray]]] = {
        "That a joint is found within 10 cm": lambda r: (r.probability, errors(r) <= WITHIN_M),
        "That an object hides a joint": lambda r: (r.hidden_probability, r.truths.state == JointState.OCCLUDED),
    }
    charts: list[Chart] = []
    shown: dict[str, Method] = {}
    x = Axis("probability told", 0.0, 1.0, _SHARE_TICKS)
    y = Axis("share that was so", 0.0, 1.0, _SHARE_TICKS)
    for caption, ask in questions.items():
        lines = [Series(METHODS[name], _bins(source.answers[name], ask)) for name in source.rows]
        lines = [line for line in lines if line.points]
        if lines:
            charts.append(Chart(caption, line_chart(caption, lines, x, y, with_diagonal=True)))
            shown |= {line.method.name: line.method for line in lines}
    if not charts:
        return Section("reliability", title, missing="no method tells calibrated probabilities")
    values = {"charts": charts, "methods": list(shown.values()), "least_joints": LEAST_JOINTS}
    return Section("reliability", title, values)


def _bins(
    seeds: Sequence[Results], ask: Callable[[Results], tuple[NDArray, NDArray]], least: int = LEAST_JOINTS
) -> tuple[Point, ...]:
    told, happened = (np.concatenate(parts, axis=None) for parts in zip(*map(ask, seeds), strict=True))
    has_truth = np.concatenate([~np.isnan(errors(results)) for results in seeds], axis=None)
    is_told = np.isfinite(told) & has_truth
    if not is_told.any():
        return ()
    bins = zip(*reliability(told[is_told], happened[is_told]), strict=True)
    return tuple(Point(float(p), float(share)) for p, share, n in bins if n >= least)
