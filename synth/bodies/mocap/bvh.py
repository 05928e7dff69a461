"""Reads BVH files: a joint tree with rest offsets and, frame by frame, its channels."""

import itertools
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from synth.bodies.mocap.text import Line, MocapError, lines_of, number_after, number_of, read_frames, with_points

END = "_end"
"""An end site is a joint named after its parent with this ending, without channels."""
_CHANNELS = tuple(f"{axis}{kind}" for kind in ("position", "rotation") for axis in "XYZ")
_CHANNEL_OF = {name.lower(): name for name in _CHANNELS}
_MOTION = re.compile(r"^[ \t]*MOTION[ \t]*$", re.IGNORECASE | re.MULTILINE)
_MAX_JOINTS = 1000
_MAX_NAME = 120
_MAX_CHANNELS = 6
_MAX_HIERARCHY = 4_000_000
"""Characters of the HIERARCHY part; 1000 joints are far shorter."""


@dataclass(frozen=True)
class BvhJoint:
    """One joint of the tree.

    Attributes:
        name: As in the file; an end site has its parent's name and `END`.
        parent: Index of the parent joint, -1 for the root; parents come before children.
        offset: (3,) from the parent at rest [file's unit].
        channels: Names of its channels in the order of the file, such as "Zrotation".
    """

    name: str
    parent: int
    offset: tuple[float, float, float]
    channels: tuple[str, ...] = ()


@dataclass(frozen=True)
class Bvh:
    """A file's contents.

    Attributes:
        joints: The tree.
        frame_time: [s].
        values: (n_frames, n_channels) float64, angles in degrees.
        n_promised: Frames that the file says it has; more than it has if it was cut, fewer if it counts wrong.
        frame: (n_frames,) number of each in the file; those that hold NaN or infinity are missing.
        n_broken: How many are missing so.
        n_left_over: Lines after the last whole frame that were not read.
    """

    joints: tuple[BvhJoint, ...]
    frame_time: float
    values: NDArray[np.float64]
    n_promised: int
    frame: NDArray[np.int64]
    n_broken: int = 0
    n_left_over: int = 0

    def index(self, name: str) -> int:
        """Index of a joint by its name."""
        return next(i for i, joint in enumerate(self.joints) if joint.name == name)


def parse_bvh(text: str) -> Bvh:
    """Reads the text of a BVH file; one that was cut has the frames that are whole, without those that hold NaN.

    Args:
        text: The whole file.

    Raises:
        MocapError: It is no BVH file, has no frames, the wrong number of values or values that are no numbers.
    """
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    motion = _MOTION.search(text)
    head, tail = (text[: motion.start()], text[motion.end() :]) if motion else ("", "")
    if len(head) > _MAX_HIERARCHY:
        raise MocapError(f"has a HIERARCHY of {len(head)} characters; at most {_MAX_HIERARCHY} are read")
    joints = _HierarchyReader(lines_of(head)).read()
    first = text.count("\n", 0, len(text) - len(tail)) + 1
    lines = lines_of(with_points(tail, first), first)
    n_promised = int(number_after("Frames", lines))
    frame_time = number_after("Frame Time", lines)
    if n_promised < 1 or not 0.0 < frame_time < 10.0:
        raise MocapError(f"has {n_promised} frames of {frame_time} s; needs at least 1 frame and a time above 0")
    values, n_left_over = read_frames(lines, n_promised, sum(len(joint.channels) for joint in joints))
    good = np.flatnonzero(np.isfinite(values).all(axis=1))
    if not len(good):
        raise MocapError("has no frame without NaN or infinity")
    return Bvh(joints, frame_time, values[good], n_promised, good, len(values) - len(good), n_left_over)


class _HierarchyReader:
    """Reads the joint tree from the lines of a file's HIERARCHY part."""

    def __init__(self, lines: Iterator[Line]) -> None:
        self._words = self._words_of(lines)
        self._number = 1
        self._joints: list[BvhJoint] = []
        self._open: list[int] = []

    def read(self) -> tuple[BvhJoint, ...]:
        """The joints, parents before children."""
        if next(self._words, "").upper() != "HIERARCHY":
            raise MocapError("is not a BVH file: it must begin with HIERARCHY and have a MOTION part")
        try:
            return self._read_joints()
        except MocapError as error:
            raise MocapError(f"line {self._number}: {error}") from None

    def _words_of(self, lines: Iterator[Line]) -> Iterator[str]:
        for self._number, text in lines:
            for word in text.split():
                # Bytes of other encodings look like braces within names.
                if len(word) > 1 and word[-1] in "{}" and word.isascii():
                    yield word[:-1]
                    yield word[-1]
                else:
                    yield word

    def _read_joints(self) -> tuple[BvhJoint, ...]:
        begin: dict[str, Callable[[str], None]] = dict.fromkeys(("ROOT", "JOINT", "END"), self._begin_joint)
        within = {"OFFSET": self._read_offset, "CHANNELS": self._read_channels, "}": self._end_joint}
        for word in self._words:
            keyword = word.upper()
            read_on = (begin | within if self._open else begin).get(keyword)
            if read_on is None:
                raise MocapError(f"has {word!r} where ROOT, JOINT, End Site, OFFSET, CHANNELS or }} is expected")
            read_on(keyword)
        if self._open or not self._joints:
            raise MocapError("has a HIERARCHY without an end or without joints")
        return _without_twins(self._joints)

    def _begin_joint(self, keyword: str) -> None:
        name = " ".join(itertools.takewhile(lambda part: part != "{", self._words))
        parent = self._open[-1] if self._open else -1
        is_name = 0 < len(name) <= _MAX_NAME and "}" not in name.split()
        if not is_name or (keyword == "ROOT") != (parent < 0) or len(self._joints) >= _MAX_JOINTS:
            raise MocapError(f"has a HIERARCHY that breaks off at {keyword} {name[:_MAX_NAME]}")
        if parent < 0 and self._joints:
            raise MocapError(f"has a second root {name!r}; one is allowed")
        full = self._joints[parent].name + END if keyword == "END" else name
        self._open.append(len(self._joints))
        self._joints.append(BvhJoint(full, parent, (0.0, 0.0, 0.0)))

    def _read_offset(self, keyword: str) -> None:
        x, y, z = (number_of(next(self._words, "")) for _ in range(3))
        self._joints[self._open[-1]] = replace(self._joints[self._open[-1]], offset=(x, y, z))

    def _read_channels(self, keyword: str) -> None:
        n = number_of(next(self._words, ""))
        if n not in range(_MAX_CHANNELS + 1):
            name = self._joints[self._open[-1]].name
            raise MocapError(f"promises {n:g} channels for {name!r}; a joint has 0 to {_MAX_CHANNELS}")
        given = [next(self._words, "") for _ in range(int(n))]
        unknown = [name for name in given if name.lower() not in _CHANNEL_OF]
        if unknown:
            raise MocapError(f"has unknown channels {unknown}; known are {', '.join(_CHANNELS)}")
        channels = tuple(_CHANNEL_OF[name.lower()] for name in given)
        self._joints[self._open[-1]] = replace(self._joints[self._open[-1]], channels=channels)

    def _end_joint(self, keyword: str) -> None:
        self._open.pop()


def _without_twins(joints: list[BvhJoint]) -> tuple[BvhJoint, ...]:
    """The joints, if no two have one name."""
    every = [joint.name for joint in joints]
    twice = sorted({name for name in every if every.count(name) > 1 and not name.endswith(END)})
    if twice:
        raise MocapError(f"gives several joints the same name: {', '.join(twice)}")
    return tuple(joints)


def rest_values(bvh: Bvh) -> NDArray[np.float64]:
    """(1, n_channels) the rest pose as channels: no turns, every joint at its offset."""
    row = [
        joint.offset["XYZ".index(name[0])] if name.endswith("position") else 0.0
        for joint in bvh.joints
        for name in joint.channels
    ]
    return np.array([row])


def _has_places(bvh: Bvh) -> NDArray[np.bool_]:
    """(n_joints,) whether position channels place a joint; some programs write zeros and mean the offset."""
    out = np.zeros(len(bvh.joints), np.bool_)
    column = 0
    for j, joint in enumerate(bvh.joints):
        moved = [column + k for k, name in enumerate(joint.channels) if name.endswith("position")]
        out[j] = joint.parent < 0 or bool(np.any(bvh.values[:, moved]))
        column += len(joint.channels)
    return out


def place_joints(bvh: Bvh, values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where the joints are.

    Args:
        bvh: The tree.
        values: (n, n_channels) channels, in the order of the file.

    Returns:
        (n, n_joints, 3) positions [file's unit] and (n, n_joints, 3, 3) rotations, the file's own axes.
    """
    n, n_joints = len(values), len(bvh.joints)
    position = np.empty((n, n_joints, 3))
    rotation = np.empty((n, n_joints, 3, 3))
    has_place = _has_places(bvh)
    column = 0
    for j, joint in enumerate(bvh.joints):
        local = np.broadcast_to(np.asarray(joint.offset), (n, 3)).copy()
        turn = np.broadcast_to(np.eye(3), (n, 3, 3)).copy()
        for name in joint.channels:
            axis = "XYZ".index(name[0])
            if name.endswith("position"):
                if has_place[j]:
                    local[:, axis] = values[:, column]  # absolute: it takes the place of the offset
            else:
                turn = turn @ _turns(axis, np.radians(values[:, column]))
            column += 1
        if joint.parent < 0:
            position[:, j], rotation[:, j] = local, turn
        else:
            parent = rotation[:, joint.parent]
            position[:, j] = position[:, joint.parent] + np.einsum("nab,nb->na", parent, local)
            rotation[:, j] = parent @ turn
    return position, rotation


def _turns(axis: int, angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 3, 3) rotations about a coordinate axis."""
    out = np.zeros((len(angles), 3, 3))
    a, b = (axis + 1) % 3, (axis + 2) % 3
    out[:, axis, axis] = 1.0
    out[:, a, a] = out[:, b, b] = np.cos(angles)
    out[:, b, a] = np.sin(angles)
    out[:, a, b] = -out[:, b, a]
    return out
