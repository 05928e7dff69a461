"""The section of recorded frames: what the forests find in real depth."""

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from forests.calibration import WITHIN_M
from forests.estimate import JointEstimate
from pipelines.predicting.recording import N_ASKED, Recording, Shown, known_joints
from pipelines.report.markup import Section, items, paragraph, table
from pipelines.report.methods import METHODS
from pipelines.report.pictures import View, depth_picture, image_tag, skeleton_picture
from pipelines.report.text import escape, number
from synth.frame import Frame
from synth.vocabulary import JOINT_NAMES

_TITLE = "Recorded frames"
_NAME = "recorded"
SHOWN_METHODS = (("semantic", "occluders", "baseline"), ("rwf", "rwf_body"))
"""Of each kind of forest, the first that is there is shown."""


def recorded_section(recordings: Sequence[Recording]) -> Section:
    """Examples of every folder, and scores where it has joints.

    Args:
        recordings: At least one.
    """
    words = (
        "Real depth images, read by their folder's layout. The forests are those of the first training, as above, "
        "and learned from generated frames alone. Random walks start on the upper part of what the layout cuts "
        "out. Chosen by rule: frames evenly spread from a folder's first to its last. Orange = the person's "
        "right, blue = left; small = unsure, hollow = taken for hidden."
    )
    return Section(_NAME, _TITLE, paragraph(words) + "".join(map(_recording, itertools.count(), recordings)))


def shown_methods(names: Sequence[str]) -> tuple[str, ...]:
    """Which of some methods are drawn."""
    first = (next((name for name in kind if name in names), "") for kind in SHOWN_METHODS)
    return tuple(filter(None, first))


def _recording(number: int, recording: Recording) -> str:
    asked = f"{recording.n_asked:,} of its {recording.n_frames:,} frames"
    spread = ", evenly spread" if recording.n_frames > N_ASKED else ""
    words = f"Read as {recording.layout}; the forests were asked about {asked}{spread}."
    parts = [f"<h3>{escape(recording.name)}</h3>", paragraph(words)]
    if recording.skipped:
        parts += [paragraph("Left out, because they cannot be read:"), items(recording.skipped)]
    if recording.scores:
        parts.append(_scores(number, recording))
    methods = shown_methods(tuple(recording.joints))
    parts += [_example(recording, methods, item) for item in recording.shown]
    return "".join(parts)


def _scores(place: int, recording: Recording) -> str:
    rows = [
        (METHODS[name].name, f"{s.n_joints:,}", number(s.within, 100.0), number(s.mean_m, 100.0))
        for name, s in recording.scores.items()
    ]
    within = f"within {100 * WITHIN_M:.0f} cm [%]"
    return table(
        f"recorded-{place}",
        f"{recording.name}: joints that the recording knows",
        ("method", "joints", within, "mean error [cm]"),
        rows,
    )


def _example(recording: Recording, methods: Sequence[str], item: Shown) -> str:
    view = View.of_foreground(item.frame)
    tiles = []
    truth = known_joints(item.frame, JOINT_NAMES)
    if np.isfinite(truth).any():
        tiles.append(_tile("depth", image_tag(depth_picture(view), "depth", is_flat=False)))
        picture = skeleton_picture(view, JOINT_NAMES, _certain(truth, item.frame))
        words = "joints of the recording"
        tiles.append(_tile(words, image_tag(picture, words, is_flat=False)))
    for name in methods:
        short = METHODS[name].short
        picture = skeleton_picture(view, recording.joints[name], item.answers[name])
        tiles.append(_tile(short, image_tag(picture, f"joints, {short}", is_flat=False)))
    inside = f'<p class="caption">{escape(item.key)}</p><div class="tiles">{"".join(tiles)}</div>'
    return f'<div class="example few">{inside}</div>\n'


def _certain(joints: NDArray[np.float32], frame: Frame) -> JointEstimate:
    """True joints as if a model were certain of them; none of them is told to be hidden."""
    n = len(joints)
    one, none = np.ones(n, np.float32), np.zeros(n, np.float32)
    return JointEstimate(joints[:, None], one[:, None], one, none, none, frame.camera)


def _tile(caption: str, image: str) -> str:
    return f"<figure>{image}<figcaption>{escape(caption)}</figcaption></figure>"
