"""The plan of a room from above: walls with their openings, what stands there, who is where, and the camera."""

import functools
import json
import math
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from pipelines.drawing import palette
from pipelines.drawing.captions import write_words
from pipelines.drawing.palette import Picture
from synth.frame import ObjectRecord, RoomFrame
from synth.geometry import transform_points
from synth.occluders.background import catalogue
from synth.scene.room.spec import RoomSpec
from synth.vocabulary import SCENE_CODE

MARGIN = 0.6
"""Of floor around the room that the plan shows [m]."""
PERSON_RADIUS = 0.22
"""Of the disc that stands for a person [m]."""
VIEW_LENGTH = 1.2
"""Of the lines that show the camera's field of view [m]."""
_SURFACES = ("floor", "wall", "ceiling")


def room_plan(frame: RoomFrame, width: int, height: int, paths: Sequence[NDArray[np.float64]] = ()) -> Picture:
    """(height, width, 3) the room from above; x to the right, y upwards.

    Things are drawn as the convex hull of their floor plan, windows thin, doors as gaps, everybody as a disc with
    a line to where they face, the camera as a triangle.

    Args:
        frame: The scene.
        width: Of the picture [px].
        height: Of the picture [px].
        paths: (n, 2) where each person goes, in order of number, world frame [m].
    """
    spec = RoomSpec.from_plain(frame.info.room)
    out = np.full((height, width, 3), palette.PAPER, np.uint8)
    scale = min(width / (spec.length + 2 * MARGIN), height / (spec.width + 2 * MARGIN))

    def places(points: NDArray[np.float64]) -> NDArray[np.int32]:
        x, y = width / 2 + scale * points[:, 0], height / 2 - scale * points[:, 1]
        return np.round(np.stack([x, y], axis=1)).astype(np.int32)

    half = np.array([spec.length, spec.width]) / 2
    corners = places(np.array([-half, half]))
    cv2.rectangle(out, corners[0].tolist(), corners[1].tolist(), palette.NO_RETURN, -1)
    _draw_walls(out, spec, places, max(2, round(0.12 * scale)))
    for item in frame.info.objects:
        if item.class_name not in _SURFACES:
            hull = cv2.convexHull(places(_plan_of(item))[:, None])
            colour = palette.SCENE_COLOURS[SCENE_CODE[item.class_name]].tolist()
            cv2.fillConvexPoly(out, hull, [round(0.7 * value) for value in colour])
            cv2.polylines(out, [hull], True, colour, 1, cv2.LINE_AA)
    for k, path in enumerate(paths, start=1):
        drawn = places(np.column_stack([path, np.zeros(len(path))]))
        cv2.polylines(out, [drawn], False, palette.PERSON_COLOURS[k].tolist(), 1, cv2.LINE_AA)
    for k, view in enumerate(frame.people, start=1):
        T = view.T_world_root
        at, ahead = places(np.stack([T[:3, 3], T[:3, 3] + 0.4 * T[:3, 0]]))
        colour = palette.PERSON_COLOURS[k].tolist()
        cv2.circle(out, at.tolist(), max(3, round(PERSON_RADIUS * scale)), colour, -1, cv2.LINE_AA)
        cv2.line(out, at.tolist(), ahead.tolist(), colour, 2, cv2.LINE_AA)
        write_words(out, str(k), (int(at[0]) - 4, int(at[1]) + 4), palette.PAPER)
    _draw_camera(out, frame, places)
    return out


def _draw_walls(out: Picture, spec: RoomSpec, places, thick: int) -> None:  # type: ignore[no-untyped-def]
    for wall in range(4):
        if not spec.walls[wall]:
            continue
        T, end = spec.wall_pose(wall), spec.wall_length(wall) / 2
        _draw_along(out, places, T, (-end, end), palette.FAINT, thick)
        for item in spec.openings:
            if item.wall == wall:
                colour = {"glass": palette.SKY_BLUE, "leaf": palette.OBJECT_BEHIND, "open": palette.PAPER}
                span = (item.at - item.width / 2, item.at + item.width / 2)
                _draw_along(out, places, T, span, colour[item.filling], thick)


def _draw_along(out, places, T, span, colour, thick) -> None:  # type: ignore[no-untyped-def]
    """A line along a wall between two places of its own y."""
    ends = places(transform_points(T, np.array([(0.0, y, 0.0) for y in span])))
    cv2.line(out, ends[0].tolist(), ends[1].tolist(), colour, thick)


def _draw_camera(out: Picture, frame: RoomFrame, places) -> None:  # type: ignore[no-untyped-def]
    T, camera = frame.T_world_camera, frame.camera
    heading = math.atan2(T[1, 2], T[0, 2])
    left, right = math.atan(camera.cx / camera.fx), -math.atan((camera.width - 1 - camera.cx) / camera.fx)
    rays = [(math.cos(heading + turn), math.sin(heading + turn)) for turn in (left, right)]
    tips = T[:2, 3] + VIEW_LENGTH * np.array(rays)
    triangle = places(np.concatenate([T[None, :2, 3], tips]))
    cv2.polylines(out, [triangle], True, palette.VERMILION, 1, cv2.LINE_AA)
    cv2.circle(out, triangle[0].tolist(), 3, palette.VERMILION, -1, cv2.LINE_AA)


def _plan_of(item: ObjectRecord) -> NDArray[np.float64]:
    """(n, 3) corners of a thing, world frame [m]; of an imported one, whose mesh is not here, a small square."""
    return transform_points(np.array(item.T_world_object), _vertices(json.dumps(item.spec)))


@functools.lru_cache(maxsize=128)
def _vertices(spec: str) -> NDArray[np.float64]:
    try:
        mesh = catalogue.make(catalogue.from_plain(json.loads(spec))).mesh
    except ValueError:
        return 0.15 * np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], dtype=np.float64)
    hull = cv2.convexHull(np.ascontiguousarray(mesh.vertices[:, :2]))[:, 0]
    return np.column_stack([hull, np.zeros(len(hull))]).astype(np.float64)
