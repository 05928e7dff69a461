"""Somebody who walks, as a BVH recording of our own skeleton."""

import functools

import numpy as np

from synth.bodies.motion.compose import Plan, composed
from synth.bodies.motion.itinerary import Itinerary, Stance
from synth.bodies.poses.draw import draw_base
from synth.bodies.poses.landmarks import landmarks_of
from synth.bodies.shape.make import make_body
from synth.bodies.spec import BodySpec
from tests.mocap_files import bvh_text, standing_root

FPS = 30.0
WAY = 1.6
"""How far they go [m]."""


@functools.cache
def walked():
    """The motion at 30 a second, of somebody of 1.7 m who stands, walks and stands."""
    body = make_body(BodySpec(1.70, 68.0, 0.5, 35.0))
    rng = np.random.default_rng(4)
    base = draw_base("standing", body, rng)
    way = Itinerary(Stance(landmarks_of(body).leg, 0.08, 0.1), FPS, np.zeros(2), 0.4)
    way.stay(0.3)
    way.walk(WAY * np.array([(0.0, 0.0), (np.cos(0.4), np.sin(0.4))]), 1.0)
    way.stay(0.3)
    return composed(Plan(body, base, way), rng)


@functools.cache
def walking_text(scale=1.0):
    """A BVH file of it, of a person of another size."""
    poses = []
    for angles, T in zip(walked().angles, walked().T_world_root, strict=True):
        root = standing_root(angles, T[:3, :3])
        root[:2, 3] = T[:2, 3]
        poses.append((angles, root))
    return bvh_text(poses, scale=scale)
