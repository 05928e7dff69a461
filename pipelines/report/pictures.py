"""Pictures of example frames: depth, truth, estimates, labels of pixels; all BGR, given out as data URIs."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from forests.estimate import JointEstimate
from pipelines.drawing.frames import person_window
from pipelines.drawing.palette import NO_RETURN, PART_COLOURS
from pipelines.drawing.skeletons import draw_skeleton, grey_depth
from synth.camera import Camera
from synth.frame import Frame
from synth.vocabulary import BONES, JOINT_NAMES, N_PARTS, OCCLUDER_CLASSES, JointState

TILE_WIDTH = 300
"""Columns of a picture [px]."""
ZOOM = 1.2
"""Size of the window over that of the person's box."""
HIGHEST = 1.6
"""Height over width of a window around the foreground, at most, where the image's border allows it."""
Picture = NDArray[np.uint8]
"""(height, width, 3) BGR."""

BLUISH_GREEN, VERMILION, SKY_BLUE, YELLOW = (115, 158, 0), (0, 94, 213), (233, 180, 86), (66, 228, 240)
"""Okabe and Ito; BGR."""
CLASS_COLOURS: NDArray[np.uint8] = np.array(
    [(0, 0, 0), (0, 159, 230), (233, 180, 86), (115, 158, 0), (66, 228, 240), (178, 114, 0), (0, 94, 213),
     (167, 121, 204)],
    dtype=np.uint8,
)  # fmt: skip
"""(8, 3) by occluder class code, Okabe and Ito; drawn with stripes, which no body part has."""
ANY_OBJECT = (200, 200, 200)
"""Of objects whose class is not told."""
_STRIPE = 4
_FRONT_M = 0.05


@dataclass(frozen=True)
class View:
    """A window of a frame, drawn large.

    Attributes:
        frame: The frame.
        rows: Of the image.
        columns: Of the image.
    """

    frame: Frame
    rows: slice
    columns: slice

    @classmethod
    def of(cls, frame: Frame) -> "View":
        """The window around the whole person."""
        return cls(frame, *person_window(frame, ZOOM))

    @classmethod
    def of_foreground(cls, frame: Frame) -> "View":
        """The window around all that the frame shows, not much higher than wide."""
        rows, columns = (np.flatnonzero((frame.depth > 0).any(axis=axis)) for axis in (1, 0))
        height, width = frame.depth.shape
        if not len(rows):
            return cls(frame, slice(0, height), slice(0, width))
        margin = 2 + (max(len(rows), len(columns)) // 16)
        top, bottom = max(0, int(rows[0]) - margin), min(height, int(rows[-1]) + 1 + margin)
        left, right = int(columns[0]) - margin, int(columns[-1]) + 1 + margin
        wider = max(0, round((bottom - top) / HIGHEST) - (right - left))
        left, right = left - wider // 2, right + (wider + 1) // 2
        return cls(frame, slice(top, bottom), slice(max(0, left), min(width, right)))

    @property
    def scale(self) -> float:
        """Pixels of the picture to a pixel of the image."""
        return TILE_WIDTH / (self.columns.stop - self.columns.start)

    def cut(self, picture: Picture) -> Picture:
        """The window out of a picture of the frame's size."""
        height = max(1, round((self.rows.stop - self.rows.start) * self.scale))
        window = picture[self.rows, self.columns]
        return np.asarray(
            cv2.resize(window, (TILE_WIDTH, height), interpolation=cv2.INTER_NEAREST), dtype=np.uint8
        )

    def place(self, xyz: NDArray[np.floating]) -> tuple[int, int] | None:
        """Where a point in camera coordinates [m] lies in the picture; None if not before the camera."""
        if not (np.isfinite(xyz).all() and xyz[2] > _FRONT_M):
            return None
        u, v = _pixel(xyz, self.frame.camera)
        column, row = (u - self.columns.start + 0.5) * self.scale, (v - self.rows.start + 0.5) * self.scale
        return round(min(max(column, -9999.0), 9999.0)), round(min(max(row, -9999.0), 9999.0))


def _pixel(xyz: NDArray[np.floating], camera: Camera) -> tuple[float, float]:
    x, y, z = map(float, xyz)
    return camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy


def depth_picture(view: View) -> Picture:
    """Depth, near light and far dark, in a scale that is even for colour-blind eyes too."""
    depth = view.frame.depth
    seen = depth[depth > 0].astype(np.float64)
    near, far = (np.percentile(seen, (1, 99))) if seen.size else (0.0, 1.0)
    share = np.clip((far - depth.astype(np.float64)) / max(1.0, far - near), 0.0, 1.0)
    grey = (40 + 215 * share).astype(np.uint8)
    colours = np.asarray(cv2.applyColorMap(grey, cv2.COLORMAP_CIVIDIS), dtype=np.uint8)
    colours[depth == 0] = NO_RETURN
    return view.cut(colours)


def truth_picture(view: View, names: Sequence[str], xyz: NDArray[np.float32], state: NDArray[np.uint8]) -> Picture:
    """True joints: a yellow ring where an object hides the joint, a sky blue dot elsewhere.

    Args:
        view: The window.
        names: (n_joints,) names of the joints.
        xyz: (n_joints, 3) camera frame [m].
        state: (n_joints,) `JointState`.
    """
    picture = _dim(view)
    _bones(picture, view, names, xyz, (235, 235, 235), 2)
    for point, is_hidden in zip(xyz, state == JointState.OCCLUDED, strict=True):
        place = view.place(point)
        if place:
            _ring(picture, place) if is_hidden else cv2.circle(picture, place, 5, SKY_BLUE, -1, cv2.LINE_AA)
    return picture


def estimate_picture(
    view: View, names: Sequence[str], truth: NDArray[np.float32], xyz: NDArray[np.float32], within: float
) -> Picture:
    """A method's joints over the true skeleton: a green dot where right, else a red cross tied to the truth.

    Args:
        view: The window.
        names: (n_joints,) names of the joints.
        truth: (n_joints, 3) camera frame [m].
        xyz: (n_joints, 3) the estimates; NaN = no answer.
        within: A joint this near is right [m].
    """
    picture = _dim(view)
    _bones(picture, view, names, truth, (150, 150, 150), 1)
    _bones(picture, view, names, xyz, (235, 235, 235), 2)
    for joint, point in zip(truth, xyz, strict=True):
        place, there = view.place(point), view.place(joint)
        if place is None:
            continue
        if np.linalg.norm(point - joint) <= within:
            cv2.circle(picture, place, 5, BLUISH_GREEN, -1, cv2.LINE_AA)
            continue
        if there:
            cv2.line(picture, there, place, VERMILION, 1, cv2.LINE_AA)
        x, y = place
        for rise in (-5, 5):
            cv2.line(picture, (x - 5, y - rise), (x + 5, y + rise), VERMILION, 3, cv2.LINE_AA)
    return picture


def skeleton_picture(view: View, names: Sequence[str], estimate: JointEstimate) -> Picture:
    """A skeleton over the grey depth, the person's right orange, left blue, as `undergrowth predict` draws it.

    Args:
        view: The window.
        names: (n_joints,) names of the joints.
        estimate: The joints.
    """
    picture = view.cut(grey_depth(view.frame.depth))
    places = [view.place(xyz) or (np.nan, np.nan) for xyz in estimate.joints]
    draw_skeleton(picture, np.array(places, np.float64), estimate, tuple(names))
    return picture


def label_picture(view: View, label: NDArray[np.uint8], tells_classes: bool = True) -> Picture:
    """Labels of pixels: parts in plain colours, objects in stripes.

    Args:
        view: The window.
        label: (height, width) uint8: 1..31 parts, 31 + c occluder class c, 0 = nothing.
        tells_classes: Whether occluder classes are told apart; else all have one colour.
    """
    is_object = label > N_PARTS
    colours = PART_COLOURS[np.where(is_object, 0, label)]
    code = np.where(is_object, label - N_PARTS, 0).astype(np.uint8)
    colours[is_object] = CLASS_COLOURS[code[is_object]] if tells_classes else ANY_OBJECT
    picture = view.cut(colours)
    is_object = view.cut(np.repeat(is_object[..., None].astype(np.uint8), 3, axis=2))[..., 0] > 0
    v, u = np.indices(is_object.shape)
    is_dark = is_object & ((u + v) // _STRIPE % 2 == 1)
    picture[is_dark] = picture[is_dark] // 2
    return picture


def true_label(frame: Frame) -> NDArray[np.uint8]:
    """(height, width) uint8 labels of what the camera sees: parts, and occluder class c as 31 + c."""
    return np.where(frame.occluder > 0, frame.occluder + N_PARTS, frame.part).astype(np.uint8)


def _dim(view: View) -> Picture:
    """The scene in dark greys: the person lighter than objects."""
    dim = np.full((*view.frame.depth.shape, 3), NO_RETURN, np.uint8)
    dim[view.frame.part > 0] = (108, 102, 98)
    dim[view.frame.occluder > 0] = (76, 70, 66)
    return view.cut(dim)


def _bones(
    picture: Picture,
    view: View,
    names: Sequence[str],
    xyz: NDArray[np.floating],
    colour: tuple[int, int, int],
    thick: int,
) -> None:
    at = {name: view.place(point) for name, point in zip(names, xyz, strict=True)}
    for a, b in BONES:
        first, second = at.get(JOINT_NAMES[a]), at.get(JOINT_NAMES[b])
        if first and second:
            cv2.line(picture, first, second, colour, thick, cv2.LINE_AA)


def _ring(picture: Picture, place: tuple[int, int]) -> None:
    cv2.circle(picture, place, 5, YELLOW, 2, cv2.LINE_AA)


def image_tag(picture: Picture, words: str, is_flat: bool) -> str:
    """The picture as an HTML image that holds its own data.

    Args:
        picture: The picture.
        words: Read out instead of it.
        is_flat: Few colours with sharp edges: kept exactly, as PNG; else as JPEG.
    """
    kind, options = (
        ("png", [cv2.IMWRITE_PNG_COMPRESSION, 9]) if is_flat else ("jpeg", [cv2.IMWRITE_JPEG_QUALITY, 82])
    )
    is_done, data = cv2.imencode(f".{kind}", picture, options)
    assert is_done
    height, width = picture.shape[:2]
    text = base64.b64encode(data.tobytes()).decode("ascii")
    return f'<img alt="{words}" width="{width}" height="{height}" src="data:image/{kind};base64,{text}">'


def class_colour(code: int) -> str:
    """An occluder class' colour as CSS has it."""
    blue, green, red = (int(v) for v in CLASS_COLOURS[code])
    return f"#{red:02x}{green:02x}{blue:02x}"


if len(CLASS_COLOURS) != len(OCCLUDER_CLASSES):
    raise AssertionError("every occluder class needs a colour")
