"""How the cameras of a clip move: they stand, pan, or drive through free floor."""

import numpy as np
from numpy.typing import NDArray

from synth.bodies.motion.curves import drift, eased, smoothed
from synth.bodies.motion.itinerary import rounded, wrapped
from synth.scene.clips.routes import Router
from synth.scene.config import SceneConfig
from synth.scene.placement import pose_on_floor
from synth.scene.room.arrange import Eye

PAN = (np.radians(12.0), np.radians(35.0))
"""Range of how far a camera pans to each side [rad]."""
PAN_SPEED = (np.radians(8.0), np.radians(30.0))
"""Range of its mean speed [rad/s]."""
DRIVE_SPEED = (0.2, 0.8)
"""Range of a robot's speed [m/s]: service robots indoors go at walking speed at most."""
ROBOT_RADIUS = 0.25
"""Half of a robot's width [m]."""
START_SECONDS = 1.0
"""A robot takes this long to get up to speed [s]."""
SHAKE = np.radians(0.12)
"""A driving robot's camera pitches by about this [rad]."""
N_GOALS = 12


def draw_move(config: SceneConfig, rng: np.random.Generator) -> str:
    """How the camera moves: "stand", "pan" or "drive"; several cameras stand, but for a stereo pair."""
    if config.cameras > 1 and config.rig != "stereo":
        return "stand"
    names = ("stand", "pan", "drive")
    weights = np.array([getattr(config.camera_moves, name) for name in names])
    return names[int(rng.choice(len(names), p=weights / weights.sum()))]


def eye_track(
    move: str, eye: Eye, router: Router, n: int, fps: float, rng: np.random.Generator
) -> NDArray[np.float64] | None:
    """Where a camera is at each time step.

    Args:
        move: A name of `CameraMoves`.
        eye: Where it begins.
        router: Where a robot can drive.
        n: Time steps.
        fps: Time steps a second.
        rng: Source of randomness.

    Returns:
        (n, 4, 4) T_world_camera; None if a robot finds no way.
    """
    seconds = np.arange(n) / fps
    if move == "stand":
        return np.tile(eye.T_world_camera, (n, 1, 1))
    if move == "pan":
        width, speed = float(rng.uniform(*PAN)), float(rng.uniform(*PAN_SPEED))
        frequency, phase = speed / (4.0 * width), float(rng.uniform(0.0, 2.0 * np.pi))
        turn = width * np.sin(2.0 * np.pi * frequency * seconds + phase)
        return _turned(eye, np.tile(eye.place, (n, 1)), turn)
    return _driven(eye, router, n, fps, rng)


def _driven(eye: Eye, router: Router, n: int, fps: float, rng: np.random.Generator) -> NDArray[np.float64] | None:
    """Along the way to the free place that asks for the least turning, the camera looking about ahead."""
    speed = float(rng.uniform(*DRIVE_SPEED))
    length = speed * max(n / fps - START_SECONDS, 0.3)
    best, least = None, np.inf
    for goal in router.draw_free(N_GOALS, rng):
        path = router.path(eye.place, goal) if router.is_free(eye.place) else None
        if path is None:
            continue
        first = path[1] - path[0]
        off = abs(wrapped(float(np.arctan2(first[1], first[0])) - eye.heading))
        reach = float(np.hypot(*np.diff(path, axis=0).T).sum())
        cost = off + max(0.0, 1.0 - reach / length)
        if cost < least and reach > 0.3:
            best, least = path, cost
    if best is None or least > np.radians(75.0):
        return None
    path, along = rounded(best)
    length = min(length, float(along[-1]))
    at = length * eased(np.arange(n) / max(n - 1, 1)) if length < speed * 2.0 else _steady(n, fps, length)
    place = np.stack([np.interp(at, along, path[:, k]) for k in (0, 1)], axis=1)
    ahead = np.stack([np.interp(at + 0.25, along, path[:, k]) for k in (0, 1)], axis=1)
    way = ahead - place
    bearing = np.unwrap(np.arctan2(way[:, 1], way[:, 0] + 1e-9))
    turn = smoothed(np.array([wrapped(float(b - eye.heading)) for b in bearing]), 0.4, fps)
    turn = 0.6 * np.clip(turn, -1.2, 1.2) * eased(np.arange(n) / fps / START_SECONDS)
    return _turned(eye, place, turn, SHAKE * drift(n, fps, rng, 0.8, 3.0))


def _steady(n: int, fps: float, length: float) -> NDArray[np.float64]:
    """(n,) way at an even speed, with a smooth start [m]."""
    seconds = np.arange(n) / fps
    gained = np.cumsum(eased(seconds / START_SECONDS))
    return np.asarray(gained / gained[-1] * length)


def _turned(
    eye: Eye, place: NDArray[np.float64], turn: NDArray[np.float64], pitch: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """(n, 4, 4) a camera moved to places (n, 2) and turned about the vertical by (n,) angles [rad]."""
    out = np.empty((len(turn), 4, 4))
    local = eye.T_world_camera.copy()
    local[:2, 3] = 0.0
    for k in range(len(turn)):
        T = local
        if pitch is not None:
            nod = np.eye(4)
            c, s = np.cos(pitch[k]), np.sin(pitch[k])
            nod[1:3, 1:3] = ((c, -s), (s, c))
            T = local @ nod
        out[k] = pose_on_floor(float(place[k, 0]), float(place[k, 1]), float(turn[k])) @ T
    return out
