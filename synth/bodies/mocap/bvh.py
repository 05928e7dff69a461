"""Reads BVH files: a joint tree with rest offsets and, frame by frame, its channels."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

END = "_end"
"""An end site is a joint named after its parent with this ending, without channels."""
_CHANNELS = tuple(f"{axis}{kind}" for kind in ("position", "rotation") for axis in "XYZ")
_MAX_JOINTS = 1000


class MocapError(ValueError):
    """Motion capture that cannot be used; the message says what is wrong with it."""


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
    """

    joints: tuple[BvhJoint, ...]
    frame_time: float
    values: NDArray[np.float64]

    def index(self, name: str) -> int:
        """Index of a joint by its name."""
        return next(i for i, joint in enumerate(self.joints) if joint.name == name)


@dataclass
class _Tree:
    joints: list[BvhJoint] = field(default_factory=list)
    open_joints: list[int] = field(default_factory=list)


def parse_bvh(text: str) -> Bvh:
    """Reads the text of a BVH file.

    Args:
        text: The whole file.

    Raises:
        MocapError: It is no BVH file, has no frames, the wrong number of values or values that are no numbers.
    """
    head, found, tail = text.partition("MOTION")
    words = iter(head.split())
    if next(words, "") != "HIERARCHY" or not found:
        raise MocapError("is no BVH file: it must begin with HIERARCHY and have a MOTION part")
    joints = _parse_tree(words)
    lines = [line for line in tail.splitlines() if line.strip()]
    n_frames = int(_number_after("Frames:", lines, 0))
    frame_time = _number_after("Frame Time:", lines, 1)
    if n_frames < 1 or not 0.0 < frame_time < 10.0:
        raise MocapError(f"has {n_frames} frames of {frame_time} s; needs at least 1 frame and a time above 0")
    n_channels = sum(len(joint.channels) for joint in joints)
    return Bvh(joints, frame_time, _parse_values(lines[2:], n_frames, n_channels))


def _parse_tree(words: Iterator[str]) -> tuple[BvhJoint, ...]:
    tree = _Tree()
    for word in words:
        if word in ("ROOT", "JOINT", "End"):
            _open_joint(tree, word, next(words, ""), next(words, ""))
        elif word == "OFFSET" and tree.open_joints:
            x, y, z = (_number(next(words, "")) for _ in range(3))
            _change(tree, offset=(x, y, z))
        elif word == "CHANNELS" and tree.open_joints:
            names = tuple(next(words, "") for _ in range(int(_number(next(words, "")))))
            unknown = [name for name in names if name not in _CHANNELS]
            if unknown:
                raise MocapError(f"has unknown channels {unknown}; known are {', '.join(_CHANNELS)}")
            _change(tree, channels=names)
        elif word == "}" and tree.open_joints:
            tree.open_joints.pop()
        else:
            raise MocapError(f"has {word!r} where ROOT, JOINT, End Site, OFFSET, CHANNELS or }} is expected")
    if tree.open_joints or not tree.joints:
        raise MocapError("has a HIERARCHY that does not end, or without joints")
    every = [joint.name for joint in tree.joints]
    twice = sorted({name for name in every if every.count(name) > 1 and not name.endswith(END)})
    if twice:
        raise MocapError(f"names several joints alike: {', '.join(twice)}")
    return tuple(tree.joints)


def _open_joint(tree: _Tree, word: str, name: str, brace: str) -> None:
    parent = tree.open_joints[-1] if tree.open_joints else -1
    if brace != "{" or (word == "ROOT") != (parent < 0) or len(tree.joints) >= _MAX_JOINTS:
        raise MocapError(f"has a HIERARCHY that breaks off at {word} {name}")
    if parent < 0 and tree.joints:
        raise MocapError(f"has a second root {name!r}; one is allowed")
    full = tree.joints[parent].name + END if word == "End" else name
    tree.open_joints.append(len(tree.joints))
    tree.joints.append(BvhJoint(full, parent, (0.0, 0.0, 0.0)))


def _change(
    tree: _Tree, offset: tuple[float, float, float] | None = None, channels: tuple[str, ...] | None = None
) -> None:
    place = tree.open_joints[-1]
    old = tree.joints[place]
    tree.joints[place] = BvhJoint(
        old.name,
        old.parent,
        old.offset if offset is None else offset,
        old.channels if channels is None else channels,
    )


def _number(word: str) -> float:
    try:
        value = float(word)
    except ValueError:
        raise MocapError(f"has {word!r} where a number is expected") from None
    if not np.isfinite(value):
        raise MocapError(f"has {word!r} where a finite number is expected")
    return value


def _number_after(label: str, lines: list[str], place: int) -> float:
    line = lines[place].strip() if place < len(lines) else ""
    if not line.startswith(label):
        raise MocapError(f"has {line[:40]!r} where {label!r} is expected")
    return _number(line.removeprefix(label).strip())


def _parse_values(lines: list[str], n_frames: int, n_channels: int) -> NDArray[np.float64]:
    """(n_frames, n_channels); every frame is a line."""
    if len(lines) != n_frames:
        raise MocapError(f"has {len(lines)} lines of values, but says Frames: {n_frames}")
    out = np.empty((n_frames, n_channels))
    for k, line in enumerate(lines):
        words = line.split()
        if len(words) != n_channels:
            raise MocapError(f"frame {k} has {len(words)} values; the channels of the hierarchy are {n_channels}")
        try:
            out[k] = words
        except ValueError:
            raise MocapError(f"frame {k} holds a value that is no number") from None
    wrong = np.flatnonzero(~np.isfinite(out).all(axis=1))
    if len(wrong):
        raise MocapError(f"frame {wrong[0]} holds NaN or infinity")
    return out


def rest_values(bvh: Bvh) -> NDArray[np.float64]:
    """(1, n_channels) the rest pose as channels: no turns, every joint at its offset."""
    row = [
        joint.offset["XYZ".index(name[0])] if name.endswith("position") else 0.0
        for joint in bvh.joints
        for name in joint.channels
    ]
    return np.array([row])


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
    column = 0
    for j, joint in enumerate(bvh.joints):
        local = np.broadcast_to(np.asarray(joint.offset), (n, 3)).copy()
        turn = np.broadcast_to(np.eye(3), (n, 3, 3)).copy()
        for name in joint.channels:
            axis = "XYZ".index(name[0])
            if name.endswith("position"):
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
