"""Footfalls, and what the feet do between them: where each is, how it rolls, and what of it touches the floor."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from synth.bodies.mocap.capture import runs
from synth.bodies.motion.curves import Array, bump, eased, smoothed, travelled
from synth.bodies.motion.foot import TOES_LIMIT, FootShape

SWING = 0.84
"""A foot is in the air for this share of the time from one step to the next: 42 % of a stride (Winter 2009: 40 %)."""
FULL_STRIDE = 1.3
"""Feet roll fully in strides of this length, and less in shorter ones [m]."""
OFF, ON = np.radians(60.0), np.radians(18.0)
"""Pitch of the foot, heel up, when it leaves the floor, and toes up, when it comes down; Winter (2009), rounded."""
ROLL_ON, ROLL_OFF = 0.34, 0.62
"""How long the foot comes down flat after landing, and rolls off before it leaves, in steps."""
# Pitch in the air over that at its ends, by the share of the swing: it goes on rising, then the toes come up.
_RISING = PchipInterpolator((0.0, 0.1, 0.3, 0.62, 0.8, 1.0), (1.0, 1.1, 0.8, 0.12, 0.0, 0.0))
_TURNED_UP = PchipInterpolator((0.0, 0.5, 0.88, 1.0), (0.0, 0.1, 1.0, 1.0))
CLEARANCE = 0.02
"""How high the sole is lifted in the middle of a long step, beyond what rolling asks for [m]."""
TOES_LENGTH = 0.07
"""Of the toes before their hinge [m]."""
PITCH_SIGMA = 0.018
"""How much the pitch is smoothed over time [s]; that moves no foot that is down, which turns about what is down."""
HEIGHT_SIGMA = 0.012
"""How much its height is [s]."""
FLAT = np.radians(2.5)
"""A foot pitched less than this touches with heel and toes."""


@dataclass(frozen=True)
class Footfall:
    """One step of one foot.

    Attributes:
        lift: When the foot leaves the floor [s].
        land: When it is down again [s].
        footing: x, y [m] and heading [rad] where it lands.
    """

    lift: float
    land: float
    footing: tuple[float, float, float]


@dataclass(frozen=True)
class FootTrack:
    """One foot over time.

    Attributes:
        shape: The foot.
        footing: (n, 3) x, y [m] and heading [rad].
        pitch: (n,) [rad], heel up positive.
        swing: (n,) share of the time in the air that is over; -1 while the foot is down.
        clearance: (n,) how high the sole is lifted [m].
        rate: Samples a second.
    """

    shape: FootShape
    footing: Array
    pitch: Array
    swing: Array
    clearance: Array
    rate: float

    @property
    def is_up(self) -> NDArray[np.bool_]:
        """(n,) whether the foot is in the air."""
        return self.swing >= 0.0

    @property
    def is_down(self) -> NDArray[np.bool_]:
        """(n, 2) whether heel and toes are on the floor."""
        return np.stack([self.pitch <= FLAT, self.pitch >= -FLAT], axis=1) & ~self.is_up[:, None]

    def toes(self) -> Array:
        """(n,) extension of the toes, which lie flat while they are down [rad]."""
        loosened = np.where(self.is_up, 1.0 - 0.65 * eased(self.swing / 0.35), 1.0)
        return np.asarray(np.clip(self.pitch, 0.0, TOES_LIMIT) * loosened)

    def placed(self) -> Array:
        """(n, 4, 4) where the link behind the ankle is, world."""
        droop = TOES_LENGTH * np.sin(np.clip(self.pitch - self.toes(), 0.0, None)) * self.is_up
        height = smoothed(self.shape.lift_at(self.pitch) + self.clearance + droop, HEIGHT_SIGMA, self.rate)
        return self.shape.placed(self.footing, self.pitch, height)

    def rolled(self, more: Array) -> "FootTrack":
        """The foot with its heel so much (n,) more up [rad]."""
        return replace(self, pitch=self.pitch + smoothed(more, 2.0 * PITCH_SIGMA, self.rate))


def track_foot(
    shape: FootShape, start: tuple[float, float, float], falls: list[Footfall], n: int, rate: float
) -> FootTrack:
    """What a foot does that stands and makes steps.

    Args:
        shape: The foot.
        start: Its footing before the first step.
        falls: Its steps, in order of time.
        n: Samples.
        rate: Samples a second.
    """
    seconds = np.arange(n) / rate
    footing = np.tile(np.array(start), (n, 1))
    pitch, swing = np.zeros(n), np.full(n, -1.0)
    clearance = np.zeros(n)
    before = np.array(start)
    for k, fall in enumerate(falls):
        after = np.array(fall.footing)
        share = (seconds - fall.lift) / (fall.land - fall.lift)
        footing[share > 0.0] = (before + eased(share)[:, None] * (after - before))[share > 0.0]
        is_up = (share > 0.0) & (share < 1.0)
        swing[is_up] = share[is_up]
        length = min(float(np.hypot(*(after - before)[:2])) / FULL_STRIDE, 1.0)
        clearance[is_up] = (0.35 + 0.65 * length) * CLEARANCE * bump(share[is_up])
        step = (fall.land - fall.lift) / SWING
        until = falls[k + 1].lift if k + 1 < len(falls) else np.inf
        _roll(pitch, seconds, fall, share, step, length, until)
        before = after
    pitch = smoothed(pitch, PITCH_SIGMA, rate)
    _swing_ankle(shape, footing, pitch, swing, rate)
    return FootTrack(shape, footing, pitch, swing, clearance, rate)


def _swing_ankle(shape: FootShape, footing: Array, pitch: Array, swing: Array, rate: float) -> None:
    """Lets the ankle leave the floor with the speed that it has from rolling, and come down with the one it needs.

    Args:
        shape: The foot.
        footing: (n, 3), changed in place where the foot is up.
        pitch: (n,) [rad].
        swing: (n,) share of the time in the air that is over; -1 while the foot is down.
        rate: Samples a second.
    """
    along = shape.placed(np.zeros_like(footing), pitch, np.zeros(len(pitch)))[:, 0, 3]
    ahead = np.stack([np.cos(footing[:, 2]), np.sin(footing[:, 2])], axis=1)
    rolled = along[:, None] * ahead
    ankle = footing[:, :2] + rolled
    for first, last in runs(swing >= 0.0):
        if first < 2 or last + 2 > len(swing):
            continue
        a, b = first - 1, last
        seconds = (b - a) / rate
        leaving, landing = (ankle[a] - ankle[a - 1]) * rate, (ankle[b + 1] - ankle[b]) * rate
        u = (np.arange(first, last) - a) / (b - a)
        way = travelled(u[:, None], ankle[a], ankle[b], leaving * seconds, landing * seconds)
        footing[first:last, :2] = way - rolled[first:last]


def _roll(
    pitch: Array, seconds: Array, fall: Footfall, share: Array, step: float, length: float, until: float
) -> None:
    """Adds the pitch of one step: rolling off before it, in the air, and coming down after it, until the next."""
    off, on = OFF * length**0.8, ON * length
    rise = 1.0 - (fall.lift - seconds) / (ROLL_OFF * step)
    is_rolling = (rise > 0.0) & (seconds <= fall.lift)
    pitch[is_rolling] = np.maximum(pitch[is_rolling], off * rise[is_rolling] ** 2.4)
    is_up = (share > 0.0) & (share < 1.0)
    pitch[is_up] = off * _RISING(share[is_up]) - on * _TURNED_UP(share[is_up])
    since = (seconds - fall.land) / (ROLL_ON * step)
    is_landing = (since >= 0.0) & (since < 1.0) & (seconds < until)
    pitch[is_landing] = -on * (1.0 - since[is_landing]) ** 2
