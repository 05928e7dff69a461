"""Sections that are counted from the rows: curves, joints, classes of objects, reliability."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.calibration import reliability
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
from pipelines.metrics.measures import WITHIN_M
from pipelines.metrics.resampling import Mean
from pipelines.metrics.results import Results, Truths
from pipelines.report.chart import Axis, Point, Series, line_chart, round_axis, row_chart
from pipelines.report.markup import Section, figures, left_out, legend, paragraph, table
from pipelines.report.methods import METHODS, Method, pair_name
from pipelines.report.source import Source
from pipelines.report.text import counted, number, p_value, with_interval
from synth.vocabulary import JointState

_STATES: Mapping[str, str] = {"occluded": "occluded joints", "non_occluded": "non-occluded joints"}
_PERCENT = Axis("joints [%]", 0.0, 100.0, (0.0, 20.0, 40.0, 60.0, 80.0, 100.0))
_SHARE_TICKS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
LEAST_FRAMES = 10
"""Of fewer frames, resampled frames say nothing on others: no interval is shown."""
_GAIN = Method("difference", "difference", "#d55e00", "", "diamond")
_GAIN_MEASURES: Mapping[str, str] = {
    "accuracy_10cm": "within 10 cm",
    "map_10cm": "mean average precision at 10 cm",
}
_GAINS = (("semantic", "occluders"), ("occluders", "baseline"), ("semantic", "baseline"))

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
        charts.append((caption, line_chart(caption, lines, x, _PERCENT)))
    notes = "Share of joints that are found within a distance; means over trainings. The tables count at 10 cm."
    body = figures(charts, legend(METHODS[name] for name in source.rows)) + paragraph(notes)
    return Section("curves", "Accuracy by distance", body)


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
        charts.append((title, row_chart(title, rows, _PERCENT, is_bar=True)))
    notes = (
        "In brackets, how often the joint is so in the test frames. Bars are means over trainings, in the order "
        "of the list above. Whiskers are 95 % intervals; joints that are so in fewer than "
        f"{LEAST_FRAMES} frames have none."
    )
    body = figures(charts, legend(METHODS[name] for name in source.rows)) + paragraph(notes)
    return Section("joints", "Joint by joint", body)


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
    pairs = {(a, b): source.pairs(a, b) for a, b in _GAINS}
    pairs = {key: both for key, both in pairs.items() if both}
    if not pairs:
        return left_out("classes", title, "it needs two of the regression forests")
    truths = source.truths
    groups = dict(by_hiding_class(truths))
    if not groups:
        return left_out("classes", title, "no joint of the test frames is hidden by an object")
    groups = {"any object": by_state(truths)["occluded"], **groups}
    gains = {pair_name(" - ".join(key)): _gains(source, both, groups) for key, both in pairs.items()}
    counts = {name: _counted(is_in) for name, is_in in groups.items()}
    notes = (
        "A joint belongs to the class of the object that hides it. Average precision gives each of the joints the "
        "same weight however rarely it is hidden; the share within 10 cm, which the charts show, is steadier. "
        f"No interval is told of fewer than {LEAST_FRAMES} frames. Nothing is corrected for testing many classes."
    )
    tables = (_gain_table(key, words, gains, counts) for key, words in _GAIN_MEASURES.items())
    return Section("classes", title, _gain_charts(gains, counts) + "".join(tables) + paragraph(notes))


def _counted(is_in: NDArray[np.bool_]) -> Count:
    return Count(int(is_in.any(axis=1).sum()), int(is_in.sum()))


def _gains(source: Source, pairs: list[tuple[Results, Results]], groups: Groups) -> Gains:
    return {name: compare_seeds(pairs, is_in, source.rng(), source.n_resamples) for name, is_in in groups.items()}


def _gain_table(measure: str, words: str, gains: Mapping[str, Gains], counts: Mapping[str, Count]) -> str:
    rows = (
        [
            name,
            *map(str, count),
            *(_gain_cell(gain[name][measure], count.n_frames >= LEAST_FRAMES) for gain in gains.values()),
        ]
        for name, count in counts.items()
    )
    caption = f"Occluded joints, {words}: paired differences [percentage points], 95 % intervals, p-values"
    return table(f"gain-{measure}", caption, ["hidden by", "frames", "joints", *gains], rows)


def _gain_cell(gain: Difference, is_sure: bool) -> str:
    estimate = known(gain.estimate)
    if estimate is None or not is_sure:
        return number(estimate, 100.0, sign=True)
    shown = with_interval(estimate, (known(gain.low), known(gain.high)), 100.0, sign=True)
    return f"{shown}, {p_value(known(gain.p_value))}"


def _gain_charts(gains: Mapping[str, Gains], counts: Mapping[str, Count]) -> str:
    """One chart a pair of methods, all on one axis."""
    points = {
        pair: {name: _gain_point(of["accuracy_10cm"], counts[name].n_frames) for name, of in gain.items()}
        for pair, gain in gains.items()
    }
    ends = [end for of in points.values() for point in of.values() for end in point[1:]]
    x = round_axis("difference within 10 cm [points]", ends, (-1.0, 1.0))
    charts = []
    for pair, of in points.items():
        rows = [(f"{name} ({counts[name].n_joints})", [Series(_GAIN, (point,))]) for name, point in of.items()]
        charts.append((pair, row_chart(pair, rows, x, is_bar=False)))
    return figures(charts)


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
    charts: list[tuple[str, str]] = []
    shown: dict[str, Method] = {}
    x = Axis("probability told", 0.0, 1.0, _SHARE_TICKS)
    y = Axis("share that was so", 0.0, 1.0, _SHARE_TICKS)
    for caption, ask in questions.items():
        lines = [Series(METHODS[name], _bins(source.answers[name], ask)) for name in source.rows]
        lines = [line for line in lines if line.points]
        if lines:
            charts.append((caption, line_chart(caption, lines, x, y, with_diagonal=True)))
            shown |= {line.method.name: line.method for line in lines}
    if not charts:
        return left_out("reliability", title, "no method tells calibrated probabilities")
    notes = (
        "Joints of all test frames and trainings, in ten bins by the probability that the method told; bins of "
        "fewer than 20 joints are not drawn. On the dotted line, probabilities are what they say. They were "
        "fitted on the validation frames."
    )
    return Section("reliability", title, figures(charts, legend(shown.values())) + paragraph(notes))


def _bins(
    seeds: Sequence[Results], ask: Callable[[Results], tuple[NDArray, NDArray]], least: int = 20
) -> tuple[Point, ...]:
    told, happened = (np.concatenate(parts, axis=None) for parts in zip(*map(ask, seeds), strict=True))
    has_truth = np.concatenate([~np.isnan(errors(results)) for results in seeds], axis=None)
    is_told = np.isfinite(told) & has_truth
    if not is_told.any():
        return ()
    bins = zip(*reliability(told[is_told], happened[is_told]), strict=True)
    return tuple(Point(float(p), float(share)) for p, share, n in bins if n >= least)
