"""People in the depth image of a whole scene: candidates on upper edges, scored, the best of each place kept."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.boxes import Box
from forests.finder.floor import Floor, FloorPrior, NoFloorError, find_floor
from forests.finder.model import FinderModel, read_finder, tree_scores
from forests.finder.probes import View, contour, top_at, view_of
from forests.frames import Pinhole, check_depth

APART_M = 0.45
"""Two people are at least this far apart, seen from above [m]."""
NEAR_M, BETTER = 0.2, 2.0
"""Candidates this near the best one tell where the axis is [m]; the highest of those whose score is at most BETTER
lower is the top."""
INSIDE_M = 0.1
"""The axis of a person lies this far behind the front of the head [m]."""
BODY_RADIUS_M = 0.45
"""A person's pixels lie within this of the axis [m]."""
FEET_M, CROWN_M = 0.06, 0.08
"""A person's box is that of what is more than FEET_M above the floor, and less than CROWN_M above the top [m]."""
FAR_OFF_M = 1.5
"""Pixels whose depth differs more from the axis' are not looked at; a camera that looks down steeply needs it [m]."""
UPPER_HALF_M, UPPER_ABOVE_M, UPPER_BELOW_M = 0.3, 0.05, 0.6
"""The upper-body box around a top: to each side, above and below [m]."""
STEP_M = 0.015
"""Grid of the pixels that are asked whether they are a person's, at their distance [m]."""
FULL_M = 2.0
"""Where no floor is known, a person's box reaches this far below the top [m]."""


@dataclass(frozen=True)
class FoundPerson:
    """One person who was found.

    Attributes:
        confidence: Probability that this is a person, 0..1.
        score: Logarithm of its odds.
        upper_body: Box around head and shoulders, clipped to the image [px].
        box: Box around what may be the person's pixels: within 0.45 m of the axis, above the floor [px].
        top: (3,) float64, the front of the highest visible part, the head's as a rule, camera frame [m].
        axis: (3,) float64, the middle of the person at the height of `top`, camera frame [m].
        distance: Of the axis from the camera, level [m].
        place: (3,) float64, where the axis meets the floor, floor frame (`Floor.T_floor_camera`) [m]; without a floor
            the axis at the camera's height, in a frame that lies in the camera.
        height: Of the top above the floor [m]; NaN without a floor.
    """

    confidence: float
    score: float
    upper_body: Box
    box: Box
    top: NDArray[np.float64]
    axis: NDArray[np.float64]
    distance: float
    place: NDArray[np.float64]
    height: float


@dataclass(frozen=True)
class Found:
    """What was found in an image.

    Attributes:
        people: The surest first.
        floor: The floor that was used; None if none was known or found.
    """

    people: tuple[FoundPerson, ...]
    floor: Floor | None

    def __iter__(self) -> Iterator[FoundPerson]:
        return iter(self.people)

    def __len__(self) -> int:
        return len(self.people)


class PeopleFinder:
    """Finds people in depth images.

    Attributes:
        model: What it has learned.
    """

    def __init__(self, model: FinderModel | None = None) -> None:
        """Takes a model, or the one that comes with the package."""
        self.model = read_finder() if model is None else model

    def find(
        self, depth: NDArray, camera: Pinhole, floor: Floor | FloorPrior | None = None, score: float | None = None
    ) -> Found:
        """Finds people in a depth image.

        Args:
            depth: (height, width) integers [mm], 0 = nothing.
            camera: Its intrinsics.
            floor: The floor, which is faster and surer for a camera that stands still; or what is known of it, or
                None, and it is found in the image. An image that shows none is searched without: then up is the
                image's up, and heights are not known.
            score: Logarithm of the odds from which a place counts as a person; None = the model's.

        Returns:
            The people.

        Raises:
            ValueError: The depth is no depth image.
        """
        image = check_depth(depth)
        known = floor if isinstance(floor, Floor) else _floor_or_none(image, camera, floor)
        view = view_of(image, camera, known)
        tops = contour(view)
        return Found(self.best(view, tops, tree_scores(view, tops, self.model.trees), known, score), known)

    def best(
        self, view: View, tops: NDArray[np.int32], scores: NDArray, floor: Floor | None, score: float | None = None
    ) -> tuple[FoundPerson, ...]:
        """The best-scored candidates that are far enough from better ones, as people, the surest first."""
        bound = self.model.score if score is None else score
        is_good = scores >= bound
        tops, scores = tops[is_good], scores[is_good]
        order = np.argsort(-scores, kind="stable")
        tops, scores = np.ascontiguousarray(tops[order]), scores[order]
        axes = _axes(view, tops)
        kept = np.flatnonzero(_keep_of(view, axes, APART_M))
        middle, highest = _gathered(view, axes, scores, kept)
        tops = tops[highest]
        boxes = _boxes(view, tops, middle)
        frame = (floor or _LEVEL).T_floor_camera
        return tuple(
            _person(view, tops[k], float(scores[i]), middle[k], boxes[k], frame, floor) for k, i in enumerate(kept)
        )


_LEVEL = Floor(np.array([0.0, -1.0, 0.0]), 0.0)


def _floor_or_none(image: NDArray[np.uint16], camera: Pinhole, prior: FloorPrior | None) -> Floor | None:
    try:
        return find_floor(image, camera, prior)
    except NoFloorError:
        if prior is not None and prior.pitch is not None and prior.height is not None:
            return Floor.of_camera(prior.pitch, prior.height)
        return None


def _person(
    view: View,
    top: NDArray[np.int32],
    score: float,
    axis: NDArray,
    box: NDArray,
    frame: NDArray,
    floor: Floor | None,
) -> FoundPerson:
    at = top_at(view, int(top[0]), int(top[1]), int(top[2]))
    place = frame[:3, :3] @ axis + frame[:3, 3]
    height = place[2] if floor is not None else np.nan
    point = np.array([at.x, at.y, at.z])
    return FoundPerson(
        confidence=float(1.0 / (1.0 + np.exp(-np.clip(score, -50, 50)))),
        score=score,
        upper_body=_upper_box(view, point, np.array([at.ahead_x, at.ahead_y, at.ahead_z])),
        box=(float(box[0]), float(box[1]), float(box[2]), float(box[3])),
        top=point,
        axis=axis,
        distance=float(at.distance + INSIDE_M),
        place=np.array([place[0], place[1], 0.0]),
        height=float(height),
    )


def _upper_box(view: View, point: NDArray, ahead: NDArray) -> Box:
    side = np.cross(ahead, view.up)
    corners = point + np.array(
        [s * UPPER_HALF_M * side + b * view.up for s in (-1, 1) for b in (UPPER_ABOVE_M, -UPPER_BELOW_M)]
    )
    z = np.maximum(corners[:, 2], 0.05)
    height, width = view.depth.shape
    u = np.clip(view.fx * corners[:, 0] / z + view.cx, 0, width)
    v = np.clip(view.fy * corners[:, 1] / z + view.cy, 0, height)
    return float(u.min()), float(v.min()), float(u.max()), float(v.max())


@njit(cache=True, nogil=True)
def _axes(view, tops):  # type: ignore[no-untyped-def]
    """(n, 3) float64 points on the axes of people at the height of their tops, camera frame [m]."""
    out = np.empty((len(tops), 3))
    for i in range(len(tops)):
        top = top_at(view, tops[i, 0], tops[i, 1], tops[i, 2])
        out[i, 0] = top.x + INSIDE_M * top.ahead_x
        out[i, 1] = top.y + INSIDE_M * top.ahead_y
        out[i, 2] = top.z + INSIDE_M * top.ahead_z
    return out


@njit(cache=True, nogil=True)
def _level(view, dx, dy, dz):  # type: ignore[no-untyped-def]
    """Squared level length of a vector, and its rise [m]."""
    rise = dx * view.up[0] + dy * view.up[1] + dz * view.up[2]
    return dx * dx + dy * dy + dz * dz - rise * rise, rise


@njit(cache=True, nogil=True)
def _keep_of(view, axes, apart):  # type: ignore[no-untyped-def]
    """(n,) bool; of points in falling order of score those with no better one that was kept nearby."""
    kept = np.zeros(len(axes), np.bool_)
    for i in range(len(axes)):
        is_free = True
        for j in range(i):
            if kept[j]:
                d = axes[i] - axes[j]
                square, _ = _level(view, d[0], d[1], d[2])
                if square < apart * apart:
                    is_free = False
                    break
        kept[i] = is_free
    return kept


@njit(cache=True, nogil=True)
def _gathered(view, axes, scores, kept):  # type: ignore[no-untyped-def]
    """Axes out of all good candidates near each best one, weighted by their odds, and the highest of the better ones.

    Returns:
        (n, 3) float64 points at the height of the highest, camera frame [m]; (n,) int64 numbers of the highest.
    """
    middle, highest = np.zeros((len(kept), 3)), kept.copy()
    for k in range(len(kept)):
        best = kept[k]
        total, top = 0.0, 0.0
        for i in range(len(axes)):
            d = axes[i] - axes[best]
            square, rise = _level(view, d[0], d[1], d[2])
            if square > NEAR_M * NEAR_M or abs(rise) > NEAR_M:
                continue
            weight = math.exp(scores[i] - scores[best])
            total += weight
            for c in range(3):
                middle[k, c] += weight * (d[c] - rise * view.up[c])
            if rise > top and scores[i] > scores[best] - BETTER:
                top = rise
                highest[k] = i
        for c in range(3):
            middle[k, c] = axes[best, c] + middle[k, c] / total + top * view.up[c]
    return middle, highest


@njit(cache=True, nogil=True)
def _boxes(view, tops, axes):  # type: ignore[no-untyped-def]
    """(n, 4) int64 boxes (left, top, right, bottom) of what lies around each axis and nearer to no other."""
    depth, fx, fy, cx, cy, ground = view.depth, view.fx, view.fy, view.cx, view.cy, view.height
    ux, uy, uz = view.up[0], view.up[1], view.up[2]
    rows, columns = depth.shape
    out = np.empty((len(axes), 4), np.int64)
    for i in range(len(axes)):
        ax, ay, az = axes[i, 0], axes[i, 1], axes[i, 2]
        u, v, at = tops[i, 0], tops[i, 1], max(0.2, tops[i, 2] * 1e-3)
        reach, step = int(1.6 * fx * BODY_RADIUS_M / at), max(1, int(fx * STEP_M / at))
        left, up, right, down = u, v, u + 1, v + 1
        for row in range(max(0, v - int(0.3 * fy / at)), min(rows, v + int(1.6 * fy * FULL_M / at)), step):
            for column in range(max(0, u - reach), min(columns, u + reach + 1), step):
                z = depth[row, column] * 1e-3
                if z == 0.0 or abs(z - az) > FAR_OFF_M:
                    continue
                x, y = (column - cx) / fx * z, (row - cy) / fy * z
                rise = (x - ax) * ux + (y - ay) * uy + (z - az) * uz
                square = (x - ax) ** 2 + (y - ay) ** 2 + (z - az) ** 2 - rise * rise
                # Without a floor the height is NaN, and the last comparison false.
                if square > BODY_RADIUS_M**2 or rise > CROWN_M or rise < -FULL_M:
                    continue
                if x * ux + y * uy + z * uz + ground < FEET_M or _is_nearer(axes, i, x, y, z, ux, uy, uz, square):
                    continue
                left, right = min(left, column), max(right, column + step)
                up, down = min(up, row), max(down, row + step)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = left, up, min(right, columns), min(down, rows)
    return out


@njit(cache=True, nogil=True)
def _is_nearer(axes, i, x, y, z, ux, uy, uz, square):  # type: ignore[no-untyped-def]
    """Whether a point is nearer to another axis than to axis i, whose squared level distance is given."""
    for j in range(len(axes)):
        if j != i:
            dx, dy, dz = x - axes[j, 0], y - axes[j, 1], z - axes[j, 2]
            rise = dx * ux + dy * uy + dz * uz
            if dx * dx + dy * dy + dz * dz - rise * rise < square:
                return True
    return False
