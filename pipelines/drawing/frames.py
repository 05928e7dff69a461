"""The contact sheet: a strip of five pictures a frame."""

import cv2
import numpy as np
from numpy.typing import NDArray

from pipelines.drawing import palette
from synth.frame import Frame
from synth.vocabulary import BONES, OCCLUDER_CLASSES, JointState

TILE_WIDTH = 256
CAPTION_HEIGHT = 20
LEGEND_HEIGHT = 50
GAP = 4
COLUMNS = ("depth", "parts", "body alone", "occluders", "joints")
FONT = cv2.FONT_HERSHEY_SIMPLEX
Picture = NDArray[np.uint8]
"""(height, width, 3) BGR."""


def contact_sheet(frames: list[Frame], n_across: int = 2, zoom: float = 1.45) -> Picture:
    """Strips of frames, side by side and below each other, under a legend.

    Args:
        frames: At least one, all of one image size.
        n_across: Strips side by side.
        zoom: Cut every picture to the person's box times this, for the whole body; 0 shows the whole image.
    """
    strips = [_strip(frame, zoom) for frame in frames]
    blank = np.full_like(strips[0], palette.PAPER)
    strips += [blank] * (-len(strips) % n_across)
    rows = [np.hstack(strips[i : i + n_across]) for i in range(0, len(strips), n_across)]
    return np.vstack([_legend(rows[0].shape[1]), *rows])


def _strip(frame: Frame, zoom: float) -> Picture:
    window = person_window(frame, zoom)
    tile_height = max(1, round(frame.depth.shape[0] * TILE_WIDTH / frame.depth.shape[1]))
    tiles = [_tile(picture[window], tile_height) for picture in pictures(frame, window[1].stop - window[1].start)]
    framed = [np.pad(tile, ((0, GAP), (0, GAP), (0, 0))) for tile in tiles]
    strip = np.hstack(framed)
    strip[-GAP:] = palette.PAPER
    for k in range(len(tiles)):
        right = (k + 1) * (TILE_WIDTH + GAP)
        strip[:, right - GAP : right] = palette.PAPER
    caption = np.full((CAPTION_HEIGHT, strip.shape[1], 3), palette.PAPER, dtype=np.uint8)
    _text(caption, caption_of(frame), (4, 14), palette.INK)
    return np.vstack([caption, strip])


def person_window(frame: Frame, zoom: float) -> tuple[slice, slice]:
    """Rows and columns around the whole body, of the image's proportions and inside it.

    Args:
        frame: The frame.
        zoom: Size over that of the body's box; 0 for the whole image.
    """
    height, width = frame.depth.shape
    rows, columns = (np.flatnonzero((frame.body_part > 0).any(axis=axis)) for axis in (1, 0))
    if zoom <= 0 or not len(rows):
        return slice(0, height), slice(0, width)
    box = np.array([rows[-1] - rows[0] + 1, columns[-1] - columns[0] + 1])
    share = min(1.0, max(0.25, zoom * float((box / (height, width)).max())))
    size = np.array([round(share * height), round(share * width)])
    middle = np.array([rows[0] + rows[-1], columns[0] + columns[-1]]) // 2
    top, left = np.clip(middle - size // 2, 0, np.array([height, width]) - size)
    return slice(int(top), int(top + size[0])), slice(int(left), int(left + size[1]))


def caption_of(frame: Frame) -> str:
    """One line on a frame."""
    info = frame.info
    seen = f"{100 * info.visible_fraction:.0f} % seen"
    objects = ", ".join(item.class_name for item in info.objects) or "no object"
    return f"{info.index}  {info.scene_family} / {info.pose_family}  {info.subject_id}  {seen}  {objects}"


def pictures(frame: Frame, shown_width: int = TILE_WIDTH) -> tuple[Picture, ...]:
    """The five pictures of `COLUMNS`, each at the frame's size.

    Args:
        frame: The frame.
        shown_width: Pixels across that a tile will show, so that markers are drawn large enough.
    """
    body = frame.body_depth[frame.body_depth > 0]
    shown = body if body.size else frame.depth[frame.depth > 0]
    near, far = (float(shown.min()), float(shown.max())) if shown.size else (0.0, 1.0)
    depth = palette.depth_colours(frame.depth, near - 500, far + 400)
    parts = palette.PART_COLOURS[frame.part % len(palette.PART_COLOURS)]
    alone = palette.PART_COLOURS[frame.body_part % len(palette.PART_COLOURS)]
    return depth, parts, alone, _occluders(frame), joints_picture(frame, shown_width / TILE_WIDTH)


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


def joints_picture(frame: Frame, scale: float = 1.0) -> Picture:
    """Bones and joints over a dim picture, a colour and a marker for each joint state, scaled by `scale`."""
    dim = np.full((*frame.depth.shape, 3), palette.NO_RETURN, dtype=np.uint8)
    dim[frame.part > 0] = (120, 112, 106)
    dim[frame.occluder > 0] = (78, 72, 70)
    radius, thick = max(2, round(4 * scale)), max(1, round(scale))
    places = np.clip(np.nan_to_num(frame.joints_2d), -1e4, 1e4)
    in_front = frame.joints[:, 2] > 0.05
    for a, b in BONES:
        if in_front[a] and in_front[b]:
            cv2.line(dim, _pixel(places[a]), _pixel(places[b]), palette.INK, thick, cv2.LINE_AA)
    for place, state, is_shown in zip(places, frame.joint_state, in_front, strict=True):
        if is_shown:
            draw_marker(dim, _pixel(place), int(state) % len(palette.STATE_MARKERS), radius)
    return dim


def _pixel(place: NDArray[np.float64]) -> tuple[int, int]:
    return round(float(place[0])), round(float(place[1]))


def draw_marker(picture: Picture, centre: tuple[int, int], state: int, radius: int) -> None:
    """Draws a joint state's marker in place."""
    colour, thick = palette.STATE_COLOURS[state], max(1, radius // 3)
    x, y = centre
    marker = palette.STATE_MARKERS[state]
    if marker == "dot":
        cv2.circle(picture, centre, radius, colour, -1, cv2.LINE_AA)
    elif marker == "ring":
        cv2.circle(picture, centre, radius, colour, thick, cv2.LINE_AA)
    elif marker == "cross":
        cv2.line(picture, (x - radius, y - radius), (x + radius, y + radius), colour, thick, cv2.LINE_AA)
        cv2.line(picture, (x - radius, y + radius), (x + radius, y - radius), colour, thick, cv2.LINE_AA)
    else:
        cv2.rectangle(picture, (x - radius, y - radius), (x + radius, y + radius), colour, thick)


def _tile(picture: Picture, height: int) -> Picture:
    way = cv2.INTER_AREA if picture.shape[1] > TILE_WIDTH else cv2.INTER_NEAREST
    return np.asarray(cv2.resize(picture, (TILE_WIDTH, height), interpolation=way), dtype=np.uint8)


def _legend(width: int) -> Picture:
    """Column names over the first strip's tiles; classes and joint states below."""
    out = np.full((LEGEND_HEIGHT, width, 3), palette.PAPER, dtype=np.uint8)
    per_strip = len(COLUMNS) * (TILE_WIDTH + GAP)
    for start in range(0, width, per_strip):
        for k, name in enumerate(COLUMNS):
            _text(out, name, (start + k * (TILE_WIDTH + GAP) + 4, 42), palette.FAINT)
    x = 6
    for code, name in enumerate(OCCLUDER_CLASSES[1:], start=1):
        colour = tuple(int(v) for v in palette.CLASS_COLOURS[code])
        cv2.rectangle(out, (x, 8), (x + 12, 20), colour, -1)
        x = _text(out, name, (x + 17, 19), palette.INK) + 16
    x += 20
    for state in JointState:
        if state is JointState.UNKNOWN:
            continue
        draw_marker(out, (x + 6, 14), int(state), 5)
        x = _text(out, "joint " + state.name.lower().replace("_", "-"), (x + 17, 19), palette.INK) + 16
    _text(out, "parts: the person's left light, right deep", (x + 20, 19), palette.INK)
    return out


def _text(picture: Picture, words: str, place: tuple[int, int], colour: tuple[int, int, int]) -> int:
    """Writes a line and returns where it ends."""
    cv2.putText(picture, words, place, FONT, 0.42, colour, 1, cv2.LINE_AA)
    return place[0] + cv2.getTextSize(words, FONT, 0.42, 1)[0][0]
