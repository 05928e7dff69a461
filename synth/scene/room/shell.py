"""Builds a room from its spec: floor, ceiling, walls with their openings, and every piece in its place."""

import functools
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from synth.camera import Camera
from synth.frame import ObjectRecord
from synth.geometry import transform_points, translation
from synth.occluders.background import catalogue
from synth.occluders.kit.parts import Part, filled, occluder
from synth.occluders.kit.shapes import box
from synth.occluders.kit.spec import Spec
from synth.occluders.model import BOX, Occluder
from synth.scene.placement import PlacedObject, record_of
from synth.scene.room.occupancy import CELL, Occupancy
from synth.scene.room.spec import BEYOND, N_WALLS, Opening, RoomSpec

SLAB = 0.3
"""Thickness of floor and ceiling [m]."""
TILE = 4.0
"""Longest side of a floor's or ceiling's tile [m]."""
FRAME = 0.06
"""Width of a window's frame and bars [m]."""
LEAF = 0.04
"""Thickness of a door's leaf [m]."""
RECESS = 0.05
"""A shut door lies this far behind the wall's face [m]."""
FURNITURE_ROOM = 0.1
"""People and what belongs to them keep this far from the room's furniture, seen from above [m]."""
OVERHEAD = 2.1
"""What hangs higher takes no floor [m]."""
PANE = 0.8
"""A window has a bar about every so many metres."""


@dataclass(frozen=True)
class BuiltRoom:
    """A room that stands.

    Attributes:
        room_id: Identifier in the corpus.
        spec: What it was made from.
        items: Surfaces first (floor, walls, ceiling), then the pieces in the spec's order; room frame.
        n_surfaces: How many of the items are surfaces.
        plain: The spec as plain JSON values.
        records: What a frame stores of each item that it does not show.
    """

    room_id: str
    spec: RoomSpec
    items: tuple[PlacedObject, ...]
    n_surfaces: int
    plain: dict[str, object]
    records: tuple[ObjectRecord, ...]

    @functools.cached_property
    def _balls(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(n, 3) centres of balls round the items, room frame, and (n,) their radii [m]."""
        points = [item.world_surface() for item in self.items]
        ends = np.array([(p.min(axis=0), p.max(axis=0)) for p in points])
        return ends.mean(axis=1), 0.5 * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)

    def may_show(self, T_camera_room: NDArray[np.float64], camera: Camera) -> NDArray[np.bool_]:
        """(n,) whether the ball round each item reaches into a camera's field of view."""
        centres, radius = self._balls
        x, y, z = transform_points(T_camera_room, centres).T
        is_near = z > -radius
        for f, c, side in (
            (camera.fx, camera.cx + 1.0, x),
            (camera.fx, camera.width - camera.cx, -x),
            (camera.fy, camera.cy + 1.0, y),
            (camera.fy, camera.height - camera.cy, -y),
        ):
            is_near &= f * side + c * z > -radius * np.hypot(f, c)
        return is_near


def build_room(spec: RoomSpec, room_id: str) -> BuiltRoom:
    """Builds a room; no randomness.

    Args:
        spec: The room.
        room_id: Its identifier; those of its parts begin with it.
    """
    shell = [("floor", make_floor(spec), np.eye(4))]
    shell += [(f"wall_{k}", make_wall(spec, k), spec.wall_pose(k)) for k in range(N_WALLS) if spec.walls[k]]
    shell.append(("ceiling", make_ceiling(spec), translation(0.0, 0.0, spec.height)))
    items = [
        PlacedObject(f"{room_id}/{name}", {"kind": name}, made, T, made.mesh.vertices.astype(np.float64))
        for name, made, T in shell
    ]
    n_surfaces = len(items)
    for k, piece in enumerate(spec.pieces):
        made = made_piece(catalogue.from_plain(piece.spec))
        stands_on = piece.stands_on + n_surfaces if piece.stands_on >= 0 else -1
        spec_id = f"{room_id}/{piece.spec['kind']}_{k}"
        points = made.mesh.vertices.astype(np.float64)
        items.append(PlacedObject(spec_id, piece.spec, made, piece.pose(), points, stands_on=stands_on))
    records = tuple(record_of(item, k, 0.0) for k, item in enumerate(items, start=1))
    return BuiltRoom(room_id, spec, tuple(items), n_surfaces, spec.plain(), records)


@functools.lru_cache(maxsize=64)
def made_piece(spec: Spec) -> Occluder:
    """What a spec describes; kept, because rooms repeat their pieces."""
    return catalogue.make(spec)


@functools.lru_cache(maxsize=64)
def box_of(spec: Spec) -> NDArray[np.float64]:
    """(8, 3) corners of the box round what a spec describes, its own frame [m]."""
    vertices = made_piece(spec).mesh.vertices
    ends = np.stack([vertices.min(axis=0), vertices.max(axis=0)]).astype(np.float64)
    return np.array([(ends[i, 0], ends[j, 1], ends[k, 2]) for i in (0, 1) for j in (0, 1) for k in (0, 1)])


def taken_floor(room: BuiltRoom) -> Occupancy:
    """The floor that the pieces take, each with the room that people leave round it."""
    floor = Occupancy(room.spec.length, room.spec.width)
    for item in room.items[room.n_surfaces :]:
        vertices = transform_points(item.T_world_object, item.occluder.mesh.vertices)
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        if low[2] > OVERHEAD:
            continue
        axes = [np.linspace(low[k], high[k], 2 + int((high[k] - low[k]) / CELL)) for k in (0, 1)]
        floor.take(np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2), FURNITURE_ROOM)
    return floor


def make_floor(spec: RoomSpec) -> Occluder:
    """The floor: a slab below z = 0 that ends at the outer faces of the walls, and goes on where there is none."""
    return occluder("floor", [_sheet(_extent(spec), upwards=True)])


def make_ceiling(spec: RoomSpec) -> Occluder:
    """The ceiling, its underside at z = 0."""
    return occluder("ceiling", [_sheet(_extent(spec), upwards=False)])


def _extent(spec: RoomSpec) -> tuple[float, float, float, float]:
    """Least x, greatest x, least y, greatest y of floor and ceiling [m]."""
    east, north, west, south = (spec.thickness if is_there else BEYOND for is_there in spec.walls)
    x, y = spec.length / 2, spec.width / 2
    return -x - west, x + east, -y - south, y + north


def _sheet(extent: tuple[float, float, float, float], upwards: bool) -> Part:
    """A level sheet of tiles at z = 0, and the slab behind it as a solid.

    Tiles bound what rounding can do to the depth of a very long triangle.
    """
    left, right, near, far = extent
    xs, ys = (
        np.linspace(low, high, 1 + int(np.ceil((high - low) / TILE))) for low, high in ((left, right), (near, far))
    )
    x, y = np.meshgrid(xs, ys, indexing="ij")
    vertices = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    i, j = (index.ravel() for index in np.meshgrid(np.arange(len(xs) - 1), np.arange(len(ys) - 1), indexing="ij"))
    a = i * len(ys) + j
    b, c, d = a + len(ys), a + len(ys) + 1, a + 1
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]).astype(np.int32)
    if not upwards:
        faces = np.ascontiguousarray(faces[:, ::-1])
    middle = translation((left + right) / 2, (near + far) / 2, -SLAB / 2 if upwards else SLAB / 2)
    row = (BOX, middle, ((right - left) / 2, (far - near) / 2, SLAB / 2))
    return filled((vertices, faces), [row], is_closed=False)


def make_wall(spec: RoomSpec, wall: int) -> Occluder:
    """A wall with its doors and windows; its inner face is x = 0, y goes along it.

    The wall is cut into blocks by a grid through the edges of all openings, so that no block's corner lies on
    another block's side. Windows keep frame and bars, shut doors their leaf.
    """
    openings = [item for item in spec.openings if item.wall == wall]
    half = spec.wall_length(wall) / 2 + (spec.thickness if wall % 2 == 0 else 0.0)
    ys = sorted({-half, half, *(item.at + side * item.width / 2 for item in openings for side in (-1, 1))})
    zs = sorted({0.0, spec.height, *(z for item in openings for z in (item.bottom, item.top))})
    parts = [
        _block(spec.thickness, (y0, y1), (z0, z1))
        for y0, y1 in pairwise(ys)
        for z0, z1 in pairwise(zs)
        if not any(_is_in(item, (y0 + y1) / 2, (z0 + z1) / 2) for item in openings)
    ]
    for item in openings:
        if item.filling == "glass":
            parts += _window_frame(item, spec.thickness)
        elif item.filling == "leaf":
            leaf = box(LEAF, item.width, item.top - item.bottom, 0.002)
            parts.append(leaf.at(-RECESS - LEAF / 2, item.at, (item.bottom + item.top) / 2))
    return occluder("wall", parts)


def _is_in(item: Opening, y: float, z: float) -> bool:
    return abs(y - item.at) < item.width / 2 and item.bottom < z < item.top


def _block(thickness: float, y: tuple[float, float], z: tuple[float, float]) -> Part:
    """A block of wall behind x = 0, with sharp edges: a chamfer would be a groove in the wall."""
    corner = np.array([(a, b, c) for a in (0, 1) for b in (0, 1) for c in (0, 1)], dtype=np.float64)
    low, high = np.array([-thickness, y[0], z[0]]), np.array([0.0, y[1], z[1]])
    half = (high - low) / 2
    T = translation(*((low + high) / 2).tolist())
    return filled((low + corner * (high - low), _CUBE), [(BOX, T, (half[0], half[1], half[2]))])


_CUBE = np.array(
    [
        (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
        (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
    ],
    dtype=np.int32,
)  # fmt: skip
"""Outward faces of a cube whose corner number is 4 x + 2 y + z."""


def _window_frame(item: Opening, thickness: float) -> list[Part]:
    """Frame and bars in the middle of the wall's thickness."""
    x, depth = -thickness / 2, min(0.07, 0.8 * thickness)
    low, high = item.at - item.width / 2, item.at + item.width / 2
    height = item.top - item.bottom
    n_panes = max(1, round(item.width / PANE))
    places = [low + FRAME / 2, *np.linspace(low, high, n_panes + 1)[1:-1].tolist(), high - FRAME / 2]
    parts = [box(depth, FRAME, height, 0.003).at(x, y, item.bottom + height / 2) for y in places]
    for z in (item.bottom + FRAME / 2, item.top - FRAME / 2):
        parts.append(box(depth, item.width, FRAME, 0.003).at(x, item.at, z))
    return parts
