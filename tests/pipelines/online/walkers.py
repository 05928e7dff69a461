"""People who walk about a floor, as a detector would tell of them: the truth, and detections with its faults."""

from typing import NamedTuple

import numpy as np

from pipelines.online.messages import NS, Detection, Detections

FPS = 30


class Walk(NamedTuple):
    """places: (n_frames, n_people, 2) [m]; heights: (n_people,) [m]; is_there: (n_frames, n_people) bool."""

    places: np.ndarray
    heights: np.ndarray
    is_there: np.ndarray


def walk(rng, n_people=6, n_frames=300, size=5.0, apart=0.5, fps=FPS):
    """People who go to one goal after the other at 0.5 to 1.4 m/s, stand now and then, and step aside for others."""
    place = rng.uniform(0, size, (n_people, 2))
    goal, speed = rng.uniform(0, size, (n_people, 2)), rng.uniform(0.5, 1.4, n_people)
    velocity, rest = np.zeros((n_people, 2)), np.zeros(n_people)
    out = np.empty((n_frames, n_people, 2))
    for k in range(n_frames):
        to_goal = goal - place
        far = np.linalg.norm(to_goal, axis=1)
        is_there = far < 0.2
        rest = np.where(is_there & (rest <= 0), rng.uniform(0, 2, n_people), rest - 1 / fps)
        goal[is_there] = rng.uniform(0, size, (int(is_there.sum()), 2))
        wanted = to_goal / np.maximum(far, 1e-6)[:, None] * speed[:, None] * (rest <= 0)[:, None]
        off = place[:, None] - place[None]
        near = np.linalg.norm(off, axis=2) + 10 * np.eye(n_people)
        push = (off / near[..., None] * np.maximum(0, 2 * apart - near)[..., None]).sum(axis=1)
        velocity += np.clip(wanted + 2 * push - velocity, -1, 1) * (4 / fps)
        place = place + velocity / fps
        out[k] = place
    return Walk(out, rng.uniform(1.5, 1.9, n_people), np.ones((n_frames, n_people), bool))


def detected(walk, rng, noise=0.05, missed=0.05, false=0.1, stamp=0, fps=FPS):
    """Detections of each frame: noise [m], share of the people who are missed, false ones in a frame."""
    for k in range(len(walk.places)):
        people = [
            detection(place + rng.normal(0, noise, 2), height + rng.normal(0, 0.03), rng.uniform(0.85, 1))
            for place, height, is_there in zip(walk.places[k], walk.heights, walk.is_there[k], strict=True)
            if is_there and rng.uniform() >= missed
        ]
        people += [
            detection(rng.uniform(0, 5, 2), rng.uniform(1, 2), rng.uniform(0.5, 0.95))
            for _ in range(rng.poisson(false))
        ]
        yield Detections(stamp + k * NS // fps, "floor", tuple(people[i] for i in rng.permutation(len(people))))


def detection(place, height=1.7, confidence=0.95, distance=3.0):
    return Detection(
        np.asarray(place, float),
        height,
        confidence,
        distance,
        1.0,
        (10.0, 10.0, 50.0, 150.0),
        (15.0, 10.0, 45.0, 50.0),
        np.zeros(3),
    )
