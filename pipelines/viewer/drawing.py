"""A moment as nodes of a viser scene: cloud, people, skeletons, arrows, and the votes for a joint."""

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
import trimesh
from numpy.typing import NDArray

from forests.estimate import JointVotes
from pipelines.online.messages import TrackedPerson, TrackSkeleton
from pipelines.online.ros.camera import cloud_points
from pipelines.online.ros.markers import bone_points, track_colour
from pipelines.viewer.moments import Arrow, Labels, Moment

DEPTH = "depth"
"""Name of the colours that tell how far points are."""
CLOUD_STEP = 2
"""Every so many rows and columns of the image are shown."""
POINT_M = 0.006
"""Size of a point: small enough that skeletons are seen through the people [m]."""
HIDDEN = 0.5
"""Joints that are hidden with at least this probability are drawn hollow."""
JOINT_M, HOLLOW_M = 0.035, 0.05
"""Radius of a joint that is seen, and of one that is hidden [m]."""
ARROW_M = 0.5
"""Length of an arrow [m]."""
TYPICAL_M = 1.7
"""Height of whom nothing tells how tall they are [m]."""
WALKS_MPS = 0.2
"""Who is slower gets no line that shows where they go [m/s]."""
VOTE_COLOUR, HIDER_COLOUR, MODE_COLOUR = (255, 60, 200), (255, 190, 40), (255, 255, 255)
_BALLS = {False: trimesh.creation.icosphere(subdivisions=1), True: trimesh.creation.icosphere(subdivisions=0)}
"""Solid ones, and hollow ones, of which few edges are drawn."""


def draw_cloud(scene: Any, moment: Moment, labels: Labels | None) -> None:
    """Shows the points of the image, in the colours of labels or by their distance."""
    frame = moment.frame
    if frame is None:
        scene.remove_by_name("/cloud")
        return
    points = cloud_points(frame, CLOUD_STEP)
    colours = distance_colours(points[:, 2])
    if labels is not None:
        is_there = frame.depth[::CLOUD_STEP, ::CLOUD_STEP] > 0
        codes = labels.codes[::CLOUD_STEP, ::CLOUD_STEP][is_there]
        colours = np.where((codes > 0)[:, None], labels.colours[codes], colours // 2).astype(np.uint8)
    T = moment.T_floor_camera
    world = (points @ T[:3, :3].T + T[:3, 3]).astype(np.float32)
    scene.add_point_cloud("/cloud", world, colours, point_size=POINT_M, point_shading="flat", precision="float32")


def distance_colours(z: NDArray[np.floating]) -> NDArray[np.uint8]:
    """(n, 3) uint8 greys of depths (n,) [m]: near is light."""
    grey = (255 * np.clip(0.9 - z / 9.0, 0.25, 0.85)).astype(np.uint8)
    return np.repeat(grey[:, None], 3, axis=1)


def draw_people(scene: Any, persons: Sequence[TrackedPerson], said: dict[int, str]) -> None:
    """Shows everybody as a pole with a number, and where those go who walk.

    Args:
        scene: Of the page.
        persons: Who is there.
        said: What stands beside the number, by track.
    """
    lines, colours = [], []
    scene.remove_by_name("/numbers")
    for one in persons:
        top = TYPICAL_M if np.isnan(one.height) else one.height
        x, y = one.place
        lines.append([(x, y, 0.0), (x, y, top)])
        colours.append(colour_of(one.track_id))
        if np.linalg.norm(one.velocity) > WALKS_MPS:
            lines.append([(x, y, 0.02), (x + one.velocity[0], y + one.velocity[1], 0.02)])
            colours.append(colour_of(one.track_id))
        text = f"{one.track_id}  {said.get(one.track_id, '')}".strip()
        scene.add_label(f"/numbers/{one.track_id}", text, position=(x, y, top + 0.12), anchor="bottom-center")
    _lines(scene, "/people", lines, colours, 2.0)


def draw_skeletons(scene: Any, skeletons: Sequence[TrackSkeleton]) -> None:
    """Shows bones as lines and joints as balls, of which those that are hidden are hollow."""
    bones, bone_colours = [], []
    balls: dict[bool, list[tuple[NDArray[np.float32], NDArray[np.uint8]]]] = {False: [], True: []}
    for one in skeletons:
        colour = colour_of(one.track_id)
        ends = bone_points(one)
        bones += ends
        bone_colours += [colour] * len(ends)
        for xyz, hidden in zip(one.positions, one.hidden, strict=True):
            if np.isfinite(xyz).all():
                balls[bool(hidden >= HIDDEN)].append((xyz, colour))
    _lines(scene, "/bones", bones, bone_colours, 4.0)
    for is_hollow, placed in balls.items():
        name = "/joints/hidden" if is_hollow else "/joints/seen"
        places, colours = [place for place, _ in placed], [colour for _, colour in placed]
        radius = HOLLOW_M if is_hollow else JOINT_M
        _balls(scene, name, places, colours, np.full(len(placed), radius), is_hollow)


def draw_arrows(scene: Any, persons: Sequence[TrackedPerson], arrows: Sequence[Arrow]) -> None:
    """Shows which way bodies face, at the height of the hips, and where heads look."""
    at = {one.track_id: one for one in persons}
    ends, colours = [], []
    for arrow in arrows:
        if arrow.track_id not in at:
            continue
        person = at[arrow.track_id]
        top = TYPICAL_M if np.isnan(person.height) else person.height
        begin = np.array([*person.place, top - 0.15 if arrow.region == "head" else 0.55 * top])
        ends.append([begin, begin + ARROW_M * np.array([*arrow.direction, 0.0])])
        colours.append(colour_of(arrow.track_id))
    if not ends:
        scene.remove_by_name("/arrows")
        return
    scene.add_arrows("/arrows", np.array(ends, np.float32), np.array(colours, np.uint8))


def draw_votes(scene: Any, votes: JointVotes | None, T_floor_camera: NDArray[np.float64]) -> None:
    """Shows votes as a cloud, the heavier the brighter, and their modes as hollow balls, the surer the larger."""
    if votes is None or not len(votes.points):
        scene.remove_by_name("/votes")
        scene.remove_by_name("/modes")
        return
    heavy = np.clip(votes.weight / np.percentile(votes.weight, 95), 0.15, 1.0)[:, None]
    colours = np.where(votes.is_hider[:, None], np.array(HIDER_COLOUR), np.array(VOTE_COLOUR)) * heavy
    scene.add_point_cloud(
        "/votes",
        _placed(votes.points, T_floor_camera),
        colours.astype(np.uint8),
        point_size=0.014,
        point_shape="circle",
        point_shading="flat",
        precision="float32",
    )
    share = votes.share / max(float(votes.share.max(initial=0.0)), 1e-9)
    places = list(_placed(votes.modes, T_floor_camera))
    _balls(
        scene,
        "/modes",
        places,
        [np.array(MODE_COLOUR, np.uint8)] * len(places),
        0.03 + 0.05 * np.sqrt(share),
        True,
    )


def hide(scene: Any, *names: str) -> None:
    """Takes nodes away."""
    for name in names:
        scene.remove_by_name(name)


def colour_of(track_id: int) -> NDArray[np.uint8]:
    """(3,) uint8 red, green and blue of a track."""
    return (255 * np.array(track_colour(track_id))).astype(np.uint8)


def legend(labels: Labels) -> NDArray[np.uint8]:
    """(24, width, 3) uint8: the colours that occur in the labels, side by side."""
    codes = np.unique(labels.codes)
    patches = labels.colours[codes[codes > 0]]
    if not len(patches):
        return np.zeros((24, 240, 3), np.uint8)
    return np.asarray(cv2.resize(patches[None], (240, 24), interpolation=cv2.INTER_NEAREST), np.uint8)


def _placed(points: NDArray[np.float32], T_floor_camera: NDArray[np.float64]) -> NDArray[np.float32]:
    return np.asarray(points @ T_floor_camera[:3, :3].T + T_floor_camera[:3, 3], np.float32)


def _lines(scene: Any, name: str, lines: Sequence[Any], colours: Sequence[Any], width: float) -> None:
    if not lines:
        scene.remove_by_name(name)
        return
    both = np.repeat(np.array(colours, np.uint8)[:, None], 2, axis=1)
    scene.add_line_segments(name, np.array(lines, np.float32), both, thickness=width, thickness_units="screen")


def _balls(
    scene: Any,
    name: str,
    places: Sequence[Any],
    colours: Sequence[Any],
    radii: NDArray[np.floating],
    is_hollow: bool,
) -> None:
    if not len(places):
        scene.remove_by_name(name)
        return
    ball = _BALLS[is_hollow]
    scene.add_batched_meshes_simple(
        name,
        ball.vertices.astype(np.float32),
        ball.faces.astype(np.uint32),
        np.tile([1.0, 0.0, 0.0, 0.0], (len(places), 1)),
        np.array(places, np.float32),
        batched_scales=np.asarray(radii, np.float32),
        batched_colors=np.array(colours, np.uint8),
        wireframe=is_hollow,
        lod="off",
        cast_shadow=False,
    )
