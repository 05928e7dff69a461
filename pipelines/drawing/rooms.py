"""Pictures of whole scenes: depth, classes, people with their skeletons, and the room from above."""

import cv2
import numpy as np

from pipelines.drawing import palette
from pipelines.drawing.captions import bordered, write_words
from pipelines.drawing.palette import Picture
from pipelines.drawing.plan import room_plan
from pipelines.drawing.skeletons import draw_mark, draw_truth
from pipelines.drawing.windows import Window
from synth.frame import Frame, RoomFrame
from synth.vocabulary import JOINT_NAMES, SCENE_CLASSES, JointState

TILE_WIDTH = 288
CAPTION_HEIGHT = 20
LEGEND_HEIGHT = 50
GAP = 4
COLUMNS = ("depth", "objects and surfaces", "people", "room from above")
LONGEST_CAPTION = 150
"""Letters of a frame's caption."""


def room_sheet(frames: list[RoomFrame]) -> Picture:
    """Strips of scenes below each other, under a legend.

    Args:
        frames: At least one, all of one image size.
    """
    strips = [_strip(frame) for frame in frames]
    return np.vstack([_legend(strips[0].shape[1]), *strips])


def _strip(frame: RoomFrame) -> Picture:
    height, width = frame.depth.shape
    window = Window.fitted(slice(0, height), slice(0, width), TILE_WIDTH)
    images = (room_depth(frame), class_picture(frame), people_picture(frame))
    tiles = [window.cut(image) for image in images[:2]]
    tiles.append(_with_skeletons(window.cut(images[2]), frame, window))
    tiles.append(room_plan(frame, tiles[0].shape[1], tiles[0].shape[0]))
    framed = [bordered(tile, below=GAP, right=GAP) for tile in tiles]
    row = np.hstack(framed)
    caption = np.full((CAPTION_HEIGHT, row.shape[1], 3), palette.PAPER, dtype=np.uint8)
    write_words(caption, room_caption(frame)[:LONGEST_CAPTION], (4, 14))
    return np.vstack([caption, row])


def room_caption(frame: RoomFrame) -> str:
    """One line on a scene."""
    info = frame.info
    people = ", ".join(f"{p.number} {p.activity} {100 * p.visible_fraction:.0f} %" for p in info.people)
    return f"{info.index}  {info.room_id}  {people or 'nobody'}"


def room_depth(frame: RoomFrame | Frame) -> Picture:
    """(height, width, 3) colours of the composite's depth, near warm, far cold."""
    seen = frame.depth[frame.depth > 0]
    near, far = (float(v) for v in np.percentile(seen, (1, 97))) if seen.size else (0.0, 1.0)
    return palette.depth_colours(frame.depth, near, far)


def class_picture(frame: RoomFrame) -> Picture:
    """(height, width, 3) classes in colour, neighbouring objects in two shades, people grey."""
    out = palette.SCENE_COLOURS[frame.occluder % len(palette.SCENE_COLOURS)].copy()
    out[frame.person > 0] = palette.INK
    shades = (frame.instance[..., None] % 3) * 12
    thing = frame.occluder > 0
    out[thing] = np.clip(out.astype(np.int16) - shades, 0, 255).astype(np.uint8)[thing]
    return out


def people_picture(frame: RoomFrame) -> Picture:
    """(height, width, 3) every person in a colour of their own, the room dark, hidden outlines in the same colour."""
    out = np.full((*frame.depth.shape, 3), palette.NO_RETURN, dtype=np.uint8)
    out[frame.occluder > 0] = palette.OBJECT_BEHIND
    for k, view in enumerate(frame.people, start=1):
        colour = palette.PERSON_COLOURS[k]
        out[frame.person == k] = (0.55 * colour).astype(np.uint8)
        alone = np.ascontiguousarray(view.body_part > 0).astype(np.uint8)
        outline, _ = cv2.findContours(alone, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(out, outline, -1, colour.tolist(), 1, offset=view.box[:2])
    return out


def _with_skeletons(picture: Picture, frame: RoomFrame, window: Window) -> Picture:
    for k, view in enumerate(frame.people, start=1):
        if not (view.joint_state != JointState.OUTSIDE).any():
            continue
        places = window.places(view.joints, frame.camera)
        draw_truth(picture, places, JOINT_NAMES, view.joint_state)
        x, y = places[0] + (8, -8)
        if np.isfinite((x, y)).all():
            write_words(picture, str(k), (int(x), int(y)), tuple(palette.PERSON_COLOURS[k].tolist()))
    return picture


def _legend(width: int) -> Picture:
    """Column names over the strips' tiles; classes and joint states."""
    out = np.full((LEGEND_HEIGHT, width, 3), palette.PAPER, dtype=np.uint8)
    for k, name in enumerate(COLUMNS):
        write_words(out, name, (k * (TILE_WIDTH + GAP) + 4, 42), palette.FAINT)
    x = 6
    for code, name in enumerate(SCENE_CLASSES[1:], start=1):
        cv2.rectangle(out, (x, 8), (x + 10, 18), palette.SCENE_COLOURS[code].tolist(), -1)
        x = write_words(out, name, (x + 14, 17)) + 8
    for state, mark in palette.STATE_MARKS.items():
        if state in (JointState.UNKNOWN, JointState.OUTSIDE, JointState.SELF_OCCLUDED):
            continue
        draw_mark(out, np.array([x + 6.0, 13.0]), mark)
        x = write_words(out, state.name.lower().replace("_", " "), (x + 15, 17)) + 8
    return out
