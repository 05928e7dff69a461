"""What a model found in a depth image: its skeleton over the depth, and its labels of the pixels beside it."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from forests.estimate import JointEstimate
from pipelines.drawing import palette
from pipelines.drawing.captions import GAP, bordered, classes_caption, marks_caption
from pipelines.drawing.headings import draw_heading
from pipelines.drawing.labels import PixelLabels, label_picture
from pipelines.drawing.palette import Picture
from pipelines.drawing.skeletons import PERSON_FROM, draw_estimate
from pipelines.drawing.windows import Window, foreground_window

PANEL_HEIGHT = 560
MAX_PANEL_WIDTH = 760
GROUND = 0.09
"""An arrow begins so far above the lower edge, as a share of the picture's height."""


def overlay(
    depth: NDArray[np.uint16], estimate: JointEstimate, joints: tuple[str, ...], pixels: PixelLabels | None = None
) -> Picture:
    """Draws one image's answer, cut to what it shows, above what the marks mean.

    Args:
        depth: (height, width) uint16 [mm], 0 = nothing.
        estimate: The joints.
        joints: Their names.
        pixels: Drawn beside it if given.
    """
    left = skeleton_panel(depth, estimate, joints)
    panels, captions = [left], [marks_caption()]
    if pixels is not None:
        panels += [np.full((len(left), GAP, 3), palette.PAPER, np.uint8)]
        panels += [label_picture(pixels, _window(depth))]
        captions.append(classes_caption(pixels))
    rows = [np.hstack(panels), *captions]
    width = max(row.shape[1] for row in rows)
    return np.vstack([bordered(row, right=width - row.shape[1]) for row in rows])


def skeleton_panel(depth: NDArray[np.uint16], estimate: JointEstimate, joints: tuple[str, ...]) -> Picture:
    """The skeleton over the depth, cut to what it shows, without a caption; arguments as of `overlay`."""
    return skeleton_over_depth(depth, estimate, joints, _window(depth))


def skeleton_over_depth(
    depth: NDArray[np.uint16], estimate: JointEstimate, joints: Sequence[str], window: Window
) -> Picture:
    """The skeleton over the grey depth, and below it an arrow that shows which way the person faces, if told.

    Args:
        depth: (height, width) uint16 [mm], 0 = nothing.
        estimate: The joints.
        joints: Their names.
        window: What is shown.
    """
    picture = window.cut(palette.grey_depth(depth), is_smooth=True)
    places = window.places(estimate.joints, estimate.camera)
    draw_estimate(picture, places, joints, estimate)
    is_anybody = not estimate.person_probability < PERSON_FROM
    if is_anybody and math.isfinite(estimate.heading) and np.isfinite(places).any():
        middle = np.clip(np.nanmedian(places[:, 0]), 0.0, picture.shape[1] - 1.0)
        ground = np.array([middle, len(picture) * (1.0 - GROUND)])
        draw_heading(picture, ground, estimate.heading, estimate.heading_probability)
    return picture


def _window(depth: NDArray[np.uint16]) -> Window:
    return foreground_window(depth, MAX_PANEL_WIDTH, PANEL_HEIGHT)
