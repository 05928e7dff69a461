"""People who were found in a whole scene, each with a number, a box and what is known of them, over the depth."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from forests.estimate import JointEstimate
from forests.finder.find import FoundPerson
from pipelines.drawing import palette
from pipelines.drawing.captions import bordered, marks_caption, write_words
from pipelines.drawing.palette import Picture
from pipelines.drawing.skeletons import draw_estimate
from pipelines.drawing.windows import Window

SIZE = (1024, 848)
"""Of a picture at most [px]."""


def scene_window(depth: NDArray[np.uint16]) -> Window:
    """The whole image, as large as pictures of scenes are."""
    height, width = depth.shape
    return Window.fitted(slice(0, height), slice(0, width), *SIZE)


def boxes_picture(depth: NDArray[np.uint16], people: Sequence[FoundPerson]) -> Picture:
    """The depth in grey with the box, number and distance of everybody.

    Args:
        depth: (height, width) uint16 [mm], 0 = nothing.
        people: By number.
    """
    window = scene_window(depth)
    picture = np.ascontiguousarray(window.cut(palette.grey_depth(depth), is_smooth=True))
    for number, person in enumerate(people):
        shade = palette.PERSON_COLOURS[1 + number % (len(palette.PERSON_COLOURS) - 1)]
        colour = (int(shade[0]), int(shade[1]), int(shade[2]))
        left, top, right, bottom = (round(edge * window.scale) for edge in person.box)
        cv2.rectangle(picture, (left, top), (right - 1, bottom - 1), colour, 1)
        words = f"{number}: {person.distance:.1f} m, {100 * person.confidence:.0f} %"
        write_words(picture, words, (left + 3, max(12, top - 4)), colour)
    return picture


def people_panel(
    depth: NDArray[np.uint16],
    people: Sequence[FoundPerson],
    estimates: Sequence[JointEstimate],
    joints: Sequence[str],
) -> Picture:
    """The skeletons of everybody over the depth, without a caption.

    Args:
        depth: (height, width) uint16 [mm], 0 = nothing.
        people: By number.
        estimates: Of each.
        joints: Their joints' names.
    """
    picture, window = boxes_picture(depth, people), scene_window(depth)
    for estimate in estimates:
        draw_estimate(picture, window.places(estimate.joints, estimate.camera), joints, estimate)
    return picture


def captioned(panel: Picture) -> Picture:
    """A panel above what the marks of joints mean."""
    caption = marks_caption()
    width = max(panel.shape[1], caption.shape[1])
    return np.vstack([bordered(row, right=width - row.shape[1]) for row in (panel, caption)])
