"""Closed form of a ball joint and the hinge beyond it: shoulder and elbow, hip and knee."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

STRAIGHT = 0.26
"""Sine of the bend of an elbow or knee below which it does not tell the limb's twist."""


@njit(cache=True, nogil=True)
def ball_start(
    limb: NDArray[np.float64],
    beyond: NDArray[np.float64],
    bend_sign: float,
    side_sign: float,
    straight: float = STRAIGHT,
) -> tuple[float, float, float, float]:
    """Closed form of a shoulder or hip and its elbow or knee.

    Args:
        limb: (3,) direction of upper arm or thigh in the frame that carries the joint.
        beyond: (3,) direction of forearm or shank, likewise.
        bend_sign: +1 if bending moves the limb's end forward (elbow), -1 backward (knee).
        side_sign: +1 left, -1 right.
        straight: Sine of the bend below which the limb is straight.

    Returns:
        Flexion, abduction, rotation and bend [rad]; rotation is 0 where the limb is straight.
    """
    sideways = side_sign * limb[1]
    abduction = np.arcsin(min(max(sideways, -1.0), 1.0))
    flexion = np.arctan2(limb[0], -limb[2])
    if flexion < -0.5 * np.pi:
        flexion += 2.0 * np.pi
    # `beyond` in the frame after flexion and abduction: Rx(-abduction) Ry(flexion) applied to it.
    c, s = np.cos(flexion), np.sin(flexion)
    x = c * beyond[0] + s * beyond[2]
    z = -s * beyond[0] + c * beyond[2]
    y = side_sign * beyond[1]
    ca, sa = np.cos(abduction), np.sin(abduction)
    y, z = ca * y + sa * z, -sa * y + ca * z
    bend = np.arccos(min(max(-z, -1.0), 1.0))
    rotation = 0.0
    if np.sin(bend) > straight:
        rotation = np.arctan2(-bend_sign * y, bend_sign * x)
    return flexion, abduction, rotation, bend


@njit(cache=True, nogil=True)
def other_start(start: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    """The other angles of a ball joint that turn it alike: flexion and rotation half a turn on.

    Args:
        start: Flexion, abduction, rotation and bend [rad].
    """
    flexion, abduction, rotation, bend = start
    flexion += -np.pi if flexion > 0.5 * np.pi else np.pi
    abduction = np.pi - abduction if abduction > 0.0 else -np.pi - abduction
    return flexion, abduction, rotation + (np.pi if rotation <= 0.0 else -np.pi), bend


@njit(cache=True, nogil=True)
def ball_miss(
    angles: tuple[float, float, float, float],
    limb: NDArray[np.float64],
    beyond: NDArray[np.float64],
    bend_sign: float,
    side_sign: float,
) -> float:
    """How far the worse of two limbs is off its direction [rad]; arguments as of `ball_start`.

    Args:
        angles: Flexion, abduction, rotation and bend [rad].
        limb: (3,) direction wanted of the first limb.
        beyond: (3,) of the second.
        bend_sign: As of `ball_start`.
        side_sign: As of `ball_start`.
    """
    flexion, abduction, rotation, bend = angles
    worst = 1.0
    for second in range(2):
        along = bend_sign * np.sin(bend) if second else 0.0
        x, y = along * np.cos(rotation), -side_sign * along * np.sin(rotation)
        z = -np.cos(bend) if second else -1.0
        c, s = np.cos(abduction), side_sign * np.sin(abduction)
        y, z = c * y - s * z, s * y + c * z
        c, s = np.cos(flexion), np.sin(flexion)
        x, z = c * x - s * z, s * x + c * z
        wanted = beyond if second else limb
        worst = min(worst, x * wanted[0] + y * wanted[1] + z * wanted[2])
    return np.arccos(min(max(worst, -1.0), 1.0))
