"""Found people drawn over the depth image they were found in."""

from collections.abc import Iterable

import cv2
import numpy as np
from numpy.typing import NDArray

from forests.finder.find import FoundPerson
from pipelines.drawing import palette
from pipelines.drawing.captions import write_words
from pipelines.drawing.palette import Picture

FAR_MM = 8000
"""What is farther is as dark as this."""


def found_picture(
    depth: NDArray[np.uint16], people: Iterable[FoundPerson], is_false: NDArray[np.bool_] | None = None
) -> Picture:
    """(height, width, 3) the depth in grey, near is light, with the boxes of people.

    The upper-body box is thick, the person box thin, with the confidence and the distance beside.

    Args:
        depth: (height, width) uint16 [mm].
        people: Who was found.
        is_false: (n,) bool, whose boxes are drawn as wrong; None = nobody's.
    """
    shade = np.where(depth > 0, 40 + 200 * (1 - np.minimum(depth, FAR_MM) / FAR_MM), 0).astype(np.uint8)
    out = np.ascontiguousarray(np.repeat(shade[..., None], 3, axis=2))
    for k, person in enumerate(people):
        is_wrong = is_false is not None and bool(is_false[k])
        colour = (
            palette.VERMILION if is_wrong else palette.PERSON_COLOURS[1 + k % (len(palette.PERSON_COLOURS) - 1)]
        )
        colour = tuple(int(v) for v in colour)
        for box, thick in ((person.box, 1), (person.upper_body, 2)):
            left, top, right, bottom = (round(edge) for edge in box)
            cv2.rectangle(out, (left, top), (right - 1, bottom - 1), colour, thick)
        left, top = round(person.upper_body[0]) + 3, round(person.upper_body[1]) + 14
        write_words(out, f"{person.confidence:.2f} {person.distance:.1f} m", (left, top), colour)
    return out
