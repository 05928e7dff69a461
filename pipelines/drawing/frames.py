"""The contact sheet: a strip of five pictures a frame."""

import cv2
import numpy as np

from pipelines.drawing import palette
from pipelines.drawing.captions import bordered, write_words
from pipelines.drawing.palette import Picture
from pipelines.drawing.skeletons import draw_mark, draw_truth
from pipelines.drawing.windows import Window, person_window
from synth.frame import Frame
from synth.vocabulary import JOINT_NAMES, OCCLUDER_CLASSES, SINGLE_STATES, JointState

TILE_WIDTH = 256
CAPTION_HEIGHT = 20
LEGEND_HEIGHT = 50
GAP = 4
COLUMNS = ("depth", "parts", "body alone", "occluders", "joints")


def contact_sheet(frames: list[Frame], n_across: int = 2, zoom: float = 1.45) -> Picture:
    """Strips of frames, side by side and below each other, under a legend.

    Args:
        frames: At least one, all of one image size.
        n_across: Strips side by side.
        zoom: Cut every picture to the person's box times this, for the whole body; 0 shows the whole image.
    """
    strips = [_strip(frame, zoom) for frame in frames]
    height = max(len(strip) for strip in strips)
    strips = [bordered(strip, below=height - len(strip)) for strip in strips]
    blank = np.full_like(strips[0], palette.PAPER)
    strips += [blank] * (-len(strips) % n_across)
    rows = [np.hstack(strips[i : i + n_across]) for i in range(0, len(strips), n_across)]
    return np.vstack([_legend(rows[0].shape[1]), *rows])


def _strip(frame: Frame, zoom: float) -> Picture:
    tiles = pictures(frame, person_window(frame, zoom, TILE_WIDTH))
    framed = [bordered(tile, below=GAP, right=GAP) for tile in tiles]
    caption = np.full((CAPTION_HEIGHT, len(tiles) * (TILE_WIDTH + GAP), 3), palette.PAPER, dtype=np.uint8)
    write_words(caption, caption_of(frame), (4, 14))
    return np.vstack([caption, np.hstack(framed)])


def caption_of(frame: Frame) -> str:
    """One line on a frame."""
    info = frame.info
    seen = f"{100 * info.visible_fraction:.0f} % seen"
    objects = ", ".join(item.class_name for item in info.objects) or "no object"
    return f"{info.index}  {info.scene_family} / {info.pose_family}  {info.subject_id}  {seen}  {objects}"


def pictures(frame: Frame, window: Window) -> tuple[Picture, ...]:
    """The five pictures of `COLUMNS`, of a window of a frame."""
    body = frame.body_depth[frame.body_depth > 0]
    shown = body if body.size else frame.depth[frame.depth > 0]
    near, far = (float(shown.min()), float(shown.max())) if shown.size else (0.0, 1.0)
    depth = palette.depth_colours(frame.depth, near - 500, far + 400)
    parts = palette.PART_COLOURS[frame.part % len(palette.PART_COLOURS)]
    alone = palette.PART_COLOURS[frame.body_part % len(palette.PART_COLOURS)]
    joints = joints_picture(frame, window)
    return *(window.cut(picture) for picture in (depth, parts, alone, _occluders(frame))), joints


def _occluders(frame: Frame) -> Picture:
    """Classes in colour, the seen person in grey, the hidden outline of the person in white."""
    out = palette.CLASS_COLOURS[frame.occluder % len(palette.CLASS_COLOURS)].copy()
    out[frame.part > 0] = palette.PERSON_BEHIND
    shades = (frame.instance[..., None] % 3) * 18
    thing = frame.occluder > 0
    out[thing] = np.clip(out.astype(np.int16) - shades, 0, 255).astype(np.uint8)[thing]
    outline, _ = cv2.findContours((frame.body_part > 0).astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(out, outline, -1, palette.INK, 1)
    return out


def scene_picture(frame: Frame, window: Window) -> Picture:
    """A window of the scene in dark greys, to be drawn upon: the person lighter than objects."""
    dim = np.full((*frame.depth.shape, 3), palette.NO_RETURN, dtype=np.uint8)
    dim[frame.part > 0] = palette.PERSON_BEHIND
    dim[frame.occluder > 0] = palette.OBJECT_BEHIND
    return window.cut(dim)


def joints_picture(frame: Frame, window: Window) -> Picture:
    """The true skeleton over the scene, a mark for each joint state; joints behind the camera are left out."""
    picture = scene_picture(frame, window)
    draw_truth(picture, window.places(frame.joints, frame.camera), JOINT_NAMES, frame.joint_state)
    return picture


def _legend(width: int) -> Picture:
    """Column names over the first strip's tiles; classes and joint states below."""
    out = np.full((LEGEND_HEIGHT, width, 3), palette.PAPER, dtype=np.uint8)
    per_strip = len(COLUMNS) * (TILE_WIDTH + GAP)
    for start in range(0, width, per_strip):
        for k, name in enumerate(COLUMNS):
            write_words(out, name, (start + k * (TILE_WIDTH + GAP) + 4, 42), palette.FAINT)
    x = 6
    for code, name in enumerate(OCCLUDER_CLASSES[1:], start=1):
        cv2.rectangle(out, (x, 8), (x + 12, 20), palette.CLASS_COLOURS[code].tolist(), -1)
        x = write_words(out, name, (x + 17, 19)) + 16
    x += 20
    for state in SINGLE_STATES:
        if state is JointState.UNKNOWN:
            continue
        draw_mark(out, np.array([x + 6.0, 14.0]), palette.STATE_MARKS[state])
        x = write_words(out, "joint " + state.name.lower().replace("_", "-"), (x + 17, 19)) + 16
    write_words(out, "parts: the person's left light, right deep", (x + 20, 19))
    return out
