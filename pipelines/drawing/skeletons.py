"""Skeletons, estimated or true: the one way in which this program draws bones and joints."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from forests.estimate import JointEstimate
from pipelines.drawing import palette
from pipelines.drawing.palette import Colour, Mark, Picture
from synth.vocabulary import BONES, JOINT_NAMES, JointState

HIDDEN_FROM = 0.5
"""A joint whose hidden_probability is above this is drawn hollow."""
OUTSIDE_FROM = 0.5
"""A joint whose outside_probability is above this is not drawn."""
PERSON_FROM = 0.5
"""A skeleton whose person_probability is below this is not drawn."""
UNSURE_BELOW = 0.5
"""A joint whose probability is below this is drawn small."""
SURE_RADIUS, UNSURE_RADIUS = 7, 4
"""Of estimated joints [px]."""
MARK_RADIUS = 5
"""Of marks [px]."""
_LIMIT = 1e4
"""Nothing is drawn farther outside [px]."""


def draw_estimate(
    picture: Picture, places: NDArray[np.float64], joints: Sequence[str], estimate: JointEstimate
) -> None:
    """Draws an estimated skeleton in place: sides in colour, hidden joints hollow, unsure ones small.

    Joints that are probably not in the image are left out, and everything where there is probably nobody.

    Args:
        picture: (height, width, 3) BGR.
        places: (n_joints, 2) where the joints are in the picture [px]; NaN = not drawn.
        joints: Their names.
        estimate: What was estimated of them.
    """
    if estimate.person_probability < PERSON_FROM:
        return
    is_hidden: NDArray[np.bool_] = np.asarray(estimate.hidden_probability > HIDDEN_FROM)
    places = np.where((estimate.outside_probability > OUTSIDE_FROM)[:, None], np.nan, places)
    bones = _bones(places, joints)
    for extra, is_outline in ((2, True), (0, False)):
        for a, b in bones:
            thick = (2 if is_hidden[a] or is_hidden[b] else 4) + extra
            colour = palette.OUTLINE if is_outline else palette.side_colour(joints[b])
            cv2.line(picture, _pixel(places[a]), _pixel(places[b]), colour, thick, cv2.LINE_AA)
    for k in np.flatnonzero(_is_shown(places)).tolist():
        is_unsure = np.nan_to_num(estimate.probability[k], nan=1.0) < UNSURE_BELOW
        radius = UNSURE_RADIUS if is_unsure else SURE_RADIUS
        draw_joint(picture, places[k], palette.side_colour(joints[k]), radius, bool(is_hidden[k]))


def draw_truth(
    picture: Picture, places: NDArray[np.float64], joints: Sequence[str], state: NDArray[np.uint8]
) -> None:
    """Draws a true skeleton in place: a mark for each joint's state.

    Args:
        picture: (height, width, 3) BGR.
        places: (n_joints, 2) where the joints are in the picture [px]; NaN = not drawn.
        joints: Their names.
        state: (n_joints,) `JointState`.
    """
    _draw_bones(picture, places, joints, palette.INK, 2)
    for k in np.flatnonzero(_is_shown(places)).tolist():
        draw_mark(picture, places[k], palette.STATE_MARKS[JointState(int(state[k]))])


def draw_errors(
    picture: Picture,
    places: NDArray[np.float64],
    truth: NDArray[np.float64],
    joints: Sequence[str],
    is_right: NDArray[np.bool_],
) -> None:
    """Draws an estimated skeleton over the true one in place: joints marked right, or wrong and tied to the truth.

    Args:
        picture: (height, width, 3) BGR.
        places: (n_joints, 2) where the estimated joints are in the picture [px]; NaN = not drawn.
        truth: (n_joints, 2) where the true joints are in the picture [px]; NaN = not drawn.
        joints: Their names.
        is_right: (n_joints,) whether an estimate is near enough.
    """
    _draw_bones(picture, truth, joints, palette.FAINT, 1)
    _draw_bones(picture, places, joints, palette.INK, 2)
    has_truth = _is_shown(truth)
    for k in np.flatnonzero(_is_shown(places)).tolist():
        mark = palette.RIGHT if is_right[k] else palette.WRONG
        if has_truth[k] and not is_right[k]:
            cv2.line(picture, _pixel(truth[k]), _pixel(places[k]), mark.colour, 1, cv2.LINE_AA)
        draw_mark(picture, places[k], mark)


def draw_joint(picture: Picture, place: NDArray[np.float64], colour: Colour, radius: int, is_hidden: bool) -> None:
    """Draws an estimated joint in place.

    Args:
        picture: (height, width, 3) BGR.
        place: (2,) its centre [px].
        colour: Of its side.
        radius: Of the disc [px].
        is_hidden: Draw it hollow.
    """
    centre = _pixel(place)
    cv2.circle(picture, centre, radius + 2, palette.OUTLINE, -1, cv2.LINE_AA)
    cv2.circle(picture, centre, radius, colour, -1, cv2.LINE_AA)
    if is_hidden:
        cv2.circle(picture, centre, radius - 2, palette.OUTLINE, -1, cv2.LINE_AA)


def draw_mark(picture: Picture, place: NDArray[np.float64], mark: Mark, radius: int = MARK_RADIUS) -> None:
    """Draws a mark in place.

    Args:
        picture: (height, width, 3) BGR.
        place: (2,) its centre [px].
        mark: Its shape and colour.
        radius: Half its size [px].
    """
    x, y = centre = _pixel(place)
    colour, thick = mark.colour, 3 if mark.shape == "cross" else 2
    if mark.shape == "dot":
        cv2.circle(picture, centre, radius, colour, -1, cv2.LINE_AA)
    elif mark.shape == "ring":
        cv2.circle(picture, centre, radius, colour, thick, cv2.LINE_AA)
    elif mark.shape == "cross":
        cv2.line(picture, (x - radius, y - radius), (x + radius, y + radius), colour, thick, cv2.LINE_AA)
        cv2.line(picture, (x - radius, y + radius), (x + radius, y - radius), colour, thick, cv2.LINE_AA)
    else:
        cv2.rectangle(picture, (x - radius, y - radius), (x + radius, y + radius), colour, thick)


def _draw_bones(
    picture: Picture, places: NDArray[np.float64], joints: Sequence[str], colour: Colour, thick: int
) -> None:
    for a, b in _bones(places, joints):
        cv2.line(picture, _pixel(places[a]), _pixel(places[b]), colour, thick, cv2.LINE_AA)


def _bones(places: NDArray[np.float64], joints: Sequence[str]) -> list[tuple[int, int]]:
    """Pairs of joints that a bone joins and that are drawn both."""
    number = {name: k for k, name in enumerate(joints)}
    is_shown = _is_shown(places)
    pairs = [(number.get(JOINT_NAMES[a]), number.get(JOINT_NAMES[b])) for a, b in BONES]
    return [(a, b) for a, b in pairs if a is not None and b is not None and is_shown[a] and is_shown[b]]


def _is_shown(places: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n_joints,) bool: NaN compares as false."""
    return np.asarray((np.abs(places) < _LIMIT).all(axis=1))


def _pixel(place: NDArray[np.float64]) -> tuple[int, int]:
    return round(float(place[0])), round(float(place[1]))
