"""Where frames of reference are at a time, out of the transforms of ROS."""

from bisect import bisect_right
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

LONGEST_GAP_NS = 500_000_000
"""A transform is believed for so long before and after the times at which it was told [ns]."""
LONGEST_CHAIN = 50


class _Edge(NamedTuple):
    parent: str
    is_static: bool
    stamps: list[int]
    poses: list[tuple[NDArray[np.float64], NDArray[np.float64]]]


class Transforms:
    """A tree of frames of reference; transforms may come in any order."""

    def __init__(self) -> None:
        self._edges: dict[str, _Edge] = {}

    def add(self, transforms: Iterable[Any], is_static: bool) -> None:
        """Takes the transforms of a message of /tf or /tf_static; those that are not finite are left out."""
        for one in transforms:
            stamp = int(one.header.stamp.sec) * 1_000_000_000 + int(getattr(one.header.stamp, "nanosec", 0))
            shift, turn = one.transform.translation, one.transform.rotation
            xyz, xyzw = np.array([shift.x, shift.y, shift.z]), np.array([turn.x, turn.y, turn.z, turn.w])
            if not (np.isfinite(xyz).all() and np.isfinite(xyzw).all() and np.linalg.norm(xyzw) > 1e-6):
                continue
            child, parent = one.child_frame_id.lstrip("/"), one.header.frame_id.lstrip("/")
            edge = self._edges.get(child)
            if edge is None or edge.parent != parent:
                edge = self._edges[child] = _Edge(parent, is_static, [], [])
            at = bisect_right(edge.stamps, stamp)
            edge.stamps.insert(at, stamp)
            edge.poses.insert(at, (xyz, xyzw))

    def root(self, frame_id: str) -> str:
        """Name of the root of a frame's tree; "world" where no transform is known."""
        name = frame_id.lstrip("/")
        if name not in self._edges:
            return "world"
        for _ in range(LONGEST_CHAIN):
            if name not in self._edges:
                break
            name = self._edges[name].parent
        return name

    def forget(self, before: int) -> None:
        """Forgets what was told of times before one [ns], but the last of each frame of reference."""
        for edge in self._edges.values():
            n = min(bisect_right(edge.stamps, before), len(edge.stamps) - 1)
            del edge.stamps[:n], edge.poses[:n]

    def pose(self, frame_id: str, stamp: int) -> NDArray[np.float64] | None:
        """(4, 4) a frame of reference in the root of its tree at a time; None = not known, or it is the root.

        Args:
            frame_id: Its name.
            stamp: When [ns].
        """
        name, out = frame_id.lstrip("/"), np.eye(4)
        if name not in self._edges:
            return None
        for _ in range(LONGEST_CHAIN):
            if name not in self._edges:
                return out
            step = _at(self._edges[name], stamp)
            if step is None:
                return None
            out, name = step @ out, self._edges[name].parent
        return None


def _at(edge: _Edge, stamp: int) -> NDArray[np.float64] | None:
    """The transform at a time, between the two told before and after it."""
    after = bisect_right(edge.stamps, stamp)
    before = after - 1
    if edge.is_static:
        return matrix_of(*edge.poses[-1])
    if before < 0 or after == len(edge.stamps):
        nearest = min(max(before, 0), len(edge.stamps) - 1)
        return matrix_of(*edge.poses[nearest]) if abs(edge.stamps[nearest] - stamp) <= LONGEST_GAP_NS else None
    begin, end = edge.stamps[before], edge.stamps[after]
    if end - begin > 2 * LONGEST_GAP_NS:
        return None
    share = (stamp - begin) / (end - begin)
    (xyz, xyzw), (xyz_after, xyzw_after) = edge.poses[before], edge.poses[after]
    turn = Slerp([0.0, 1.0], Rotation.from_quat([xyzw, xyzw_after]))(share)
    return matrix_of((1 - share) * xyz + share * xyz_after, turn.as_quat())


def matrix_of(xyz: NDArray[np.float64], xyzw: NDArray[np.float64]) -> NDArray[np.float64]:
    """(4, 4) a pose of a place (3,) and a quaternion (4,), x first."""
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = Rotation.from_quat(xyzw).as_matrix(), xyz
    return out
