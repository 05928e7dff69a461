"""Scores an orientation net on a split of a corpus: angular errors with 95 % intervals, by what hides the person."""

import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from nets.orientation.angles import angular_error
from nets.orientation.config import POSTURES
from nets.orientation.frames import Patches, collect_patches
from nets.orientation.model import PROBABLE_RAD, OrientationModel
from pipelines.corpus import Corpus
from pipelines.corpus.joined import sensors_of
from pipelines.errors import UserError
from pipelines.metrics import N_RESAMPLES, draw_frames
from pipelines.metrics.document import number
from pipelines.metrics.resampling import (
    FrameWeights,
    Median,
    Ratio,
    Statistic,
    every_frame_once,
    interval,
)
from pipelines.orientation.frames import CorpusOrientations
from pipelines.orientation.training import versions
from pipelines.progress import Progress
from pipelines.spread import at_most
from synth.vocabulary import JointState

if TYPE_CHECKING:
    from nets.orientation.estimate import OrientationEstimate
    from nets.orientation.predict import OrientationPredictor

SCHEMA = "undergrowth orientation evaluation"
SCHEMA_VERSION = 1
HIDDEN = {"clear": (0.0, 0.05), "partly": (0.05, 0.2), "a fifth or more": (0.2, 1.01)}
"""Groups of frames by the share of the joints that objects hide."""
FLIPPED_RAD = np.pi / 2.0
N_RELIABILITY = 5


@dataclass(frozen=True)
class OrientationScoring:
    """What a score depends on besides net and corpus.

    Attributes:
        split: Which frames: train, val or test.
        sensor: Sensor model for the depth; None = clean depth.
        limit: Most frames that are scored, evenly spread; 0 = all.
        resamples: Resamples of the frames for the confidence intervals.
        seed: Of the resamples.
    """

    split: str = "test"
    sensor: str | None = None
    limit: int = 0
    resamples: int = N_RESAMPLES
    seed: int = 0


@dataclass(frozen=True)
class _Rows:
    """What is scored, n frames: errors [rad], probabilities, and the truth."""

    error: NDArray[np.float64]
    probability: NDArray[np.float64]
    posture: NDArray[np.int64]
    true_posture: NDArray[np.int64]
    tilt_roll_error: NDArray[np.float64]
    hidden_share: NDArray[np.float64]


def score_orientation(
    predictor: "OrientationPredictor", about: dict[str, Any], corpus: Corpus, scoring: OrientationScoring
) -> dict[str, Any]:
    """Scores a net.

    Args:
        predictor: The net.
        about: What is told of its file, as JSON values.
        corpus: An open corpus.
        scoring: Which frames, and how.

    Returns:
        All scores as JSON values, see docs/orientation.md.

    Raises:
        UserError: No such split or sensor, or no frames are left to be scored.
    """
    from nets.runtime import repeatable

    sensor = sensors_of([corpus], scoring.sensor)[0]
    numbers = corpus.split(scoring.split)
    numbers = numbers[at_most(len(numbers), scoring.limit)]
    config = predictor.model.config
    frames = CorpusOrientations(corpus, numbers, config.region, sensor)
    with Progress(len(frames), "frame", "evaluate") as bar, repeatable():
        kept, patches = _kept_patches(frames, config.view, bar)
        if not len(kept):
            raise UserError(
                f"{corpus.path} has no frames of the split {scoring.split} that show a {config.region} whose "
                "angle is known"
            )
        predictor.estimates(patches.relative[:1])
        begun = time.thread_time()
        estimates = predictor.estimates(patches.relative)
        seconds = (time.thread_time() - begun) / len(kept)
    state = corpus.arrays("joint_state", numbers[kept])
    rows = _rows(estimates, patches, (state == JointState.OCCLUDED).mean(axis=1))
    weights = draw_frames(len(kept), scoring.resamples, np.random.default_rng(scoring.seed))
    return {
        "schema": SCHEMA,
        "schema_version": SCHEMA_VERSION,
        "model": about,
        "corpus": {"name": corpus.path.resolve().name, "digest": corpus.digest},
        "configuration": asdict(scoring),
        "software": versions(),
        "region": config.region,
        "n_left_out": len(numbers) - len(kept),
        "seconds_per_person": seconds,
    } | _document(rows, weights)


def _kept_patches(frames: CorpusOrientations, view: Any, bar: Progress) -> tuple[NDArray[np.int64], Patches]:
    """Places of the frames that tell what is asked, and their patches."""
    kept = []

    class Noted:
        def __len__(self) -> int:
            return len(frames)

        def __getitem__(self, place: int, /) -> Any:
            frame = frames[place]
            if frame is not None:
                kept.append(place)
            return frame

    patches = collect_patches(Noted(), frames.region, view, bar.update)
    return np.array(kept, np.int64), patches


def _rows(estimates: list["OrientationEstimate"], patches: Patches, hidden_share: NDArray[np.float64]) -> _Rows:
    told = np.array([[item.tilt, item.roll] for item in estimates])
    true = np.stack([patches.tilt, patches.roll], axis=1)
    postures = [
        int(item.posture_probability.argmax()) if len(item.posture_probability) else -1 for item in estimates
    ]
    return _Rows(
        angular_error([item.angle for item in estimates], patches.angle),
        np.array([item.probability for item in estimates]),
        np.array(postures, np.int64),
        patches.posture,
        np.abs(told - true),
        hidden_share,
    )


def _document(rows: _Rows, weights: FrameWeights) -> dict[str, Any]:
    everything = np.ones(len(rows.error), np.bool_)
    document: dict[str, Any] = _group(rows, everything, weights)
    document["by_hidden_joints"] = {
        name: _group(rows, (rows.hidden_share >= low) & (rows.hidden_share < high), weights)
        for name, (low, high) in HIDDEN.items()
    }
    document["by_posture"] = {
        name: _group(rows, rows.true_posture == code, weights) for code, name in enumerate(POSTURES)
    }
    confusion = np.zeros((len(POSTURES), len(POSTURES)), np.int64)
    is_known = (rows.true_posture >= 0) & (rows.posture >= 0)
    np.add.at(confusion, (rows.true_posture[is_known], rows.posture[is_known]), 1)
    document["posture_confusion"] = confusion.tolist()
    document["reliability"] = _reliability(rows)
    return document


def _group(rows: _Rows, is_in: NDArray[np.bool_], weights: FrameWeights) -> dict[str, Any]:
    """The measures of some of the frames as JSON values."""
    error = np.degrees(rows.error)
    shares = {
        "within_22deg": rows.error <= PROBABLE_RAD,
        "told_within_22deg": rows.probability,
        "flipped": rows.error > FLIPPED_RAD,
    }
    measures: dict[str, Statistic] = {
        "mean_error_deg": _mean(error, is_in),
        "median_error_deg": Median.of(error[is_in], np.flatnonzero(is_in)),
        **{name: _mean(values.astype(np.float64), is_in) for name, values in shares.items()},
        "posture_accuracy": _mean(
            (rows.posture == rows.true_posture).astype(np.float64),
            is_in & (rows.true_posture >= 0) & (rows.posture >= 0),
        ),
    }
    for k, name in enumerate(("tilt", "roll")):
        second = np.degrees(rows.tilt_roll_error[:, k])
        measures[f"{name}_error_deg"] = _mean(np.nan_to_num(second), is_in & np.isfinite(second))
    values: dict[str, Any] = {"n_frames": int(is_in.sum())}
    for name, statistic in measures.items():
        estimate = float(statistic(every_frame_once(len(is_in)))[0])
        ends = [number(end) for end in interval(estimate, statistic(weights))]
        values |= {name: number(estimate), f"{name}_ci": None if number(estimate) is None else ends}
    return values


def _mean(values: NDArray[np.float64], is_in: NDArray[np.bool_]) -> Ratio:
    counted = is_in.astype(np.float64)
    return Ratio(values * counted, counted)


def _reliability(rows: _Rows) -> list[dict[str, Any]]:
    """Told probability and share that is right, in groups of frames by the former."""
    order = np.argsort(rows.probability, kind="stable")
    groups = [group for group in np.array_split(order, N_RELIABILITY) if len(group)]
    return [
        {
            "n_frames": len(group),
            "told": float(rows.probability[group].mean()),
            "right": float((rows.error[group] <= PROBABLE_RAD).mean()),
        }
        for group in groups
    ]


def validation_scores(model: OrientationModel, patches: Patches) -> dict[str, float]:
    """Mean angular error [degrees], and the share of postures that are right, of a model on patches."""
    from nets.orientation.predict import OrientationPredictor
    from nets.runtime import repeatable

    if not len(patches.angle):
        return {}
    with repeatable():
        estimates = OrientationPredictor(model).estimates(patches.relative)
    rows = _rows(estimates, patches, np.zeros(len(patches.angle)))
    scores = {"mean_error_deg": round(float(np.degrees(rows.error).mean()), 4)}
    is_known = (rows.true_posture >= 0) & (rows.posture >= 0)
    if is_known.any():
        right = rows.posture[is_known] == rows.true_posture[is_known]
        scores["posture_accuracy"] = round(float(right.mean()), 6)
    return scores


_COLUMNS = {
    "mean_error_deg": "mean error [deg]",
    "median_error_deg": "median error [deg]",
    "within_22deg": "within 22.5 deg",
    "told_within_22deg": "told so",
    "posture_accuracy": "posture right",
    "tilt_error_deg": "tilt error [deg]",
    "roll_error_deg": "roll error [deg]",
}


def table_lines(document: Mapping[str, Any]) -> Iterator[str]:
    """The terminal's table of a document."""
    columns = {key: title for key, title in _COLUMNS.items() if document[key] is not None}
    yield f"{'':<26}{'frames':>8}" + "".join(f"{title:>24}" for title in columns.values())
    groups = {"all": document}
    groups |= {f"joints hidden: {name}": values for name, values in document["by_hidden_joints"].items()}
    groups |= dict(document["by_posture"])
    for name, values in groups.items():
        if values["n_frames"]:
            cells = "".join(f"{_cell(values, key):>24}" for key in columns)
            yield f"{name:<26}{values['n_frames']:>8}{cells}"
    yield ""
    yield f"{document['n_left_out']} frames left out; {document['seconds_per_person'] * 1e3:.2f} ms a person"


def _cell(values: Mapping[str, Any], key: str) -> str:
    if values[key] is None:
        return "-"
    form = ".1f" if key.endswith("_deg") and "within" not in key else ".3f"
    low, high = values[f"{key}_ci"]
    ends = "-" if low is None or high is None else f"{low:{form}}, {high:{form}}"
    return f"{values[key]:{form}} [{ends}]"
