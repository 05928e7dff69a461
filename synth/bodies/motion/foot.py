"""How a foot rolls over the floor: about the heel when its toes are up, about the toes' hinge when its heel is.

A foot's footing is the place below its ankle, and its heading, as if it stood flat there. Pitch turns it from there:
positive with the heel up, when the toes stay flat where they are; negative with the toes up.
"""

import weakref
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from synth.bodies.body import Body
from synth.bodies.motion.curves import Array
from synth.bodies.poses.draft import Draft
from synth.bodies.poses.landmarks import landmarks_of
from synth.bodies.skeleton import DOF_IDX, LINK_IDX, UPPER

HEEL_BAND = 0.012
"""Skin this near the lowest of a flat foot is the sole [m]."""
PITCHES = np.radians(np.arange(-45.0, 81.0, 5.0))
"""Pitches at which it is measured how far a foot's skin would be below the floor [rad]."""
TOES_LIMIT = float(UPPER[DOF_IDX["l_toes_extension"]])


@dataclass(frozen=True)
class FootShape:
    """What of a foot meets the floor, in its footing's frame: x ahead, z up, below the ankle the origin [m].

    Attributes:
        ankle: Height of the ankle joint above the sole.
        heel: x of the heel's rear end.
        ball: x of the toes' hinge.
        ball_height: Its height above the sole.
        lift: (len(PITCHES),) how far the foot must be lifted at each pitch, toes flat, so that no skin is below the
            floor.
    """

    ankle: float
    heel: float
    ball: float
    ball_height: float
    lift: Array

    def lift_at(self, pitch: Array) -> Array:
        """How far a foot that rolls must be lifted at pitches [m]."""
        return np.asarray(np.interp(pitch, PITCHES, self.lift))

    def placed(self, footing: Array, pitch: Array, height: Array) -> Array:
        """Where a foot is.

        Args:
            footing: (n, 3) x and y [m] and heading [rad], world.
            pitch: (n,) [rad].
            height: (n,) how high it is lifted off the floor [m].

        Returns:
            (n, 4, 4) of the link behind the ankle, world.
        """
        c, s = np.cos(pitch), np.sin(pitch)
        pivot_x = np.where(pitch > 0.0, self.ball, self.heel)
        pivot_z = np.where(pitch > 0.0, self.ball_height, 0.0)
        x, z = -pivot_x, self.ankle - pivot_z
        along = pivot_x + c * x + s * z
        up = pivot_z - s * x + c * z + height
        cos, sin = np.cos(footing[:, 2]), np.sin(footing[:, 2])
        T = np.zeros((len(footing), 4, 4))
        T[:, 0] = np.stack([cos * c, -sin, cos * s, footing[:, 0] + cos * along], axis=1)
        T[:, 1] = np.stack([sin * c, cos, sin * s, footing[:, 1] + sin * along], axis=1)
        T[:, 2, 0], T[:, 2, 2], T[:, 2, 3], T[:, 3, 3] = -s, c, up, 1.0
        return T


_SHAPES: dict[int, dict[str, FootShape]] = {}


def foot_shapes(body: Body) -> dict[str, FootShape]:
    """Both feet of a body, measured at the first call and kept as long as the body lives."""
    key = id(body)
    if key not in _SHAPES:
        _SHAPES[key] = {side: _measured(body, side) for side in "lr"}
        weakref.finalize(body, _SHAPES.pop, key, None)
    return _SHAPES[key]


def _measured(body: Body, side: str) -> FootShape:
    marks = landmarks_of(body).side[side]
    draft = Draft(body)
    ankle = draft.point(f"{side}_ankle_inversion")
    skin = draft.skin(marks.foot).astype(np.float64) - ankle
    low = float(skin[:, 2].min())
    sole = skin[skin[:, 2] < low + HEEL_BAND]
    ball = draft.point(f"{side}_toes_extension") - ankle
    flat = FootShape(-low, float(sole[:, 0].min()), float(ball[0]), float(ball[2] - low), np.zeros(len(PITCHES)))
    placed = flat.placed(np.zeros((len(PITCHES), 3)), PITCHES, np.zeros(len(PITCHES)))
    lift = np.array([-_lowest(body, side, T, p) for T, p in zip(placed, PITCHES, strict=True)])
    return FootShape(flat.ankle, flat.heel, flat.ball, flat.ball_height, np.maximum(lift, 0.0))


def _lowest(body: Body, side: str, T_world_foot: NDArray[np.float64], pitch: float) -> float:
    """Height of the lowest skin of a foot that is placed somewhere, its toes flat where its heel is up [m]."""
    draft = Draft(body)
    draft.angles[DOF_IDX[f"{side}_toes_extension"]] = min(max(pitch, 0.0), TOES_LIMIT)
    T_root_foot = draft.links()[LINK_IDX[f"{side}_ankle_inversion"]]
    draft.T_world_root = T_world_foot @ np.linalg.inv(T_root_foot)
    return draft.lowest(landmarks_of(body).side[side].foot)
