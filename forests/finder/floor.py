"""The floor plane in one depth image: RANSAC over points on level surfaces, then least squares."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.frames import Pinhole, check_depth

N_HYPOTHESES = 400
"""Planes that are tried."""
GRID = 64
"""Columns of the grid of pixels that the search looks at."""
MAX_ROLL = math.radians(12.0)
"""A camera is turned about its axis by at most this [rad], where nothing is known of it."""
PITCHES = (math.radians(-35.0), math.radians(65.0))
"""Range of the optical axis's angle below the horizon [rad], where nothing is known of it."""
HEIGHTS = (0.25, 3.5)
"""Range of a camera's height [m], where nothing is known of it."""
NOISE_M, NOISE_PER_M2 = 0.012, 0.003
"""Points count as on the plane within NOISE_M + NOISE_PER_M2 * z * z: the depth noise of structured light and of
time of flight grows so at most (docs/sensors.md) [m]."""
BELOW_M, MAX_BELOW = 0.12, 0.03
"""Nothing lies under a floor: at most this share of all points is more than BELOW_M under it, else it is a table."""
MIN_INLIERS = 40
"""Points of the grid that a floor has at least; 1.5 % of the image."""


class NoFloorError(ValueError):
    """An image in which no floor can be found. The message says why in one sentence."""


@dataclass(frozen=True)
class FloorPrior:
    """What is known of the camera before looking.

    Attributes:
        pitch: The optical axis's angle below the horizon [rad]; None = unknown.
        height: Of the optical centre above the floor [m]; None = unknown.
        pitch_tolerance: How far the pitch and the roll may be off [rad].
        height_tolerance: How far the height may be off [m].
    """

    pitch: float | None = None
    height: float | None = None
    pitch_tolerance: float = math.radians(6.0)
    height_tolerance: float = 0.15

    def __post_init__(self) -> None:
        if self.pitch is not None and not abs(self.pitch) < math.pi / 2:
            raise ValueError(f"pitch={self.pitch} must be in (-pi/2, pi/2) radians")
        if self.height is not None and not 0 < self.height < 20:
            raise ValueError(f"height={self.height} must be in (0, 20) metres")
        if not (0 < self.pitch_tolerance < math.pi / 2 and 0 < self.height_tolerance < 20):
            raise ValueError(
                f"tolerances ({self.pitch_tolerance}, {self.height_tolerance}) must be positive, "
                "the pitch's below pi/2 radians, the height's below 20 metres"
            )


@dataclass(frozen=True)
class Floor:
    """A floor plane: a point p of the camera frame is `normal @ p + height` above it [m].

    Attributes:
        normal: (3,) float64, unit vector upwards, camera frame.
        height: Of the optical centre above the floor [m].
    """

    normal: NDArray[np.float64]
    height: float

    def __post_init__(self) -> None:
        normal = np.asarray(self.normal, dtype=np.float64)
        if normal.shape != (3,) or not abs(float(np.linalg.norm(normal)) - 1.0) < 1e-6:
            raise ValueError(f"normal {self.normal} must be a unit vector of 3 numbers")
        if not (math.isfinite(self.height) and abs(normal[2]) < 0.999):
            raise ValueError("a floor needs a finite height, and a camera that does not look straight up or down")
        object.__setattr__(self, "normal", normal)

    @classmethod
    def of_camera(cls, pitch: float, height: float) -> "Floor":
        """The floor under a camera that is not rolled.

        Args:
            pitch: The optical axis's angle below the horizon [rad].
            height: Of the optical centre above the floor [m].
        """
        return cls(np.array([0.0, -math.cos(pitch), -math.sin(pitch)]), height)

    @property
    def pitch(self) -> float:
        """The optical axis's angle below the horizon [rad]."""
        return math.asin(-float(self.normal[2]))

    @property
    def T_floor_camera(self) -> NDArray[np.float64]:  # noqa: N802
        """(4, 4) float64; the floor frame lies under the camera: x where it looks, y to the left, z up [m]."""
        ahead = np.array([0.0, 0.0, 1.0]) - self.normal[2] * self.normal
        ahead /= np.linalg.norm(ahead)
        out = np.eye(4)
        out[:3, :3] = np.stack([ahead, np.cross(self.normal, ahead), self.normal])
        out[2, 3] = self.height
        return out


class _Limits(NamedTuple):
    """What planes are tried: pitch, roll and height [rad, rad, m]."""

    low_pitch: float
    high_pitch: float
    roll: float
    low_height: float
    high_height: float


def find_floor(depth: NDArray, camera: Pinhole, prior: FloorPrior | None = None, seed: int = 0) -> Floor:
    """Finds the floor in a depth image; the same image and seed give the same floor.

    Planes through three points of level surfaces are tried. The best has the most points, and nearly none below it.

    Args:
        depth: (height, width) integers [mm], 0 = nothing.
        camera: Its intrinsics.
        prior: What is known of the camera's tilt and height; None = only that it stands upright, more or less.
        seed: Of the draws.

    Returns:
        The floor.

    Raises:
        NoFloorError: The image is empty, or shows too little that may be floor.
        ValueError: The depth is no depth image.
    """
    image = check_depth(depth)
    step = max(1, image.shape[1] // GRID)
    points = _grid_points(image, step, float(camera.fx), float(camera.fy), float(camera.cx), float(camera.cy))
    n_points = int((points[:, :, 2] > 0).sum())
    if n_points < MIN_INLIERS:
        share = np.count_nonzero(image) / image.size
        raise NoFloorError(f"no floor was found: {share:.1%} of the image has depth, which is too little")
    limits = _limits_of(prior or FloorPrior())
    level = _level_points(points, limits)
    if len(level) < MIN_INLIERS:
        raise NoFloorError(
            f"no floor was found: {len(level)} of {n_points} looked-at points lie on level surfaces below the "
            f"camera, {MIN_INLIERS} are needed"
        )
    flat = points.reshape(-1, 3)
    flat = flat[flat[:, 2] > 0]
    draws = _draws(len(level), np.random.default_rng(seed))
    plane, n_inliers = _best_plane(level, flat, draws, limits)
    if n_inliers < MIN_INLIERS:
        raise NoFloorError(
            f"no floor was found: no level plane has {MIN_INLIERS} of {n_points} looked-at points on it and nearly "
            "none below"
        )
    return _refined(flat, plane)


def _limits_of(prior: FloorPrior) -> _Limits:
    low_pitch, high_pitch = PITCHES
    low_height, high_height = HEIGHTS
    roll = MAX_ROLL
    if prior.pitch is not None:
        low_pitch, high_pitch = prior.pitch - prior.pitch_tolerance, prior.pitch + prior.pitch_tolerance
        roll = prior.pitch_tolerance
    if prior.height is not None:
        low_height = max(0.01, prior.height - prior.height_tolerance)
        high_height = prior.height + prior.height_tolerance
    return _Limits(low_pitch, high_pitch, roll, low_height, high_height)


def _draws(n: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """(N_HYPOTHESES, 3) int64 numbers of points; of half of the triples anywhere, else within an eighth of the list.

    The list runs along the rows of the image, so that the latter often lie on one surface, however small.
    """
    draws = rng.integers(0, n, (N_HYPOTHESES, 3))
    nearby = draws[::2, :1] + rng.integers(-n // 16, n // 16 + 1, (len(draws[::2]), 2))
    draws[::2, 1:] = np.clip(nearby, 0, n - 1)
    return draws


def _refined(points: NDArray[np.float64], plane: NDArray[np.float64]) -> Floor:
    """The plane by least squares over the points on it, thrice, ever nearer; weights fall with their noise.

    Feet and the foot of walls lie on one side alone, so that they would lift the plane if points far off counted.
    """
    for share in (1.0, 0.7, 0.4):
        slack = NOISE_M + NOISE_PER_M2 * points[:, 2] ** 2
        is_on = np.abs(points @ plane[:3] + plane[3]) < share * slack
        on, weight = points[is_on], 1.0 / slack[is_on] ** 2
        middle = (weight[:, None] * on).sum(axis=0) / weight.sum()
        spread = ((on - middle) * weight[:, None]).T @ (on - middle)
        normal = np.linalg.eigh(spread)[1][:, 0]
        normal = normal if normal @ plane[:3] > 0 else -normal
        plane = np.array([*normal, -normal @ middle])
    return Floor(plane[:3] / np.linalg.norm(plane[:3]), float(plane[3]))


@njit(cache=True, nogil=True)
def _grid_points(depth, step, fx, fy, cx, cy):  # type: ignore[no-untyped-def]
    """(rows, columns, 3) float64 points of every step-th pixel, camera frame [m]; z = 0 where nothing is."""
    rows, columns = (depth.shape[0] + step - 1) // step, (depth.shape[1] + step - 1) // step
    out = np.zeros((rows, columns, 3))
    for i in range(rows):
        for j in range(columns):
            z = depth[i * step, j * step] * 1e-3
            out[i, j, 0] = (j * step - cx) / fx * z
            out[i, j, 1] = (i * step - cy) / fy * z
            out[i, j, 2] = z
    return out


@njit(cache=True, nogil=True)
def _fits(x, y, z, limits):  # type: ignore[no-untyped-def]
    """Whether a unit vector may be the floor's normal; `limits` are widened by the caller."""
    roll = math.atan2(abs(x), -y)
    pitch = math.asin(min(1.0, max(-1.0, -z)))
    return y < 0 and roll <= limits.roll and limits.low_pitch <= pitch <= limits.high_pitch


@njit(cache=True, nogil=True)
def _level_points(points, limits):  # type: ignore[no-untyped-def]
    """(n, 3) the grid's points whose neighbours two steps away span a plane that may be level, 20 degrees off."""
    rows, columns = points.shape[:2]
    wide = _Limits(
        limits.low_pitch - 0.35,
        limits.high_pitch + 0.35,
        limits.roll + 0.35,
        limits.low_height,
        limits.high_height,
    )
    out = np.empty((rows * columns, 3))
    n = 0
    for i in range(2, rows - 2):
        for j in range(2, columns - 2):
            up, down, left, right = points[i - 2, j], points[i + 2, j], points[i, j - 2], points[i, j + 2]
            if points[i, j, 2] <= 0 or min(up[2], down[2], left[2], right[2]) <= 0:
                continue
            across, along = right - left, up - down
            x = along[1] * across[2] - along[2] * across[1]
            y = along[2] * across[0] - along[0] * across[2]
            z = along[0] * across[1] - along[1] * across[0]
            length = math.sqrt(x * x + y * y + z * z)
            if length <= 1e-12:
                continue
            # What is seen faces the camera, so that a ceiling's normal points down.
            sign = -1.0 if x * points[i, j, 0] + y * points[i, j, 1] + z * points[i, j, 2] > 0 else 1.0
            if _fits(sign * x / length, sign * y / length, sign * z / length, wide):
                out[n] = points[i, j]
                n += 1
    return out[:n]


@njit(cache=True, nogil=True)
def _best_plane(level, points, draws, limits):  # type: ignore[no-untyped-def]
    """(4,) plane (normal, height) with the most points of `level` on it, and how many of `points` those are."""
    best, plane = 0, np.zeros(4)
    for k in range(len(draws)):
        p, a, b = (
            level[draws[k, 0]],
            level[draws[k, 1]] - level[draws[k, 0]],
            level[draws[k, 2]] - level[draws[k, 0]],
        )
        x, y, z = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
        length = math.sqrt(x * x + y * y + z * z)
        if length <= 1e-6:
            continue
        if y > 0:
            length = -length
        x, y, z = x / length, y / length, z / length
        height = -(x * p[0] + y * p[1] + z * p[2])
        if not _fits(x, y, z, limits) or not limits.low_height <= height <= limits.high_height:
            continue
        n_on = 0
        for i in range(len(level)):
            off = x * level[i, 0] + y * level[i, 1] + z * level[i, 2] + height
            n_on += abs(off) < NOISE_M + NOISE_PER_M2 * level[i, 2] * level[i, 2]
        if n_on <= best:
            continue
        n_below = 0
        for i in range(len(points)):
            off = x * points[i, 0] + y * points[i, 1] + z * points[i, 2] + height
            n_below += off < -BELOW_M - NOISE_PER_M2 * points[i, 2] * points[i, 2]
        if n_below <= MAX_BELOW * len(points):
            best = n_on
            plane[0], plane[1], plane[2], plane[3] = x, y, z, height
    return plane, best
