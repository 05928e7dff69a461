"""Words in pictures, and the captions that say what marks and colours mean."""

import cv2
import numpy as np

from pipelines.drawing import palette
from pipelines.drawing.labels import PixelLabels, label_colours
from pipelines.drawing.palette import Colour, Picture
from pipelines.drawing.skeletons import SURE_RADIUS, UNSURE_RADIUS, draw_joint
from synth.vocabulary import PART_NAMES

CAPTION_HEIGHT = 26
GAP = 6
"""Between pictures side by side [px]."""
_FONT, _SIZE = cv2.FONT_HERSHEY_SIMPLEX, 0.42
_LONGEST = 1200
_LEAST_SHARE = 0.01
"""Classes of fewer pixels, as a share of all, are not named."""


def write_words(picture: Picture, words: str, place: tuple[int, int], colour: Colour = palette.INK) -> int:
    """Writes a line in place.

    Args:
        picture: (height, width, 3) BGR.
        words: The line.
        place: Its lower left corner [px].
        colour: Of the letters.

    Returns:
        The column in which the line ends.
    """
    cv2.putText(picture, words, place, _FONT, _SIZE, colour, 1, cv2.LINE_AA)
    return place[0] + cv2.getTextSize(words, _FONT, _SIZE, 1)[0][0]


def bordered(picture: Picture, above: int = 0, left: int = 0, below: int = 0, right: int = 0) -> Picture:
    """A picture with a border of the paper's colour.

    Args:
        picture: (height, width, 3) BGR.
        above: Rows.
        left: Columns.
        below: Rows.
        right: Columns.
    """
    widths = (above, below, left, right)
    return np.asarray(cv2.copyMakeBorder(picture, *widths, cv2.BORDER_CONSTANT, value=palette.PAPER), np.uint8)


def marks_caption() -> Picture:
    """What the joints of an estimated skeleton mean."""
    out = _blank_caption()
    y, x = CAPTION_HEIGHT // 2, 14
    for words, colour, radius, is_hidden in (
        ("seen", palette.INK, SURE_RADIUS, False),
        ("hidden", palette.INK, SURE_RADIUS, True),
        ("unsure", palette.INK, UNSURE_RADIUS, False),
        ("their right", palette.SIDES["r_"], SURE_RADIUS, False),
        ("left", palette.SIDES["l_"], SURE_RADIUS, False),
    ):
        draw_joint(out, np.array([x, y], np.float64), colour, radius, is_hidden)
        x = write_words(out, words, (x + 13, y + 4)) + 22
    return out[:, :x]


def classes_caption(pixels: PixelLabels) -> Picture:
    """Names of the classes of objects that a picture of labels shows."""
    out, x, y = _blank_caption(), 7, CAPTION_HEIGHT // 2 + 4
    count = np.bincount(pixels.labels.ravel(), minlength=len(pixels.classes) + 1)
    least = _LEAST_SHARE * count[1:].sum()
    for number, name in enumerate(pixels.classes, start=1):
        if name in PART_NAMES or count[number] <= least:
            continue
        colour = label_colours(np.array([[number]], np.uint8), pixels.classes)[0, 0].tolist()
        cv2.rectangle(out, (x, 6), (x + 13, 19), colour, -1)
        x = write_words(out, name, (x + 20, y)) + 22
    x = write_words(out, "objects striped; parts: left light, right deep", (x, y))
    return out[:, : x + 8]


def _blank_caption() -> Picture:
    return np.full((CAPTION_HEIGHT, _LONGEST, 3), palette.PAPER, np.uint8)
