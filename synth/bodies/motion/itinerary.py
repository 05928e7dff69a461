"""Where a person's body goes over time, and the footfalls that carry it: walks, turns, shifts and stands."""

from dataclasses import dataclass, field

import numpy as np

from synth.bodies.motion.curves import Array, eased, smoothed
from synth.bodies.motion.steps import SWING, Footfall

Footing = tuple[float, float, float]
SPEED_UP = 0.8
"""Time to get up to speed, and to stop [s]."""
CADENCE = (0.95, 0.66)
"""Steps a second of legs of 0.9 m: at no speed, and more with each m/s; a fit to Winter's (2009) slow to fast gait."""
REFERENCE_LEG = 0.9
"""Leg of those steps [m]; shorter legs step faster, by the square root."""
TURN_A_STEP = np.radians(42.0)
"""Each step turns the body by at most this [rad]."""
TURN_SPEED = np.radians(95.0)
"""Mean speed of turning on the spot [rad/s]."""
HEADING_SIGMA = 0.22
"""The body's heading follows the path smoothly, within about this time [s]."""
LEAST_STEP, LEAST_TURN = 0.02, np.radians(4.0)
"""A foot that is nearer than this to where it shall stand makes no step."""
MID_STANCE = 0.46
"""A foot that has landed is below the body after so many steps' time."""
ANKLE_BEHIND = -0.02
"""x of the ankles from the hips when standing [m]."""


@dataclass(frozen=True)
class Stance:
    """How a person places the feet.

    Attributes:
        leg: Hip centre to sole [m].
        half_width: Of each foot beside the body [m].
        toe_out: Of each foot [rad].
    """

    leg: float
    half_width: float
    toe_out: float

    def footing(self, side: str, place: Array, heading: float) -> Footing:
        """Where a foot belongs below a body.

        Args:
            side: "l" or "r".
            place: (2,) of the body [m].
            heading: Its direction [rad].
        """
        sign = 1.0 if side == "l" else -1.0
        c, s = np.cos(heading), np.sin(heading)
        x, y = ANKLE_BEHIND, sign * self.half_width
        return (
            float(place[0] + c * x - s * y),
            float(place[1] + s * x + c * y),
            float(heading + sign * self.toe_out),
        )


@dataclass
class Itinerary:
    """A person's way while it is being made; every act begins where the last one ended, at rest.

    Attributes:
        stance: How the feet are placed.
        rate: Samples a second.
        place: (2,) where the body is now [m].
        heading: Its direction [rad].
        feet: Where the feet stand, by side.
        start: Where they stood at the beginning.
        falls: Steps of each foot.
        places: (m, 2) of each act so far.
        headings: (m,) of each act so far.
        activity: What is done at each sample.
    """

    stance: Stance
    rate: float
    place: Array
    heading: float
    feet: dict[str, Footing] = field(default_factory=dict)
    start: dict[str, Footing] = field(default_factory=dict)
    falls: dict[str, list[Footfall]] = field(default_factory=lambda: {"l": [], "r": []})
    places: list[Array] = field(default_factory=list)
    headings: list[Array] = field(default_factory=list)
    activity: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        if not self.feet:
            self.feet = {side: self.stance.footing(side, self.place, self.heading) for side in "lr"}
        self.start = dict(self.feet)

    @property
    def seconds(self) -> float:
        """How long it is so far."""
        return len(self.activity) / self.rate

    def stay(self, seconds: float, activity: str = "stand") -> None:
        """Stands, or sits, where the person is."""
        n = max(1, round(seconds * self.rate))
        self._keep(np.tile(self.place, (n, 1)), np.full(n, self.heading), activity)

    def turn(self, heading: float) -> None:
        """Turns on the spot, the shorter way."""
        change = wrapped(heading - self.heading)
        n = max(2, round(max(abs(change) / TURN_SPEED, 0.5) * self.rate))
        share = eased(np.arange(1, n + 1) / n)
        self._step(np.tile(self.place, (n, 1)), self.heading + change * share, "turn", {})

    def walk(self, path: Array, speed: float) -> None:
        """Walks along a path.

        Args:
            path: (m, 2) from where the person is, at least two places [m].
            speed: When up to speed [m/s].
        """
        path, along = rounded(path)
        length = float(along[-1])
        ramp = min(SPEED_UP, 2.0 * length / speed)
        speed = min(speed, length / ramp)
        n = max(2, round((length / speed + ramp) * self.rate))
        at = _way(np.arange(1, n + 1) / n * (length / speed + ramp), speed, ramp, length)
        place = np.stack([np.interp(at, along, path[:, k]) for k in (0, 1)], axis=1)
        ahead = np.stack([np.interp(at + 0.1, along, path[:, k]) for k in (0, 1)], axis=1)
        behind = np.stack([np.interp(at - 0.1, along, path[:, k]) for k in (0, 1)], axis=1)
        way = ahead - behind
        heading = np.unwrap(np.arctan2(way[:, 1], way[:, 0]))
        heading += self.heading + wrapped(heading[0] - self.heading) - heading[0]
        heading = smoothed(heading, HEADING_SIGMA, self.rate)
        first = 1.0 - eased(np.arange(1, n + 1) / (0.8 * self.rate))
        heading += (self.heading - heading[0]) * first
        self._step(place, heading, "walk", {})

    def shift(self, place: Array, heading: float, feet: dict[str, Footing], activity: str = "turn") -> None:
        """Turns and steps over to a place at once.

        Args:
            place: (2,) where to [m].
            heading: The direction there [rad].
            feet: Where the feet shall stand at last, by side; as the stance has them where none is given.
            activity: What it is called.
        """
        change = wrapped(heading - self.heading)
        way = np.asarray(place, np.float64) - self.place
        seconds = max(abs(change) / TURN_SPEED, float(np.hypot(*way)) / 0.45, 0.9)
        n = max(2, round(seconds * self.rate))
        share = eased(np.arange(1, n + 1) / n)
        self._step(self.place + share[:, None] * way, self.heading + change * share, activity, feet)

    def _keep(self, places: Array, headings: Array, activity: str) -> None:
        self.places.append(places)
        self.headings.append(headings)
        self.activity += [activity] * len(places)
        self.place, self.heading = places[-1].copy(), float(headings[-1])

    def _step(self, places: Array, headings: Array, activity: str, last: dict[str, Footing]) -> None:
        """Adds a stretch of the way with the steps that carry it; they end with the feet side by side, or at `last`."""
        begin, seconds = self.seconds, len(places) / self.rate
        speed = float(np.hypot(*np.diff(places, axis=0).T).max()) * self.rate
        turned = float(np.abs(np.diff(headings)).sum())
        pace = (CADENCE[0] + CADENCE[1] * speed) * np.sqrt(REFERENCE_LEG / self.stance.leg)
        n_steps = max(2, round(seconds * pace), int(np.ceil(turned / TURN_A_STEP)))
        step = seconds / (n_steps - 1 + SWING)
        end = {side: last.get(side, self.stance.footing(side, places[-1], headings[-1])) for side in "lr"}
        side = self._first(places, headings, end)
        for k in range(n_steps):
            lift = begin + k * step
            land = lift + SWING * step
            if k + 2 < n_steps:
                i = min(round((land - begin + MID_STANCE * step) * self.rate), len(places) - 1)
                footing = self.stance.footing(side, places[i], float(headings[i]))
            else:
                footing = end[side]
            if _is_step(self.feet[side], footing):
                self.falls[side].append(Footfall(lift, land, _turned_near(footing, self.feet[side])))
                self.feet[side] = self.falls[side][-1].footing
            side = "r" if side == "l" else "l"
        self._keep(places, headings, activity)

    def _first(self, places: Array, headings: Array, end: dict[str, Footing]) -> str:
        """The foot that begins: the one towards which the body turns, else the one that has farther to go."""
        change = float(headings[-1] - self.heading)
        if abs(change) > np.radians(20.0):
            return "l" if change > 0.0 else "r"
        far = {
            side: np.hypot(end[side][0] - self.feet[side][0], end[side][1] - self.feet[side][1]) for side in "lr"
        }
        return "l" if far["l"] > far["r"] else "r"


def rounded(path: Array, spacing: float = 0.02, sigma: float = 0.14) -> tuple[Array, Array]:
    """A path without corners, with the same ends.

    Args:
        path: (m, 2) corners [m].
        spacing: Of the places of the new path, before it is smoothed [m].
        sigma: Corners are rounded within about this way [m].

    Returns:
        (k, 2) places and (k,) the way to each [m].
    """
    gaps = np.hypot(*np.diff(path, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(gaps)])
    at = np.linspace(0.0, along[-1], max(2, int(along[-1] / spacing) + 1))
    dense = np.stack([np.interp(at, along, path[:, k]) for k in (0, 1)], axis=1)
    m = min(len(dense) - 1, int(np.ceil(3.0 * sigma / spacing)))
    # Mirrored at its ends, the path keeps them.
    before, after = 2.0 * dense[0] - dense[m:0:-1], 2.0 * dense[-1] - dense[-2 : -m - 2 : -1]
    smooth = smoothed(np.concatenate([before, dense, after]), sigma, 1.0 / spacing)[m : m + len(dense)]
    smooth[0], smooth[-1] = dense[0], dense[-1]
    return smooth, np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(smooth, axis=0).T))])


def wrapped(angle: float) -> float:
    """An angle within -pi..pi [rad]."""
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


def _way(seconds: Array, speed: float, ramp: float, length: float) -> Array:
    """(n,) way made after some time, getting up to speed and stopping smoothly [m]."""
    total = length / speed + ramp

    def gained(t: Array) -> Array:
        """The way while speeding up: the integral of an eased speed."""
        u = np.clip(t / ramp, 0.0, 1.0)
        return speed * ramp * (u**4 * (2.5 - 3.0 * u + u * u)) + speed * np.maximum(t - ramp, 0.0)

    half = 0.5 * total
    return np.asarray(np.where(seconds <= half, gained(seconds), length - gained(total - seconds)))


def _is_step(before: Footing, after: Footing) -> bool:
    way = np.hypot(after[0] - before[0], after[1] - before[1])
    return bool(way > LEAST_STEP or abs(wrapped(after[2] - before[2])) > LEAST_TURN)


def _turned_near(footing: Footing, before: Footing) -> Footing:
    """The same footing with the heading that is less than half a turn from the one before."""
    return footing[0], footing[1], before[2] + wrapped(footing[2] - before[2])
