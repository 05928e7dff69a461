"""Pictures of what a forest found: the skeleton over the depth, and the labels of pixels beside it."""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from forests.estimate import JointEstimate
from pipelines.drawing import palette
from pipelines.drawing.frames import FONT, Picture
from synth.vocabulary import BONES, JOINT_NAMES, OCCLUDER_CLASSES, PART_NAMES

PANEL_HEIGHT = 560
MAX_PANEL_WIDTH = 760
CAPTION_HEIGHT = 26
GAP = 6
HIDDEN_FROM = 0.5
"""A joint whose hidden_probability is above this is drawn hollow."""
UNSURE_BELOW = 0.5
"""A joint whose probability is below this is drawn small."""

_MARGIN = 0.06
_SIDES = {"r": (0, 110, 230), "l": (235, 180, 70)}
"""Orange for the person's right, blue for the left (BGR)."""
_OUTLINE = (20, 18, 16)
_PAD = cv2.BORDER_CONSTANT
_LEAST_SHARE = 0.01
"""Classes of fewer pixels, as a share of all, are not named."""


class PixelLabels(NamedTuple):
    """What a model calls the pixels.

    Attributes:
        labels: (height, width) class + 1, 0 = nothing.
        classes: Names of the classes.
    """

    labels: NDArray[np.uint8]
    classes: tuple[str, ...]


def overlay(
    depth: NDArray[np.uint16], estimate: JointEstimate, joints: tuple[str, ...], pixels: PixelLabels | None = None
) -> Picture:
    """Draws one image's answer, cut to what it shows.

    Args:
        depth: (height, width) uint16 [mm], 0 = nothing; at least one pixel is not.
        estimate: The joints.
        joints: Their names.
        pixels: Drawn beside it if given.
    """
    window, scale = _window(depth)
    left = skeleton_panel(depth, estimate, joints)
    panels, captions = [left], [marks_caption()]
    if pixels is not None:
        panels += [np.full((len(left), GAP, 3), palette.PAPER, np.uint8)]
        panels += [_resized(label_colours(*pixels)[window], scale, cv2.INTER_NEAREST)]
        captions.append(_classes_caption(pixels))
    rows = [np.hstack(panels), *captions]
    width = max(row.shape[1] for row in rows)
    return np.vstack([cv2.copyMakeBorder(r, 0, 0, 0, width - r.shape[1], _PAD, value=palette.PAPER) for r in rows])


def skeleton_panel(depth: NDArray[np.uint16], estimate: JointEstimate, joints: tuple[str, ...]) -> Picture:
    """The skeleton over the depth, cut to what it shows, without a caption; arguments as of `overlay`."""
    window, scale = _window(depth)
    places = scale * (estimate.joints_2d.astype(np.float64) + 0.5 - [window[1].start, window[0].start])
    panel = _resized(grey_depth(depth)[window], scale, cv2.INTER_LINEAR)
    draw_skeleton(panel, places, estimate, joints)
    return panel


def label_colours(labels: NDArray[np.uint8], classes: tuple[str, ...]) -> Picture:
    """(height, width, 3) colours of class + 1 by pixel, 0 = nothing; as contact sheets have them.

    Args:
        labels: (height, width).
        classes: Names of the classes.
    """
    colours = np.full((len(classes) + 1, 3), palette.FAINT, np.uint8)
    colours[0] = palette.NO_RETURN
    for number, name in enumerate(classes, start=1):
        if name in PART_NAMES:
            colours[number] = palette.PART_COLOURS[PART_NAMES.index(name)]
        elif name in OCCLUDER_CLASSES:
            colours[number] = palette.CLASS_COLOURS[OCCLUDER_CLASSES.index(name)]
    return colours[labels]


def draw_skeleton(
    picture: Picture, places: NDArray[np.float64], estimate: JointEstimate, joints: tuple[str, ...]
) -> None:
    """Draws bones and joints in place: hidden joints hollow, unsure ones small.

    Args:
        picture: (height, width, 3) BGR.
        places: (n_joints, 2) where the joints are in the picture [px]; NaN = not drawn.
        estimate: The joints.
        joints: Their names.
    """
    number = {name: k for k, name in enumerate(joints)}
    is_hidden: NDArray[np.bool_] = np.asarray(estimate.hidden_probability > HIDDEN_FROM)
    is_shown = np.logical_and.reduce(np.abs(places) < 1e4, axis=1)
    bones = [(number.get(JOINT_NAMES[a]), number.get(JOINT_NAMES[b])) for a, b in BONES]
    drawn = [(a, b) for a, b in bones if a is not None and b is not None and is_shown[a] and is_shown[b]]
    for extra, outlined in ((2, True), (0, False)):
        for a, b in drawn:
            thick = (2 if is_hidden[a] or is_hidden[b] else 4) + extra
            colour = _OUTLINE if outlined else _side(joints[b])
            cv2.line(picture, _pixel(places[a]), _pixel(places[b]), colour, thick, cv2.LINE_AA)
    for k in np.flatnonzero(is_shown):
        is_unsure = np.nan_to_num(estimate.probability[k], nan=1.0) < UNSURE_BELOW
        _draw_joint(picture, _pixel(places[k]), _side(joints[k]), 4 if is_unsure else 7, bool(is_hidden[k]))


def _draw_joint(
    picture: Picture, centre: tuple[int, int], colour: tuple[int, int, int], radius: int, is_hidden: bool
) -> None:
    cv2.circle(picture, centre, radius + 2, _OUTLINE, -1, cv2.LINE_AA)
    cv2.circle(picture, centre, radius, colour, -1, cv2.LINE_AA)
    if is_hidden:
        cv2.circle(picture, centre, radius - 2, _OUTLINE, -1, cv2.LINE_AA)


def _side(joint: str) -> tuple[int, int, int]:
    return _SIDES[joint[0]] if joint[:2] in ("r_", "l_") else palette.INK


def _window(depth: NDArray[np.uint16]) -> tuple[tuple[slice, slice], float]:
    """Rows and columns around what is there, and how much larger they are drawn."""
    spans = []
    for axis, size in ((1, depth.shape[0]), (0, depth.shape[1])):
        there = np.flatnonzero((depth > 0).any(axis=axis))
        margin = round(_MARGIN * (there[-1] - there[0] + 1)) + 2
        spans.append(slice(max(0, int(there[0]) - margin), min(size, int(there[-1]) + 1 + margin)))
    height, width = (span.stop - span.start for span in spans)
    return (spans[0], spans[1]), min(PANEL_HEIGHT / height, MAX_PANEL_WIDTH / width)


def grey_depth(depth: NDArray[np.uint16]) -> Picture:
    """(height, width, 3): near is light, far is dark."""
    there = depth > 0
    near, far = np.percentile(depth[there], [1, 99])
    share = np.clip((far - depth.astype(np.float64)) / max(1.0, far - near), 0.0, 1.0)
    grey = np.repeat((70 + 130 * share).astype(np.uint8)[..., None], 3, axis=2)
    grey[~there] = palette.NO_RETURN
    return grey


def _resized(picture: Picture, scale: float, way: int) -> Picture:
    size = (max(1, round(picture.shape[1] * scale)), max(1, round(picture.shape[0] * scale)))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA if scale < 1 else way), np.uint8)


def marks_caption() -> Picture:
    """What the marks of joints mean."""
    out = _blank_caption()
    y, x = CAPTION_HEIGHT // 2, 14
    for words, colour, radius, is_hidden in (
        ("seen", palette.INK, 7, False),
        ("hidden", palette.INK, 7, True),
        ("unsure", palette.INK, 4, False),
        ("their right", _SIDES["r"], 7, False),
        ("left", _SIDES["l"], 7, False),
    ):
        _draw_joint(out, (x, y), colour, radius, is_hidden)
        x = _write(out, words, x + 13) + 22
    return out[:, :x]


def _classes_caption(pixels: PixelLabels) -> Picture:
    """Names of the classes of objects that the picture shows."""
    out, x = _blank_caption(), 7
    count = np.bincount(pixels.labels.ravel(), minlength=len(pixels.classes) + 1)
    least = _LEAST_SHARE * count[1:].sum()
    for number, name in enumerate(pixels.classes, start=1):
        if name in PART_NAMES or count[number] <= least:
            continue
        colour = label_colours(np.array([[number]], np.uint8), pixels.classes)[0, 0].tolist()
        cv2.rectangle(out, (x, 6), (x + 13, 19), colour, -1)
        x = _write(out, name, x + 20) + 22
    x = _write(out, "parts: left light, right deep", x)
    return out[:, : x + 8]


def _blank_caption() -> Picture:
    return np.full((CAPTION_HEIGHT, 1200, 3), palette.PAPER, np.uint8)


def _write(picture: Picture, words: str, x: int) -> int:
    """Writes into a caption and returns where the words end."""
    cv2.putText(picture, words, (x, CAPTION_HEIGHT // 2 + 4), FONT, 0.42, palette.INK, 1, cv2.LINE_AA)
    return x + cv2.getTextSize(words, FONT, 0.42, 1)[0][0]


def _pixel(place: NDArray[np.float64]) -> tuple[int, int]:
    return round(float(place[0])), round(float(place[1]))
