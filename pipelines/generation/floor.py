"""The floor that recorded people stand on, found from the lowest points of all frames."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.corpus import Corpus
from pipelines.errors import UserError
from pipelines.spread import first_to_last
from synth.frame import Frame
from synth.geometry import transform_points

MAX_FRAMES = 400
"""Frames looked at, evenly spread."""
LOWEST_SHARE = 0.003
"""Share of a person's pixels that are their lowest points; the mean of these counts, at least of four."""
MIN_SPREAD = 0.4
"""Feet must be spread over this way along an axis, 5th to 95th percentile, to tell a slope along it [m]."""
MIN_FRAMES = 20
"""Fewer frames tell no slope."""
BAND = 0.02
"""A frame whose lowest points are higher above the floor than this has no foot on it [m]."""
MAX_SLOPE = np.tan(np.radians(30.0))
"""Steeper floors are taken for a wrong axis."""
N_ROUNDS = 4
"""The lowest points are looked for again along the floor's normal, so often."""


@dataclass(frozen=True)
class Floor:
    """A plane z = height + slope_x x + slope_y y in the recording's world.

    Attributes:
        height: At the world's origin, which is beneath the camera [m].
        slope_x: Along the camera's view.
        slope_y: To its left.
        source: "layout" or "feet".
        n_frames: Frames whose lowest points lie on it; 0 if the layout says where it is.
        deviation: Root mean square distance of these from it [m].
    """

    height: float = 0.0
    slope_x: float = 0.0
    slope_y: float = 0.0
    source: str = "layout"
    n_frames: int = 0
    deviation: float = 0.0

    def transform(self) -> NDArray[np.float64]:
        """(4, 4) T_floor_world: to a world whose ground plane z = 0 is the floor, turned as little as can be."""
        up = np.array([-self.slope_x, -self.slope_y, 1.0])
        up /= np.linalg.norm(up)
        x = np.array([1.0, 0.0, 0.0]) - up[0] * up
        x /= np.linalg.norm(x)
        T = np.eye(4)
        T[:3, :3] = np.stack([x, np.cross(up, x), up])
        T[2, 3] = -up[2] * self.height
        return T


def find_floor(corpus: Corpus) -> Floor:
    """The floor of a recorded corpus: z = 0 where its layout gives the camera's height, else found from the feet.

    Args:
        corpus: Made by `import depth`.

    Raises:
        UserError: The feet are outside all images, or lie on no floor that a camera could stand on.
    """
    if corpus.header.config["import"]["layout"]["camera"]["height_m"] > 0.0:
        return Floor()
    places = first_to_last(len(corpus), MAX_FRAMES)
    people = [points for i in corpus.indices[np.unique(places)] if len(points := _standing_points(corpus[int(i)]))]
    if not people:
        raise UserError(
            f"{corpus.path} does not show where the floor is: no frame shows a person down to the feet; give the "
            "camera's height_m and tilt_deg in the layout"
        )
    floor = Floor()
    for _ in range(N_ROUNDS):
        up = np.array([-floor.slope_x, -floor.slope_y, 1.0])
        floor = fit_floor(np.stack([_lowest(points, up) for points in people]))
    if max(abs(floor.slope_x), abs(floor.slope_y)) > MAX_SLOPE or not floor.height < 0.0:
        raise UserError(
            f"{corpus.path} does not show where the floor is: the lowest points lie {-floor.height:.2f} m "
            f"below the camera, sloping by {floor.slope_x:.2f} and {floor.slope_y:.2f}; give the "
            "camera's height_m and tilt_deg in the layout"
        )
    return floor


def _standing_points(frame: Frame) -> NDArray[np.float64]:
    """(n, 3) the person's points in the recording's world [m]; none where the image cuts the person off below."""
    if not frame.body_depth.any() or frame.body_depth[-1].any():
        return np.empty((0, 3))
    v, u = np.nonzero(frame.body_depth)
    points = frame.camera.backproject(np.stack([u, v], axis=1), frame.body_depth[v, u] * 1e-3)
    return transform_points(frame.T_world_camera, points)


def _lowest(points: NDArray[np.float64], up: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,) mean of a person's lowest points."""
    n = min(len(points), max(4, round(LOWEST_SHARE * len(points))))
    return points[np.argpartition(points @ up, n - 1)[:n]].mean(axis=0)


def fit_floor(lowest: NDArray[np.float64]) -> Floor:
    """A plane through the lowest points of frames, those well above it left out: there no foot is on the floor.

    Slopes are found only along axes that the points are spread over. Feet in the air lie above the floor, so only
    what lies above is left out, until nothing more does.

    Args:
        lowest: (n, 3) a point a frame, z up [m].
    """
    spread = np.percentile(lowest[:, :2], 95, axis=0) - np.percentile(lowest[:, :2], 5, axis=0)
    is_free = (spread >= MIN_SPREAD) & (len(lowest) >= MIN_FRAMES)
    middle = lowest[:, :2].mean(axis=0)
    terms = np.concatenate([np.ones((len(lowest), 1)), (lowest[:, :2] - middle) * is_free], axis=1)
    is_on = lowest[:, 2] <= np.median(lowest[:, 2]) + BAND
    for _ in range(len(lowest)):
        plane = np.linalg.lstsq(terms[is_on], lowest[is_on, 2], rcond=None)[0]
        above = lowest[:, 2] - terms @ plane
        kept = above <= BAND
        if (kept == is_on).all():
            break
        is_on = kept
    slope = plane[1:] * is_free
    deviation = float(np.sqrt((above[is_on] ** 2).mean()))
    height, slope_x, slope_y = (round(float(v), 6) for v in (plane[0] - slope @ middle, *slope))
    return Floor(height, slope_x, slope_y, "feet", int(is_on.sum()), round(deviation, 6))
