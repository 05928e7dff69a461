"""A pose while it is being made."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from synth.bodies.body import Body, Pose
from synth.bodies.poses.landmarks import Landmarks, landmarks_of
from synth.bodies.rig.collision import SEGMENT_IDX, excess_depth, excess_of_limb, fit_of
from synth.bodies.rig.ik import Goal, Solution, solve_limb
from synth.bodies.rig.skinning import lowest_before, pose_links, pose_skin
from synth.bodies.skeleton import DOF_IDX, LINK_IDX, LOWER, N_DOFS, UPPER
from synth.geometry import axis_angle


@dataclass
class Draft:
    """A pose while it is being made; angles are set in degrees and clipped to the limits.

    Attributes:
        body: Whose pose.
        angles: (n_dofs,) [rad].
        T_world_root: (4, 4).
    """

    body: Body
    angles: NDArray[np.float64] = field(default_factory=lambda: np.zeros(N_DOFS))
    T_world_root: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))

    @staticmethod
    def of(body: Body, pose: Pose) -> "Draft":
        """A draft that starts from a pose."""
        return Draft(body, pose.angles.copy(), pose.T_world_root.copy())

    @property
    def marks(self) -> Landmarks:
        """The body's landmarks."""
        return landmarks_of(self.body)

    def set(self, prefix: str = "", **degrees: float) -> None:
        """Sets hinges by name; the prefix "l_" or "r_" goes before each."""
        for name, value in degrees.items():
            i = DOF_IDX[prefix + name]
            self.angles[i] = min(max(np.radians(value), LOWER[i]), UPPER[i])

    def get(self, name: str) -> float:
        """A hinge's angle [degrees]."""
        return float(np.degrees(self.angles[DOF_IDX[name]]))

    def jitter(self, rng: np.random.Generator, sigma: float, names: tuple[str, ...]) -> None:
        """Adds normal noise to hinges [degrees], kept off the limits by being clipped."""
        index = [DOF_IDX[name] for name in names]
        noisy = self.angles[index] + np.radians(sigma) * rng.standard_normal(len(index))
        self.angles[index] = np.clip(noisy, LOWER[index], UPPER[index])

    def turn_root(self, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0) -> None:
        """Sets the root's rotation [degrees]: leaning right, leaning forward, turning left."""
        R = axis_angle((0, 0, 1), np.radians(yaw)) @ axis_angle((0, 1, 0), np.radians(pitch))
        self.T_world_root[:3, :3] = R @ axis_angle((1, 0, 0), np.radians(roll))

    def links(self) -> NDArray[np.float64]:
        """(n_links, 4, 4) T_world_link."""
        return pose_links(self.body, self.angles, self.T_world_root)

    def point(self, link: str, local: ArrayLike = (0.0, 0.0, 0.0)) -> NDArray[np.float64]:
        """World place of a point fixed to a link [m]."""
        T = self.links()[LINK_IDX[link]]
        return T[:3, :3] @ np.asarray(local, dtype=np.float64) + T[:3, 3]

    def skin(self, chosen: NDArray[np.int64]) -> NDArray[np.float32]:
        """(m, 3) chosen skin vertices, world [m]."""
        return pose_skin(self.body, self.angles, self.T_world_root, chosen)[1]

    def lowest(self, chosen: NDArray[np.int64], front: float = np.inf) -> float:
        """Height of the lowest of the chosen skin vertices whose x is below `front`, world [m]; +inf if none is."""
        return float(lowest_before(self.skin(chosen), front))

    def solve(self, limb: str, goals: list[Goal], rest_weight: float = 0.02) -> Solution:
        """Moves a limb to its goals, starting from and pulled to the angles it has."""
        solution = solve_limb(self.body.skeleton, limb, self.links(), self.angles, goals, rest_weight)
        self.angles = solution.angles
        return solution

    def excess(self) -> float:
        """Worst self-collision beyond what is allowed [m]; negative if none."""
        return excess_depth(self.body, self.pose("draft"))

    def excess_of(self, side: str, limb: str) -> float:
        """`excess` of the "arm" or "leg" of one side alone [m]."""
        return excess_of_limb(self.body, self.angles, self.T_world_root, f"{side}_{limb}")

    def surface(self, segment: str, link: str, height: float, turn: float) -> tuple[NDArray, NDArray]:
        """A point on the skin of a segment and the direction out of it.

        Args:
            segment: Name in `SEGMENTS`.
            link: The segment's frame, as a link name.
            height: Share of the segment's extent along its frame's z, 0 at its low end.
            turn: Direction about z, 0 = forward in the segment's frame, positive to the left [degrees].

        Returns:
            (3,) world point [m] and (3,) unit world direction, across the segment.
        """
        profiles = fit_of(self.body).profiles
        i = SEGMENT_IDX[segment]
        n_heights, n_directions = profiles.radius.shape[1:]
        h = min(max(height, 0.0), 1.0) * (n_heights - 1)
        lower = min(int(h), n_heights - 2)
        f = h - lower
        d = (turn / 360.0 * n_directions) % n_directions
        e = d - int(d)
        table = profiles.radius[i, lower : lower + 2]
        ring = (1 - f) * table[0] + f * table[1]
        radius = (1 - e) * ring[int(d) % n_directions] + e * ring[(int(d) + 1) % n_directions]
        centre = (1 - f) * profiles.centre[i, lower] + f * profiles.centre[i, lower + 1]
        z = profiles.low[i] + min(max(height, 0.0), 1.0) * (profiles.high[i] - profiles.low[i])
        out = np.array([np.cos(np.radians(turn)), np.sin(np.radians(turn)), 0.0])
        T = self.links()[LINK_IDX[link]]
        point = T[:3, :3] @ (np.array([centre[0], centre[1], z]) + radius * out) + T[:3, 3]
        return point, T[:3, :3] @ out

    def look(self, pitch: float, yaw: float) -> None:
        """Turns neck and head so that the face looks down by pitch and left by yaw in the world [degrees]."""
        T = self.links()[LINK_IDX["thorax_rotation"]]
        forward = T[:3, :3] @ np.array([1.0, 0.0, 0.0])
        trunk_pitch = -np.degrees(np.arcsin(min(max(forward[2], -1.0), 1.0)))
        bend = pitch - trunk_pitch
        trunk_yaw = np.degrees(np.arctan2(forward[1], forward[0])) if trunk_pitch < 60 else 0.0
        self.set(neck_flexion=0.6 * bend, head_flexion=0.4 * bend)
        self.set(neck_rotation=0.5 * (yaw - trunk_yaw), head_rotation=0.5 * (yaw - trunk_yaw))

    def pose(self, family: str) -> Pose:
        """The finished record."""
        return Pose(self.angles.copy(), self.T_world_root.copy(), family)
