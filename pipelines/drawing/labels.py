"""Pictures of the labels of pixels: body parts in plain colours, objects in stripes."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing import palette
from pipelines.drawing.palette import Picture
from pipelines.drawing.windows import Window
from synth.frame import Frame
from synth.vocabulary import N_PARTS, OCCLUDER_CLASSES, PART_NAMES

_STRIPE = 4
"""Width of a stripe [px]."""


class PixelLabels(NamedTuple):
    """What a model calls the pixels, or what they are.

    Attributes:
        labels: (height, width) class + 1, 0 = nothing.
        classes: Names of the classes.
    """

    labels: NDArray[np.uint8]
    classes: tuple[str, ...]


def true_labels(frame: Frame) -> PixelLabels:
    """What the camera sees: body parts and classes of objects."""
    labels = np.where(frame.occluder > 0, frame.occluder + N_PARTS, frame.part).astype(np.uint8)
    return PixelLabels(labels, (*PART_NAMES[1:], *OCCLUDER_CLASSES[1:]))


def label_colours(labels: NDArray[np.uint8], classes: tuple[str, ...]) -> Picture:
    """(height, width, 3) colours of class + 1 by pixel, 0 = nothing; as contact sheets have them.

    Args:
        labels: (height, width).
        classes: Names of the classes; one that is neither a body part nor a class of objects is grey.
    """
    colours = np.full((len(classes) + 1, 3), palette.FAINT, np.uint8)
    colours[0] = palette.NO_RETURN
    for number, name in enumerate(classes, start=1):
        if name in PART_NAMES:
            colours[number] = palette.PART_COLOURS[PART_NAMES.index(name)]
        elif name in OCCLUDER_CLASSES:
            colours[number] = palette.CLASS_COLOURS[OCCLUDER_CLASSES.index(name)]
    return colours[labels]


def label_picture(pixels: PixelLabels, window: Window) -> Picture:
    """The labels in a window; objects are striped, because some share a colour with a body part."""
    picture = window.cut(label_colours(*pixels))
    is_object_class = np.array([False, *(name not in PART_NAMES for name in pixels.classes)])
    is_object = is_object_class[pixels.labels].astype(np.uint8) * 255
    is_object_there = window.cut(np.repeat(is_object[..., None], 3, axis=2))[..., 0] > 127
    v, u = np.indices(is_object_there.shape)
    is_dark = is_object_there & ((u + v) // _STRIPE % 2 == 1)
    picture[is_dark] = picture[is_dark] // 2
    return picture
