"""Part of a forest's graph: which pixels vote, as `forests.oarf.vote.choose_voters` has it, and where they are."""

from typing import NamedTuple

import numpy as np

from forests.crops import NOTHING
from nets.values import Value, counted, joined


class Foreground(NamedTuple):
    """The crop that a forest looks at.

    Attributes:
        image: (height + 2, width + 2) int32 [mm], with a border; NOTHING there and where nothing is.
        origin: (2,) int64, (row, column) in that image of the crop's first pixel, border counted.
        size: (2,) int64, rows and columns of the crop, border counted.
    """

    image: Value
    origin: Value
    size: Value


class Voters(NamedTuple):
    """Pixels that vote.

    Attributes:
        pixels: (n, 2) int64, (row, column) in the depth image.
        depth_mm: (n,) int32.
        stands_for: () float64, foreground pixels to a voter.
    """

    pixels: Value
    depth_mm: Value
    stands_for: Value


def foreground_of(depth: Value) -> Foreground:
    """The crop of a depth image (height, width) int32 [mm], 0 = nothing."""
    padded = depth.node("Pad", np.ones(4, np.int64), np.array(0, np.int32))
    is_there = (depth > 0).cast(np.int32)
    ends = [_ends(is_there.max(axis)) for axis in (1, 0)]
    first, last = (joined([of_axis[k].reshaped(1) for of_axis in ends], 0) for k in (0, 1))
    # In the padded image, the pixel before the first has the number of the first in the image.
    return Foreground(padded.equals(0).where(int(NOTHING), padded), first, last - first + 3)


def _ends(is_there: Value) -> tuple[Value, Value]:
    """First and last place (n,) that is not 0."""
    return is_there.first_of_most(0), is_there.first_of_most(0, is_last=True)


def choose_voters(depth: Value, foreground: Foreground, box: Value, n_wanted: int) -> Voters:
    """Spreads voters evenly over the foreground in a box.

    Args:
        depth: (height, width) int32 [mm], 0 = nothing.
        foreground: Its crop.
        box: (4,) float32, left, top, right and bottom [px], right and bottom excluded.
        n_wanted: Pixels to choose; all, if there are fewer.
    """
    edges = box.node("Ceil").cast(np.int64)
    left, top, right, bottom = (edges.pick(k) for k in range(4))
    top = top.most(foreground.origin.pick(0))
    columns, rows = counted(depth.size(1)), counted(depth.size(0))
    is_in = ((columns >= left) & (columns < right)).with_axis(0) & ((rows >= top) & (rows < bottom)).with_axis(1)
    is_seen = (depth > 0) & (depth < int(NOTHING))
    is_voter = (is_seen & is_in).cast(np.int32)
    in_row = is_voter.sum(1).cast(np.int64)
    n_foreground = in_row.sum(0)

    step = (n_foreground.cast(np.float64) / float(n_wanted)).node("Sqrt").cast(np.int64).most(1)
    is_read = _every(rows - top, step)
    is_too_thin = (is_read.cast(np.int64) * in_row).sum(0) < n_wanted  # something that lies between the rows
    is_read = is_read.node("Or", is_too_thin) & (in_row > 0)
    read = is_read.true_places().pick(0)
    places = is_voter.at(read).true_places().turned(1, 0)
    n_read = places.size(0)
    n = n_read.least(n_wanted)
    row, column = (places.at(counted(n) * n_read / n.most(1)).pick(k, 1) for k in (0, 1))
    pixels = joined([read.at(row).with_axis(1), column.with_axis(1)], 1)
    stands_for = n_foreground.cast(np.float64) / n.most(1).cast(np.float64)
    return Voters(pixels, depth.at_each(pixels), stands_for)


def _every(number: Value, step: Value) -> Value:
    """Whether numbers are those from half a step on, a step apart; they may be below 0."""
    beyond = number - step / 2
    return (beyond >= 0) & (beyond - beyond / step * step).equals(0)


def points_of(voters: Voters, intrinsics: Value) -> Value:
    """(n, 3) float32, the voters in the camera's frame [m].

    Args:
        voters: Pixels.
        intrinsics: (4,) float32, fx, fy, cx, cy [px].
    """
    focal, centre = (intrinsics.cast(np.float64).at(np.array(at)) for at in ([0, 1], [2, 3]))
    z = (voters.depth_mm.cast(np.float32) * 1e-3).cast(np.float64).with_axis(1)
    columns_rows = voters.pixels.at(np.array([1, 0]), axis=1).cast(np.float64)
    return joined([(columns_rows - centre) * z / focal, z], 1).cast(np.float32)
