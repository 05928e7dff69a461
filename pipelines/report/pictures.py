"""Pictures of example frames as the page holds them: depth, truth, errors, labels of pixels, skeletons."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from forests.estimate import JointEstimate
from pipelines.drawing.frames import scene_picture
from pipelines.drawing.html import Image, flat_image, photo_image
from pipelines.drawing.labels import PixelLabels, label_picture
from pipelines.drawing.overlays import skeleton_over_depth
from pipelines.drawing.palette import even_depth_colours
from pipelines.drawing.skeletons import draw_errors, draw_truth
from pipelines.drawing.windows import Window, foreground_window, person_window
from synth.frame import Frame

TILE_WIDTH = 300
"""Columns of a picture [px]."""
_ZOOM = 1.2
"""Size of the window over that of the person's box."""
_STEEPEST = 1.6
"""Height over width of a window around the foreground, at most."""


def example_window(frame: Frame) -> Window:
    """The window around the whole person."""
    return person_window(frame, _ZOOM, TILE_WIDTH)


def recorded_window(frame: Frame) -> Window:
    """The window around all that the frame shows."""
    return foreground_window(frame.depth, TILE_WIDTH, steepest=_STEEPEST)


def depth_image(frame: Frame, window: Window) -> Image:
    """What the camera saw."""
    return photo_image(window.cut(even_depth_colours(frame.depth)), "depth")


def truth_image(
    frame: Frame, window: Window, joints: Sequence[str], xyz: NDArray[np.float32], state: NDArray[np.uint8]
) -> Image:
    """True joints over the scene, by state.

    Args:
        frame: The frame.
        window: What is shown.
        joints: (n_joints,) names.
        xyz: (n_joints, 3) camera frame [m].
        state: (n_joints,) `JointState`.
    """
    picture = scene_picture(frame, window)
    draw_truth(picture, window.places(xyz, frame.camera), joints, state)
    return flat_image(picture, "true joints")


def errors_image(
    frame: Frame,
    window: Window,
    joints: Sequence[str],
    truth: NDArray[np.float32],
    xyz: NDArray[np.float32],
    within: float,
    words: str,
) -> Image:
    """A method's joints over the scene and the true skeleton, right and wrong ones.

    Args:
        frame: The frame.
        window: What is shown.
        joints: (n_joints,) names.
        truth: (n_joints, 3) camera frame [m].
        xyz: (n_joints, 3) the estimates; NaN = no answer.
        within: A joint this near is right [m].
        words: Read out instead of the picture.
    """
    picture = scene_picture(frame, window)
    is_right = np.linalg.norm(xyz - truth, axis=1) <= within
    places, true_places = window.places(xyz, frame.camera), window.places(truth, frame.camera)
    draw_errors(picture, places, true_places, joints, is_right)
    return flat_image(picture, words)


def labels_image(pixels: PixelLabels, window: Window, words: str) -> Image:
    """Labels of pixels; `words` are read out instead of the picture."""
    return flat_image(label_picture(pixels, window), words)


def skeleton_image(
    frame: Frame, window: Window, joints: Sequence[str], estimate: JointEstimate, words: str
) -> Image:
    """A skeleton over the grey depth, as `undergrowth predict` draws it.

    Args:
        frame: The frame.
        window: What is shown.
        joints: (n_joints,) names.
        estimate: The joints.
        words: Read out instead of the picture.
    """
    return photo_image(skeleton_over_depth(frame.depth, estimate, joints, window), words)
