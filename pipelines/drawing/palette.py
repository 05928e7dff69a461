"""The one table of colours: body parts, classes of objects, joint states; all BGR, as OpenCV draws."""

import colorsys
from collections.abc import Mapping
from typing import Literal, NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from synth.vocabulary import MIRRORED_PART, OCCLUDER_CLASSES, PART_NAMES, SCENE_CLASSES, JointState

Picture = NDArray[np.uint8]
"""(height, width, 3) BGR."""
Colour = tuple[int, int, int]
"""Blue, green, red."""
Shape = Literal["dot", "ring", "cross", "square"]

ORANGE, SKY_BLUE, BLUISH_GREEN, YELLOW = (0, 159, 230), (233, 180, 86), (115, 158, 0), (66, 228, 240)
BLUE, VERMILION, REDDISH_PURPLE = (178, 114, 0), (0, 94, 213), (167, 121, 204)
"""The seven colours of Okabe and Ito, which colour-blind readers tell apart too."""
INK = (235, 235, 235)
FAINT = (150, 150, 150)
PAPER = (24, 22, 20)
OUTLINE = (20, 18, 16)
"""Around bones and joints that lie over a depth image."""
NO_RETURN = (48, 44, 42)
PERSON_BEHIND = (110, 104, 100)
"""The person, where a picture is about something else."""
OBJECT_BEHIND = (77, 71, 68)
"""An object, where a picture is about something else."""


class Mark(NamedTuple):
    """How a joint is drawn: shapes differ too, so that no reader needs the colour.

    Attributes:
        shape: Its shape.
        colour: Its colour.
    """

    shape: Shape
    colour: Colour


STATE_MARKS: Mapping[JointState, Mark] = {
    JointState.VISIBLE: Mark("dot", SKY_BLUE),
    JointState.OCCLUDED: Mark("ring", YELLOW),
    JointState.SELF_OCCLUDED: Mark("ring", REDDISH_PURPLE),
    JointState.OUTSIDE: Mark("square", FAINT),
    JointState.UNKNOWN: Mark("square", (110, 60, 110)),
    JointState.OCCLUDED_BY_PERSON: Mark("cross", YELLOW),
}
"""Marks of true joints; only tables show unknown joints, which have no place."""
RIGHT, WRONG = Mark("dot", BLUISH_GREEN), Mark("cross", VERMILION)
"""Marks of estimated joints that are near enough to the truth, and of those that are not."""
SIDES: Mapping[str, Colour] = {"r_": (0, 110, 230), "l_": (235, 180, 70)}
"""Of estimated joints, by the beginning of the name: the person's right orange, the left blue."""


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
    [NO_RETURN, ORANGE, SKY_BLUE, BLUISH_GREEN, YELLOW, BLUE, VERMILION, REDDISH_PURPLE], dtype=np.uint8
)
"""(8, 3) by occluder class code; beside body parts, objects are drawn with stripes."""

SCENE_COLOURS: NDArray[np.uint8] = np.concatenate(
    [CLASS_COLOURS, np.array([(92, 108, 96), (128, 116, 104), (72, 66, 84), (64, 96, 128)], dtype=np.uint8)]
)
"""(12, 3) by class code of whole scenes: floor greenish, walls grey, ceiling dim, background brown."""
PERSON_COLOURS: NDArray[np.uint8] = np.array(
    [NO_RETURN, (110, 200, 255), (255, 190, 120), (150, 235, 150), (220, 150, 235), (120, 240, 245),
     (235, 235, 160), (140, 140, 255), (225, 225, 225)], dtype=np.uint8
)  # fmt: skip
"""(9, 3) by number of the person."""

if len(CLASS_COLOURS) != len(OCCLUDER_CLASSES) or len(SCENE_COLOURS) != len(SCENE_CLASSES):
    raise AssertionError("every class needs a colour")


def side_colour(joint: str) -> Colour:
    """Colour of an estimated joint, by the person's side that its name tells."""
    return SIDES.get(joint[:2], INK)


def css_colour(colour: ArrayLike) -> str:
    """A colour as CSS writes it: "#rrggbb"."""
    blue, green, red = np.asarray(colour, dtype=np.uint8).tolist()
    return f"#{red:02x}{green:02x}{blue:02x}"


def depth_colours(depth: NDArray[np.uint16], near: float, far: float) -> Picture:
    """(height, width, 3) colours of a depth image; near is warm, far is cold.

    Args:
        depth: (height, width) [mm], 0 = no return.
        near: Depth of the warm end [mm].
        far: Depth of the cold end [mm].
    """
    return _coloured(depth, 0.08 + 0.88 * _nearness(depth, near, far), cv2.COLORMAP_TURBO)


def even_depth_colours(depth: NDArray[np.uint16]) -> Picture:
    """(height, width, 3) colours of a depth image; near is light, far is dark, also to colour-blind eyes."""
    return _coloured(depth, (40 + 215 * _nearness(depth, *_ends(depth))) / 255, cv2.COLORMAP_CIVIDIS)


def grey_depth(depth: NDArray[np.uint16]) -> Picture:
    """(height, width, 3) greys of a depth image; near is light, far is dark, both dim enough to draw upon."""
    share = _nearness(depth, *_ends(depth))
    grey = np.repeat((70 + 130 * share).astype(np.uint8)[..., None], 3, axis=2)
    grey[depth == 0] = NO_RETURN
    return grey


def _ends(depth: NDArray[np.uint16]) -> tuple[float, float]:
    """Near and far end of almost all that a depth image shows [mm]."""
    seen = depth[depth > 0]
    near, far = np.percentile(seen, (1, 99)) if seen.size else (0.0, 1.0)
    return float(near), float(far)


def _nearness(depth: NDArray[np.uint16], near: float, far: float) -> NDArray[np.float64]:
    return np.clip((far - depth.astype(np.float64)) / max(1.0, far - near), 0.0, 1.0)


def _coloured(depth: NDArray[np.uint16], share: NDArray[np.float64], colour_map: int) -> Picture:
    colours = np.asarray(cv2.applyColorMap((255 * share).astype(np.uint8), colour_map), dtype=np.uint8)
    colours[depth == 0] = NO_RETURN
    return colours
