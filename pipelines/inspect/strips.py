"""Film strips of clips: moments beside each other, a row a camera, with the ways of the people from above."""

import numpy as np

from pipelines.corpus.rooms.clips import Clip
from pipelines.drawing import palette
from pipelines.drawing.captions import bordered, write_words
from pipelines.drawing.palette import Picture
from pipelines.drawing.plan import room_plan
from pipelines.drawing.rooms import room_depth
from pipelines.drawing.windows import Window
from pipelines.spread import first_to_last
from synth.frame import Frame, RoomFrame
from synth.vocabulary import JOINT_NAMES

TILE_WIDTH = 192
CAPTION_HEIGHT = 20
GAP = 3
LONGEST_CAPTION = 150
"""Letters of a clip's caption."""
TINT = 0.45
"""How much of a person's colour lies over the depth."""
_HIPS = [JOINT_NAMES.index("r_hip"), JOINT_NAMES.index("l_hip")]


def film_strip(clip: Clip, n_moments: int = 6, sensor: str | None = None) -> Picture:
    """Moments of a clip from left to right, a row for each camera; in rooms also the ways of everybody from above.

    Args:
        clip: The clip.
        n_moments: How many moments, at most those there are.
        sensor: Sensor model for the depth, or None.
    """
    steps = first_to_last(clip.n_steps, n_moments)
    rows = []
    for view in range(clip.n_views):
        frames = [clip.frame(int(step), view, sensor) for step in steps]
        tiles = [_tile(frame) for frame in frames]
        if isinstance(last := frames[-1], RoomFrame):
            tiles.append(room_plan(last, tiles[0].shape[1], tiles[0].shape[0], ways(clip)))
        rows.append(np.hstack([bordered(tile, below=GAP, right=GAP) for tile in tiles]))
    caption = np.full((CAPTION_HEIGHT, rows[0].shape[1], 3), palette.PAPER, np.uint8)
    write_words(caption, _told(clip, steps)[:LONGEST_CAPTION], (4, 14))
    return np.vstack([caption, *rows])


def ways(clip: Clip) -> list[np.ndarray]:
    """(n_steps, 2) where the hips of each person go, seen from above, world frame [m]."""
    if "joints_world" not in clip.corpus.header.fields:
        return []
    hips = clip.array("joints_world")[:, : len(clip.subjects()), _HIPS, :2].mean(axis=2)
    return list(hips.transpose(1, 0, 2).astype(np.float64))


def people_over_depth(frame: RoomFrame) -> Picture:
    """(height, width, 3) the depth, with everybody in a colour of their own."""
    out = room_depth(frame)
    colours = palette.PERSON_COLOURS[frame.person]
    is_person = frame.person > 0
    out[is_person] = ((1.0 - TINT) * out + TINT * colours).astype(np.uint8)[is_person]
    return out


def _tile(frame: RoomFrame | Frame) -> Picture:
    image = people_over_depth(frame) if isinstance(frame, RoomFrame) else room_depth(frame)
    height, width = image.shape[:2]
    return Window.fitted(slice(0, height), slice(0, width), TILE_WIDTH).cut(image)


def _told(clip: Clip, steps: np.ndarray) -> str:
    seconds = clip.seconds()
    people = []
    info = clip.corpus.record(int(clip.numbers[0, 0]))
    for k, one in enumerate(getattr(info, "people", ())):
        records = (clip.corpus.scene_record(int(clip.numbers[step, 0])) for step in steps)
        doing = dict.fromkeys(record.people[k].activity for record in records)
        people.append(f"{one.number} {' > '.join(doing)}")
    return f"{clip.split} {clip.number}  {seconds[-1]:.1f} s, {clip.n_views} cameras  {'; '.join(people)}"
