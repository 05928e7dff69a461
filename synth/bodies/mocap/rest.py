"""Which pose turns are counted from, which way is up, and how large the unit is."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from synth.bodies.mocap.text import MocapError

SIDES = "lr"
"""Order of the sides in arrays of limbs."""
LEG_LENGTH = 0.835
"""Hip to ankle of an adult of 1.70 m, by which units are found out [m]."""
LIMBS = (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))
"""Joints at the ends of upper arm, forearm, thigh and shank."""
UNITS: dict[str, float] = {"m": 1.0, "5.64 cm": 0.0254 / 0.45, "inch": 0.0254, "cm": 0.01, "mm": 0.001}
"""Usual units of BVH files [m]; 5.64 cm is the CMU database's own (an inch over 0.45)."""
UNIT_SLACK = 0.25
"""A leg in a usual unit may be off `LEG_LENGTH` by this share; else the unit is what gives that length."""
ARM_SLACK = np.radians(25.0)
"""Upper arms and forearms of a T-pose point this straight to the sides."""
LEG_SLACK = np.radians(12.0)
"""Thighs and shanks of a T-pose are this upright."""
BENT = np.radians(10.0)
"""Elbows and knees of a T-pose bend less than this."""
TRUNK_SLACK = np.radians(20.0)
"""The way from hips to neck is this upright in a T-pose."""
EXACT = np.radians(3.0)
"""No limb of a T-pose that somebody drew is farther off than this."""
ASKEW = np.radians(15.0)
"""Someone whose hips are turned less than this from an axis of the file faces along an axis."""
STRAIGHT_TRUNK = np.radians(30.0)
"""The parts of a straight spine and neck are this upright."""
LEVEL = 0.3
"""Lowest joints of who stands are this near to 0, if the floor is at 0 [leg lengths]."""
CLEAR = 0.5
"""A direction is clearly more up than another if it scores more by this."""


class Rest(NamedTuple):
    """A T-pose.

    Attributes:
        row: 0 if it is the first frame, -1 if it is the pose without turns.
        axes: (3, 3) rows: the person's forward, left and up in it, in the file's axes.
        world: (3, 3) rows: forward, left and up of the world, in the file's axes; mostly `axes`.
    """

    row: int
    axes: NDArray[np.float64]
    world: NDArray[np.float64]


def find_rest(position: NDArray[np.float64], place: dict[str, int], drawn: NDArray[np.float64]) -> Rest | None:
    """The pose that turns are counted from, None if there is no T-pose.

    It is the first frame if it is a T-pose of someone upright, unless only the pose without turns is an exact
    T-pose; else the pose without turns if it is nearly a T-pose.

    Args:
        position: (n + 1, n_roles, 3) joints in the file's axes; last without turns.
        place: Column by role.
        drawn: (2, 2) by side, bends of elbow and knee that mean straight limbs [rad].
    """
    scores, levels = _upright(position[:-1], place)
    up = int(np.argmax(scores))
    own = _t_pose_axes(position[-1], place, drawn)
    if own is not None:
        axis = _axis_number(own[2])
        # Who only lies looks upright along some axis; then the floor is not at 0 along it.
        if abs(levels[up]) > LEVEL or scores[up] - scores[axis] < CLEAR:
            up = axis
    first = _t_pose_axes(position[0], place, drawn)
    is_better = _is_exact(position[0], first, place) or not _is_exact(position[-1], own, place)
    if first is not None and _axis_number(first[2]) == up and is_better:
        return Rest(0, first, first)
    if own is not None:
        return Rest(-1, own, own if axis == up else _level_axes(up))
    return None


def bends_of(position: NDArray[np.float64], place: dict[str, int]) -> NDArray[np.float64]:
    """(n, 2, 2) by side, bends of elbow and knee [rad].

    Args:
        position: (n, n_roles, 3) joints.
        place: Column by role.
    """
    ways = _segments(position, place)
    return angles_between(ways[:, :, (0, 2)], ways[:, :, (1, 3)])


def angles_between(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles between directions of any length, along the last axis [rad]; a right one where one has no length.

    Args:
        a: (..., 3).
        b: (..., 3).
    """
    length = np.linalg.norm(a, axis=-1) * np.linalg.norm(b, axis=-1)
    return np.arccos(np.clip((a * b).sum(axis=-1) / np.maximum(length, 1e-12), -1.0, 1.0))


def find_world(position: NDArray[np.float64], place: dict[str, int]) -> NDArray[np.float64]:
    """(3, 3) rows: forward, left and up, in the file's axes, as the motion tells without any rest pose.

    Args:
        position: (n, n_roles, 3) joints in the file's axes.
        place: Column by role.

    Raises:
        MocapError: Nobody is upright along any axis.
    """
    scores, _ = _upright(position, place)
    up = int(np.argmax(scores))
    if scores[up] <= 0.0:
        raise MocapError("has no T-pose, and too few frames with an upright person to find which way is up")
    return _level_axes(up)


def straight_trunk(pose: NDArray[np.float64], place: dict[str, int]) -> NDArray[np.float64] | None:
    """(3, 3) rows: forward, left and up of a trunk, in the file's axes, if it is straight and not twisted.

    Args:
        pose: (n_roles, 3) joints.
        place: Column by role.
    """
    axes = _axes(pose, place)
    if axes is None:
        return None
    hips = 0.5 * (pose[place["l_hip"]] + pose[place["r_hip"]])
    thorax, neck, head = (pose[place[role]] for role in ("thorax", "neck", "head"))
    spine = [(way, axes[2], STRAIGHT_TRUNK) for way in (thorax - hips, neck - thorax, head - neck)]
    sides = [(pose[place[f"l_{role}"]] - pose[place[f"r_{role}"]], axes[1], ASKEW) for role in ("hip", "shoulder")]
    is_straight = all(way @ axis > np.cos(slack) * np.linalg.norm(way) for way, axis, slack in spine + sides)
    return axes if is_straight else None


def _upright(
    position: NDArray[np.float64], place: dict[str, int]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(6,) how much +x, +y, +z, -x, -y, -z look like up, and the floor's level along each [leg lengths].

    Heads are up from hips and hips from feet in most frames, and the lowest joint stays at one level.
    """
    hips = 0.5 * (position[:, place["l_hip"]] + position[:, place["r_hip"]])
    ankles = 0.5 * (position[:, place["l_ankle"]] + position[:, place["r_ankle"]])
    ways = np.stack([position[:, place["head"]] - hips, hips - ankles])
    ways /= np.maximum(np.linalg.norm(ways, axis=2, keepdims=True), 1e-12)
    mean = ways.mean(axis=(0, 1))
    leg = _leg_length(position[0], place)
    lowest = np.concatenate([position.min(axis=1), -position.max(axis=1)], axis=1) / leg
    low, high = np.percentile(lowest, (2.0, 98.0), axis=0)
    return np.concatenate([mean, -mean]) - np.minimum(high - low, 1.0), low


def _axis_number(up: NDArray[np.float64]) -> int:
    return int(np.argmax(np.concatenate([up, -up])))


def _level_axes(up: int) -> NDArray[np.float64]:
    axis = np.zeros(3)
    axis[up % 3] = 1.0 if up < 3 else -1.0
    forward = np.zeros(3)
    forward[(up + 1) % 3] = 1.0
    return np.stack([forward, np.cross(axis, forward), axis])


def _t_pose_axes(
    pose: NDArray[np.float64], place: dict[str, int], drawn: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """The axes of a pose if it is a T-pose."""
    axes = _axes(pose, place)
    return axes if axes is not None and is_t_pose((pose @ axes.T)[None], place, drawn)[0] else None


def _is_exact(pose: NDArray[np.float64], axes: NDArray[np.float64] | None, place: dict[str, int]) -> bool:
    """Whether a T-pose has its limbs along the axes."""
    if axes is None:
        return False
    turned = (pose @ axes.T)[None]
    return bool(_off_axes(turned, place).max() < EXACT and bends_of(turned, place).max() < EXACT)


def _segments(position: NDArray[np.float64], place: dict[str, int]) -> NDArray[np.float64]:
    """(n, 2, 4, 3) by side: ways along upper arm, forearm, thigh and shank."""
    return np.stack(
        [
            np.stack(
                [position[:, place[f"{s}_{end}"]] - position[:, place[f"{s}_{start}"]] for start, end in LIMBS], 1
            )
            for s in SIDES
        ],
        axis=1,
    )


def _off_axes(position: NDArray[np.float64], place: dict[str, int]) -> NDArray[np.float64]:
    """(n, 2, 4) by side: how far arms are off the side, and legs off straight down, z up, in any heading [rad]."""
    across = position[:, place["l_hip"]] - position[:, place["r_hip"]]
    across[:, 2] = 0.0
    down = np.broadcast_to([0.0, 0.0, -1.0], across.shape)
    ways = _segments(position, place)
    wanted = np.stack([np.stack([sign * across] * 2 + [down] * 2, axis=1) for sign in (1.0, -1.0)], axis=1)
    return angles_between(ways, wanted)


def _axes(rest: NDArray[np.float64], place: dict[str, int]) -> NDArray[np.float64] | None:
    """(3, 3) rows: the person's forward, left and up at rest, in the file's axes; None if joints coincide.

    Up is an axis of the file; so is left, unless the person stands askew.
    """
    hips = 0.5 * (rest[place["l_hip"]] + rest[place["r_hip"]])
    spine = rest[place["head"]] - hips
    up = np.zeros(3)
    longest = int(np.argmax(np.abs(spine)))
    up[longest] = np.sign(spine[longest])
    across = rest[place["l_hip"]] - rest[place["r_hip"]]
    across[longest] = 0.0
    if not up.any() or not across.any():
        return None
    left = across / np.linalg.norm(across)
    if np.abs(left).max() > np.cos(ASKEW):
        left = np.sign(left) * (np.abs(left) == np.abs(left).max())
    return np.stack([np.cross(left, up), left, up])


def _leg_length(pose: NDArray[np.float64], place: dict[str, int]) -> float:
    """Hip to ankle, mean of both sides [file's unit]."""
    leg = 0.0
    for start, end in (("hip", "knee"), ("knee", "ankle")):
        leg += float(
            np.mean([np.linalg.norm(pose[place[f"{s}_{end}"]] - pose[place[f"{s}_{start}"]]) for s in SIDES])
        )
    if leg <= 0.0:
        raise MocapError("has legs of length 0")
    return leg


def unit_of(pose: NDArray[np.float64], place: dict[str, int]) -> float:
    """Size of the file's unit [m], from the length of the legs.

    Args:
        pose: (n_roles, 3) joints.
        place: Column by role.

    Raises:
        MocapError: The legs have no length.
    """
    wanted = LEG_LENGTH / _leg_length(pose, place)
    nearest = min(UNITS.values(), key=lambda unit: abs(np.log(unit / wanted)))
    return nearest if abs(nearest / wanted - 1.0) < UNIT_SLACK else wanted


def is_t_pose(
    position: NDArray[np.float64], place: dict[str, int], drawn: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """(n,) whether arms point to the sides and legs down, none of them bent, in any heading.

    Args:
        position: (n, n_roles, 3) joints, z up.
        place: Column by role.
        drawn: (2, 2) by side, bends of elbow and knee that mean straight limbs [rad].
    """
    hips = 0.5 * (position[:, place["l_hip"]] + position[:, place["r_hip"]])
    trunk = angles_between(position[:, place["neck"]] - hips, np.array([0.0, 0.0, 1.0]))
    off = _off_axes(position, place)
    is_straight = (bends_of(position, place) - drawn < BENT).all(axis=(1, 2))
    are_arms_level = (off[:, :, :2] < ARM_SLACK).all(axis=(1, 2))
    are_legs_upright = (off[:, :, 2:] < LEG_SLACK).all(axis=(1, 2))
    return is_straight & are_arms_level & are_legs_upright & (trunk < TRUNK_SLACK)
