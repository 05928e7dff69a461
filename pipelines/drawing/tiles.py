"""The contact sheet of a sequence: pictures of evenly spread images, side by side."""

import cv2
import numpy as np

from pipelines.drawing import palette
from pipelines.drawing.captions import CAPTION_HEIGHT, GAP, bordered, marks_caption, write_words
from pipelines.drawing.palette import Picture

TILE = (300, 260)
"""Width and height of a picture [px]; it is drawn into the middle."""
N_ACROSS = 4
N_SHOWN = 12


def sheet_tile(picture: Picture, name: str) -> Picture:
    """A picture made small, its name above."""
    scale = min(TILE[0] / picture.shape[1], TILE[1] / picture.shape[0])
    size = (max(1, round(picture.shape[1] * scale)), max(1, round(picture.shape[0] * scale)))
    small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    tile = np.full((CAPTION_HEIGHT + TILE[1], TILE[0], 3), palette.PAPER, np.uint8)
    left, top = (TILE[0] - size[0]) // 2, CAPTION_HEIGHT + (TILE[1] - size[1]) // 2
    tile[top : top + size[1], left : left + size[0]] = small
    write_words(tile, name, (4, 14))
    return tile


def sheet(tiles: list[Picture], has_joints: bool = True) -> Picture:
    """Tiles in rows; below, what the marks of joints mean.

    Args:
        tiles: At least one, of `sheet_tile`.
        has_joints: Whether joints are drawn in them.
    """
    n_across = min(N_ACROSS, len(tiles))
    framed = [bordered(tile, above=GAP, left=GAP) for tile in tiles]
    framed += [np.full_like(framed[0], palette.PAPER)] * (-len(tiles) % n_across)
    rows = [np.hstack(framed[i : i + n_across]) for i in range(0, len(framed), n_across)]
    if not has_joints:
        return np.vstack(rows)
    foot = np.full((CAPTION_HEIGHT + GAP, rows[0].shape[1], 3), palette.PAPER, np.uint8)
    caption = marks_caption()[: len(foot), : foot.shape[1]]
    foot[: len(caption), : caption.shape[1]] = caption
    return np.vstack([*rows, foot])
