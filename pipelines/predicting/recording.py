"""Several models asked about a folder of recordings: scores where it has joints, and examples to show."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.calibration import WITHIN_M
from forests.estimate import JointEstimate
from pipelines.errors import UserError
from pipelines.models.asking import Contestant, ask
from pipelines.progress import progress
from pipelines.recordings.entries import SMALLEST_BLOB
from pipelines.recordings.frames import Options, RecordedFrames
from pipelines.recordings.layout import Layout
from pipelines.spread import first_to_last
from synth.frame import Frame
from synth.vocabulary import JOINT_NAMES

N_ASKED = 100
"""Frames of a folder that models are asked about, evenly spread; all if there are fewer."""
N_SHOWN = 6
"""Of these, the examples, evenly spread too."""


class Folder(NamedTuple):
    """A folder of recordings, and how it reads.

    Attributes:
        path: The folder.
        name: Of the layout.
        layout: How it reads.
    """

    path: Path
    name: str
    layout: Layout


class Score(NamedTuple):
    """How well a model found the joints that are known.

    Attributes:
        n_joints: Of all frames that it was asked about, those whose place is known.
        within: Share of them that it found within 10 cm.
        mean_m: Mean error of those that it answered [m].
    """

    n_joints: int
    within: float
    mean_m: float


@dataclass(frozen=True)
class Shown:
    """An example.

    Attributes:
        key: Name of the image, and of the person in it.
        frame: The frame.
        answers: What each model answered.
    """

    key: str
    frame: Frame
    answers: Mapping[str, JointEstimate]


@dataclass(frozen=True)
class Recording:
    """What came of a folder.

    Attributes:
        name: Of the folder.
        layout: Name of its layout.
        n_frames: In the folder.
        n_asked: That the models were asked about.
        skipped: Why others of those chosen were not.
        joints: Names of each model's joints.
        scores: Of each model; empty where no joint is known.
        shown: The examples.
    """

    name: str
    layout: str
    n_frames: int
    n_asked: int
    skipped: tuple[str, ...]
    joints: Mapping[str, tuple[str, ...]]
    scores: Mapping[str, Score]
    shown: tuple[Shown, ...]


def ask_recording(folder: Folder, models: Mapping[str, Contestant]) -> Recording:
    """Asks every model about frames of a folder; those that cannot be read are left out and told.

    Raises:
        UserError: The folder has no frames, or lacks joints that its layout tells.
    """
    options = Options(folder.name, SMALLEST_BLOB, True, 1, (0.0, 0.0, 1.0))
    frames = RecordedFrames(folder.path, folder.layout, options)
    places = first_to_last(len(frames), N_ASKED)
    is_shown = np.zeros(len(places), bool)
    is_shown[first_to_last(len(places), N_SHOWN)] = True
    errors: dict[str, list[NDArray[np.float64]]] = {name: [] for name in models}
    shown, skipped = [], []
    bar = progress(places.tolist(), "frame", folder.path.name)
    for k, place in enumerate(bar):
        try:
            frame = frames.frame(place)
        except (UserError, OSError) as error:
            skipped.append(str(error))
            continue
        answers = {name: ask(model, frame.depth, frame.camera) for name, model in models.items()}
        for name, model in models.items():
            errors[name].append(_errors(frame, model.joints, answers[name]))
        if is_shown[k]:
            shown.append(Shown(frames.entries[place].key, frame, answers))
    scores = {name: _score(np.concatenate(values)) for name, values in errors.items() if values}
    return Recording(
        folder.path.resolve().name,
        folder.name,
        len(frames),
        len(places) - len(skipped),
        tuple(skipped),
        {name: model.joints for name, model in models.items()},
        {name: score for name, score in scores.items() if score.n_joints},
        tuple(shown),
    )


def known_joints(frame: Frame, names: tuple[str, ...]) -> NDArray[np.float32]:
    """(n, 3) true joints of these names, camera frame [m]; NaN where unknown."""
    at = [JOINT_NAMES.index(name) for name in names]
    return frame.joints[at]


def _errors(frame: Frame, names: tuple[str, ...], answer: JointEstimate) -> NDArray[np.float64]:
    """(n_known,) distances to the known joints [m]; inf without an answer."""
    truth = known_joints(frame, names)
    is_known = np.isfinite(truth).all(axis=1)
    distance = np.linalg.norm(answer.joints[is_known].astype(np.float64) - truth[is_known], axis=1)
    return np.where(np.isfinite(distance), distance, np.inf)


def _score(errors: NDArray[np.float64]) -> Score:
    answered = errors[np.isfinite(errors)]
    within = float((errors <= WITHIN_M).mean()) if len(errors) else np.nan
    return Score(len(errors), within, float(answered.mean()) if len(answered) else np.nan)
