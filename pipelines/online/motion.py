"""Constant-velocity Kalman filters of many points on the floor at once.

Both axes have the same noise and do not depend on each other, so that one covariance of place and velocity along an
axis does for both.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Motion(NamedTuple):
    """What is believed of n points.

    Attributes:
        place: (n, 2) [m].
        velocity: (n, 2) [m/s].
        place_variance: (n,) along each axis [m^2].
        cross: (n,) covariance of place and velocity along an axis [m^2/s].
        velocity_variance: (n,) along each axis [m^2/s^2].
    """

    place: Array
    velocity: Array
    place_variance: Array
    cross: Array
    velocity_variance: Array

    def take(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> "Motion":
        """Some of the points."""
        return Motion(*(values[rows] for values in self))

    def covariance(self, row: int) -> Array:
        """(4, 4) of x, y and their velocities of one point."""
        along = [
            [self.place_variance[row], self.cross[row]],
            [self.cross[row], self.velocity_variance[row]],
        ]
        return np.asarray(np.kron(np.array(along), np.eye(2)), np.float64)


def nothing() -> Motion:
    """No points."""
    none = np.empty(0)
    return Motion(np.empty((0, 2)), np.empty((0, 2)), none, none, none)


def begun(place: Array, deviation: Array, speed: float) -> Motion:
    """Points that are seen for the first time.

    Args:
        place: (n, 2) measured [m].
        deviation: (n,) of the measurements along each axis [m].
        speed: Standard deviation of the velocity along each axis [m/s].
    """
    n = len(place)
    return Motion(place.copy(), np.zeros((n, 2)), deviation**2, np.zeros(n), np.full(n, speed**2))


def joined(first: Motion, second: Motion) -> Motion:
    """The points of both, those of the first before those of the second."""
    return Motion(*(np.concatenate(pair) for pair in zip(first, second, strict=True)))


def forecast(motion: Motion, seconds: float, acceleration: float, keeps: Array) -> Motion:
    """What is believed a while later.

    Args:
        motion: Now.
        seconds: How much later [s].
        acceleration: Standard deviation along each axis [m/s^2].
        keeps: (n,) share of its velocity that a point keeps over that time, 1 = all.
    """
    t, push = seconds, acceleration**2
    velocity = motion.velocity * keeps[:, None]
    return Motion(
        motion.place + (motion.velocity + velocity) * (t / 2),
        velocity,
        motion.place_variance + 2 * t * motion.cross + t**2 * motion.velocity_variance + push * t**4 / 4,
        motion.cross + t * motion.velocity_variance + push * t**3 / 2,
        motion.velocity_variance + push * t**2,
    )


def corrected(motion: Motion, place: Array, deviation: Array) -> Motion:
    """What is believed after a measurement of each point.

    Args:
        motion: Before.
        place: (n, 2) measured [m].
        deviation: (n,) of the measurements along each axis [m].
    """
    off = place - motion.place
    expected = motion.place_variance + deviation**2
    gain, push = motion.place_variance / expected, motion.cross / expected
    return Motion(
        motion.place + gain[:, None] * off,
        motion.velocity + push[:, None] * off,
        (1 - gain) * motion.place_variance,
        (1 - gain) * motion.cross,
        motion.velocity_variance - push * motion.cross,
    )
