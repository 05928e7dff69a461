"""Objects with joints: parts as links of a tree, posed by their joints' values."""

from dataclasses import dataclass

import numpy as np

from synth.geometry import rotation_about, translation
from synth.occluders.kit.parts import Array, Part


@dataclass(frozen=True)
class Joint:
    """Connects a link to its parent, as a URDF joint does.

    Attributes:
        name: Joint's name.
        kind: "revolute", "continuous", "prismatic" or "fixed".
        parent: Name of the parent link.
        child: Name of the child link.
        origin: (3,) the child's origin in the parent's frame at value 0 [m].
        axis: (3,) unit axis, parent's frame.
        lower: Least value [rad or m].
        upper: Greatest value [rad or m].
        value: The value the spec asks for [rad or m].
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: tuple[float, float, float]
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    lower: float = 0.0
    upper: float = 0.0
    value: float = 0.0

    def motion(self) -> Array:
        """T_parent_child (4, 4) at the joint's value."""
        T = translation(*self.origin)
        if self.kind in ("revolute", "continuous"):
            return T @ rotation_about(self.axis, self.value)
        if self.kind == "prismatic":
            T[:3, 3] += self.value * np.asarray(self.axis)
        return T


@dataclass(frozen=True)
class Linkage:
    """An articulated object.

    Attributes:
        name: Robot name for URDF.
        links: Name and part of each link, in the link's own frame; the first is the root, in the object's frame.
        joints: In an order in which parents come before children.
    """

    name: str
    links: tuple[tuple[str, Part], ...]
    joints: tuple[Joint, ...]

    def link_poses(self) -> dict[str, Array]:
        """T_object_link of every link at the joints' values."""
        poses = {self.links[0][0]: np.eye(4)}
        for joint in self.joints:
            poses[joint.child] = poses[joint.parent] @ joint.motion()
        return poses

    def posed(self) -> list[Part]:
        """All links' parts in the object's frame."""
        poses = self.link_poses()
        return [part.moved(poses[name]) for name, part in self.links]
