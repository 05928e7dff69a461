"""The section of recorded frames: what the forests find in real depth."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forests.calibration import WITHIN_M
from forests.estimate import JointEstimate
from pipelines.predicting.recording import N_ASKED, Recording, Shown, known_joints
from pipelines.report.methods import METHODS, shown_methods
from pipelines.report.page import Section, Table, Tile
from pipelines.report.pictures import depth_image, recorded_window, skeleton_image
from pipelines.report.text import number
from synth.frame import Frame
from synth.vocabulary import JOINT_NAMES


def recorded_section(recordings: Sequence[Recording]) -> Section:
    """Examples of every folder, and scores where it has joints.

    Args:
        recordings: At least one.
    """
    folders = [_folder(place, recording) for place, recording in enumerate(recordings)]
    return Section("recorded", "Recorded frames", {"folders": folders})


def _folder(place: int, recording: Recording) -> dict[str, Any]:
    methods = shown_methods(recording.joints)
    return {
        "name": recording.name,
        "layout": recording.layout,
        "n_asked": recording.n_asked,
        "n_frames": recording.n_frames,
        "is_spread": recording.n_frames > N_ASKED,
        "skipped": recording.skipped,
        "scores": _scores(place, recording) if recording.scores else None,
        "examples": [(item.key, _tiles(recording, methods, item)) for item in recording.shown],
    }


def _scores(place: int, recording: Recording) -> Table:
    rows = [
        (METHODS[name].name, f"{s.n_joints:,}", number(s.within, 100.0), number(s.mean_m, 100.0))
        for name, s in recording.scores.items()
    ]
    within = f"within {100 * WITHIN_M:.0f} cm [%]"
    return Table(
        f"recorded-{place}",
        f"{recording.name}: joints that the recording knows",
        ("method", "joints", within, "mean error [cm]"),
        rows,
    )


def _tiles(recording: Recording, methods: Sequence[str], item: Shown) -> list[Tile]:
    frame, window = item.frame, recorded_window(item.frame)
    tiles = []
    truth = known_joints(frame, JOINT_NAMES)
    if np.isfinite(truth).any():
        words = "joints of the recording"
        tiles.append(Tile("depth", [depth_image(frame, window)]))
        tiles.append(Tile(words, [skeleton_image(frame, window, JOINT_NAMES, _certain(truth, frame), words)]))
    for name in methods:
        short = METHODS[name].short
        picture = skeleton_image(frame, window, recording.joints[name], item.answers[name], f"joints, {short}")
        tiles.append(Tile(short, [picture]))
    return tiles


def _certain(joints: NDArray[np.float32], frame: Frame) -> JointEstimate:
    """True joints as if a model were certain of them; none of them is told to be hidden."""
    n = len(joints)
    one, none = np.ones(n, np.float32), np.zeros(n, np.float32)
    return JointEstimate(joints[:, None], one[:, None], one, none, none, frame.camera)
