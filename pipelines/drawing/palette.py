"""Colours of parts, classes and joint states; all BGR, as OpenCV draws."""

import colorsys

import cv2
import numpy as np
from numpy.typing import NDArray

from synth.vocabulary import MIRRORED_PART, OCCLUDER_CLASSES, PART_NAMES

INK = (235, 235, 235)
FAINT = (150, 150, 150)
PAPER = (24, 22, 20)
NO_RETURN = (48, 44, 42)
STATE_COLOURS = ((142, 190, 45), (20, 100, 225), (66, 228, 240), (170, 170, 170), (110, 60, 110))
"""Visible bluish green, occluded vermilion, self-occluded yellow, outside grey (after Okabe and Ito; BGR),
unknown purple, which only tables show: an unknown joint has no place."""
STATE_MARKERS = ("dot", "cross", "ring", "square", "square")
"""Marker of each joint state, so that it can be told without colour."""


def _part_colours() -> NDArray[np.uint8]:
    """(32, 3): one hue a pair of mirrored parts; the person's left is light, the right deep."""
    colours = np.zeros((len(PART_NAMES), 3), dtype=np.uint8)
    colours[0] = NO_RETURN
    pairs = sorted({tuple(sorted((label, MIRRORED_PART[label]))) for label in range(1, len(PART_NAMES))})
    for k, pair in enumerate(pairs):
        hue = (0.02 + k * 0.6180339887) % 1.0
        for label in pair:
            is_left = PART_NAMES[label].startswith("l")
            r, g, b = colorsys.hsv_to_rgb(hue, 0.42 if is_left else 0.95, 1.0 if is_left else 0.68)
            colours[label] = (255 * b, 255 * g, 255 * r)
    return colours


PART_COLOURS = _part_colours()
CLASS_COLOURS: NDArray[np.uint8] = np.array(
    [NO_RETURN, (60, 140, 225), (225, 160, 50), (160, 90, 210), (90, 190, 110), (205, 205, 70), (80, 80, 205),
     (160, 160, 170)],
    dtype=np.uint8,
)  # fmt: skip
"""(8, 3) by occluder class code."""
PERSON_BEHIND = (110, 104, 100)

if len(CLASS_COLOURS) != len(OCCLUDER_CLASSES):
    raise AssertionError("every occluder class needs a colour")


def depth_colours(depth: NDArray[np.uint16], near: float, far: float) -> NDArray[np.uint8]:
    """(height, width, 3) colours of a depth image.

    Args:
        depth: (height, width) [mm], 0 = no return.
        near: Depth of the warm end [mm].
        far: Depth of the cold end [mm].
    """
    share = (far - depth.astype(np.float64)) / max(1.0, far - near)
    grey = (255 * (0.08 + 0.88 * np.clip(share, 0.0, 1.0))).astype(np.uint8)
    colours = np.asarray(cv2.applyColorMap(grey, cv2.COLORMAP_TURBO), dtype=np.uint8)
    colours[depth == 0] = NO_RETURN
    return colours
