"""Toy heads: a ball with a bump that shows where it looks, visible from the front; its back is flat."""

import numpy as np

from nets.orientation.config import OrientationConfig
from nets.orientation.frames import Patches
from nets.patches import MISSING


def toy_patches(n, seed=0, config=None, noise_mm=3.0):
    """Patches of n toy heads, tilts and rolls of 0."""
    rng = np.random.default_rng(seed)
    config = OrientationConfig(region="head") if config is None else config
    height, width = config.view.patch
    angle = rng.uniform(-np.pi, np.pi, n).astype(np.float32)
    v, u = np.mgrid[:height, :width].astype(np.float32)
    x, y = (u - (width - 1) / 2) / width * 2, (v - (height - 1) / 2) / height * 2
    is_ball = np.hypot(x, y) < 0.7
    relative = np.full((n, height, width), MISSING)
    for k in range(n):
        bump = 120.0 * np.exp(-((x - 0.5 * np.sin(angle[k])) ** 2 + y**2) / 0.08) * np.cos(angle[k])
        side = 80.0 * x * np.sin(angle[k])
        value = np.rint(-bump - side + rng.normal(0.0, noise_mm, x.shape))
        relative[k] = np.where(is_ball, value, MISSING)
    kind = np.repeat(is_ball[None].astype(np.uint8), n, axis=0)
    zeros, unknown = np.zeros(n, np.float32), np.full(n, -1, np.int64)
    return Patches(relative.astype(np.int16), kind, angle, zeros, zeros.copy(), unknown)


def with_postures(patches, seed=0):
    """The same as if of bodies, standing or sitting by what their angle says."""
    return patches._replace(
        posture=(np.cos(patches.angle) > 0).astype(np.int64),
        tilt=patches.tilt * np.nan,
        roll=patches.roll * np.nan,
    )
