"""A captured motion as it can be put on any body: angles, the hips' way over the floor, and what touches it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from synth.bodies.mocap.ground import foot_contacts
from synth.bodies.mocap.rest import SIDES
from synth.bodies.mocap.retarget import Retargeted, heading_of
from synth.bodies.mocap.source import Source

LEAST_SECONDS = 1.5
"""Shorter stretches are left out."""
GAP_SECONDS = 0.1
"""Contacts that are lost or found for less than this are not."""
BRIDGED_SECONDS = 0.25
"""Frames that cannot be used, in so short a time between others, are bridged."""
ANKLE_SHARE = 0.08
"""Height of the ankle joint above the sole over the length of thigh and shank (Winter 2009, figure 4.1)."""


class RecordedMotion(NamedTuple):
    """A stretch of a recording.

    Attributes:
        motion_id: Identifier: source, split, recording, first frame.
        fps: Frames a second.
        angles: (n, n_dofs) within the limits [rad].
        root: (n, 3, 3) rotation of the root, heading included.
        hips: (n, 3) middle of the hip joints; z from the floor, in lengths of the leg from the hip joint to the sole.
        contacts: (n, 2, 2) left and right foot: whether heel and toes are down.
    """

    motion_id: str
    fps: float
    angles: NDArray[np.float32]
    root: NDArray[np.float32]
    hips: NDArray[np.float32]
    contacts: NDArray[np.bool_]

    def part(self, first: int, n: int) -> "RecordedMotion":
        """So many frames of it from one on; fewer at its end."""
        own = slice(first, first + n)
        return RecordedMotion(
            self.motion_id, self.fps, self.angles[own], self.root[own], self.hips[own], self.contacts[own]
        )

    @property
    def seconds(self) -> float:
        """From the first to the last frame."""
        return (len(self.angles) - 1) / self.fps


def stretches_of(
    source: Source, poses: Retargeted, is_usable: NDArray[np.bool_], fps: float, name: str
) -> list[tuple[int, RecordedMotion]]:
    """The stretches of a recording that last long enough.

    Args:
        source: The recording.
        poses: Its poses.
        is_usable: (n,) whether a frame may be part of a motion; short gaps are bridged.
        fps: Frames a second.
        name: What their identifiers begin with.

    Returns:
        Row of the first frame of each, and the motion.
    """
    closed = ~_without_short(~is_usable, BRIDGED_SECONDS * fps, inside_only=True)
    contacts, floor = foot_contacts(source, 1.0 / fps)
    for side in range(2):
        for part in range(2):
            own = ~_without_short(~contacts[:, side, part], GAP_SECONDS * fps)
            contacts[:, side, part] = _without_short(own, GAP_SECONDS * fps)
    hips = 0.5 * (source.at("l_hip") + source.at("r_hip"))
    hips = (hips - (0.0, 0.0, floor)) / _leg(source)
    heading = heading_of(source.pelvis)
    root = _turned(poses.root, heading)
    # Where a frame is bridged, its pose is between those beside it; contacts there are none.
    angles = _bridged(poses.angles, is_usable)
    out = []
    for first, last in runs(closed):
        if (last - first - 1) / fps < LEAST_SECONDS:
            continue
        a, r, h = (values[first:last].astype(np.float32) for values in (angles, root, hips))
        out.append((first, RecordedMotion(f"{name}/{first:04d}", fps, a, r, h, contacts[first:last])))
    return out


def runs(values: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and one after the last of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], values, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _without_short(values: NDArray[np.bool_], least: float, inside_only: bool = False) -> NDArray[np.bool_]:
    """The same without true runs shorter than so many frames; runs at the ends are kept if asked."""
    out = values.copy()
    for first, last in runs(values):
        is_at_end = first == 0 or last == len(values)
        if last - first < least and not (inside_only and is_at_end):
            out[first:last] = False
    return out


def _leg(source: Source) -> float:
    """Length of the legs from the hip joint to the sole [m]: the bones, and the ankle as high as on our feet."""
    bones = [
        np.linalg.norm(source.at(f"{s}_{a}") - source.at(f"{s}_{b}"), axis=1)
        for s in SIDES
        for a, b in (("hip", "knee"), ("knee", "ankle"))
    ]
    return float(np.median(np.sum(bones, axis=0)) / 2.0) * (1.0 + ANKLE_SHARE)


def _turned(root: NDArray[np.float64], heading: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 3, 3) rotations turned left by (n,) headings [rad]."""
    c, s = np.cos(heading), np.sin(heading)
    turn = np.zeros((len(heading), 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = c
    turn[:, 0, 1], turn[:, 1, 0], turn[:, 2, 2] = -s, s, 1.0
    return turn @ root


def _bridged(values: NDArray[np.float64], is_known: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(n, m) values with those that are not known between their neighbours."""
    if is_known.all() or not is_known.any():
        return values
    at, known = np.arange(len(values)), np.flatnonzero(is_known)
    return np.stack([np.interp(at, known, column[known]) for column in values.T], axis=1)
