"""Which frames of a motion are on a seat: the trunk upright, both thighs lying, the hips at rest at a seat's height."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from synth.bodies.mocap.rest import angles_between
from synth.bodies.mocap.source import Source

TRUNK = np.radians(55.0)
"""The way from hips to neck of who sits is this upright."""
THIGH = np.radians(38.0)
"""Each thigh of who sits is at least this far from hanging straight down."""
THIGHS = np.radians(40.0)
"""And both are on average."""
THIGH_RAISED = np.radians(130.0)
"""But no thigh is farther than this from it."""
HIPS_ABOVE_FLOOR = (0.22, 0.92)
"""Hip joints of who sits are this high above the floor; they are some 9 cm above the seat [m]."""
HIPS_ABOVE_LOWEST = (0.2, 0.85)
"""And this high above the lowest joint, so that nothing of the body is far below the seat or all of it level [m]."""
KNEES_ABOVE_FLOOR = 0.2
"""Knees of who sits are higher than this; those of who kneels are not [m]."""
REST_TIME = 0.5
"""For at least so long a person is on a seat; who hops or climbs does not rest that long [s]."""
REST_WAY = 0.1
"""And meanwhile the hips move less than this along each axis [m]."""


def seat_like(source: Source, floor: float) -> NDArray[np.bool_]:
    """(n,) whether a frame alone could be of somebody on a seat, whatever carries them.

    Args:
        source: The motion.
        floor: Height of the floor [m].
    """
    hips = 0.5 * (source.at("l_hip") + source.at("r_hip"))
    down = np.array([0.0, 0.0, -1.0])
    trunk = angles_between(source.at("neck") - hips, -down)
    thighs = angles_between(source.limb[:, :, 2], down)
    do_thighs_lie = (thighs > THIGH).all(axis=1) & (thighs.mean(axis=1) > THIGHS)
    do_thighs_lie &= (thighs < THIGH_RAISED).all(axis=1)
    knees = np.minimum(source.at("l_knee")[:, 2], source.at("r_knee")[:, 2]) - floor
    above_floor = hips[:, 2] - floor
    above_lowest = hips[:, 2] - source.position[:, :, 2].min(axis=1)
    return (
        (trunk < TRUNK)
        & do_thighs_lie
        & (knees > KNEES_ABOVE_FLOOR)
        & (above_floor > HIPS_ABOVE_FLOOR[0])
        & (above_floor < HIPS_ABOVE_FLOOR[1])
        & (above_lowest > HIPS_ABOVE_LOWEST[0])
        & (above_lowest < HIPS_ABOVE_LOWEST[1])
    )


def resting(source: Source, is_candidate: NDArray[np.bool_], frame_time: float) -> NDArray[np.bool_]:
    """(n,) those candidates that belong to a stretch of at least `REST_TIME` in which the hips rest.

    Args:
        source: The motion.
        is_candidate: (n,) frames that may be of somebody on a seat.
        frame_time: [s].
    """
    hips = 0.5 * (source.at("l_hip") + source.at("r_hip"))
    out = np.zeros(len(hips), np.bool_)
    width = max(2, int(np.ceil(REST_TIME / frame_time - 1e-3)))
    if len(hips) < width:
        return out
    ways = np.ptp(sliding_window_view(hips, width, axis=0), axis=2).max(axis=1)
    rests = (ways < REST_WAY) & sliding_window_view(is_candidate, width).all(axis=1)
    for start in np.flatnonzero(rests):
        out[start : start + width] = True
    return out
