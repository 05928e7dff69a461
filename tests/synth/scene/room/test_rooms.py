import functools
import json
from dataclasses import replace

import numpy as np
import pytest

from synth.camera import Camera
from synth.geometry import inverse, look_at, transform_points
from synth.render.records import RenderObject
from synth.render.rooms import RoomRenderer
from synth.scene.config import SceneConfig
from synth.scene.placement import is_free_of
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights
from synth.scene.room.furnish import sample_room
from synth.scene.room.occupancy import CELL, Occupancy, footprint
from synth.scene.room.shell import build_room
from synth.scene.room.spec import Opening, RoomSpec
from synth.vocabulary import SCENE_CODE

CAMERA = Camera(160, 120, 110.0, 110.0, 79.5, 59.5)
KINDS = ("living", "office", "hall")
BARE = RoomSpec("living", 5.0, 4.0, 2.5, 0.2, (True, True, True, True))


@functools.cache
def rooms(kind, n=3):
    specs = [sample_room(kind, RoomConfig(), np.random.default_rng([7, k])) for k in range(n)]
    return [build_room(spec, f"room/{k}") for k, spec in enumerate(specs)]


def drawn(room, eye, target, camera=CAMERA):
    T = look_at(eye, target)
    things = [
        RenderObject(item.occluder.mesh, SCENE_CODE[item.occluder.class_name], k, item.T_world_object)
        for k, item in enumerate(room.items, start=1)
    ]
    return T, RoomRenderer(camera).render_room(inverse(T), [], things)


@pytest.mark.parametrize("target", [(2.5, 0.3, 1.0), (-2.5, 1.9, 0.2), (0.4, -2.0, 2.4), (1.0, 0.5, 0.0)])
def test_a_closed_room_has_depth_in_every_pixel_and_it_is_that_of_the_nearest_plane(target):
    T, image = drawn(build_room(BARE, "room"), (-1.0, 0.5, 1.4), target)
    assert (image.depth > 0).all()
    u, v = np.meshgrid(np.arange(CAMERA.width), np.arange(CAMERA.height))
    rays = CAMERA.backproject(np.stack([u, v], axis=-1), np.ones(u.shape)) @ T[:3, :3].T
    planes = [(0, 2.5), (1, 2.0), (0, -2.5), (1, -2.0), (2, 0.0), (2, 2.5)]
    with np.errstate(divide="ignore"):
        ways = np.stack([(at - T[axis, 3]) / rays[..., axis] for axis, at in planes])
    ways[ways <= 0] = np.inf
    assert np.abs(image.depth / 1000 - ways.min(axis=0)).max() < 0.0015
    names = np.array([SCENE_CODE[name] for name in ("wall", "wall", "wall", "wall", "floor", "ceiling")])
    second = np.sort(ways, axis=0)[1] - ways.min(axis=0)
    is_clear = second > 0.003
    np.testing.assert_array_equal(image.occluder[is_clear], names[ways.argmin(axis=0)][is_clear])


def test_a_long_floor_keeps_its_depth_to_the_millimetre():
    hall = replace(BARE, kind="hall", length=20.0, width=16.0, height=5.0, walls=(False, False, False, False))
    T, image = drawn(build_room(hall, "room"), (-9.0, 3.0, 1.2), (9.0, -2.0, 0.9))
    v, u = np.nonzero(image.occluder == SCENE_CODE["floor"])
    rays = CAMERA.backproject(np.stack([u, v], axis=-1), np.ones(len(u))) @ T[:3, :3].T
    depth = -T[2, 3] / rays[:, 2]
    assert depth.max() > 15.0
    assert np.abs(image.depth[v, u] / 1000 - depth)[depth < 15.0].max() < 0.0015


def test_open_doors_and_panes_give_no_return_but_frames_and_shut_doors_do():
    openings = (
        Opening(0, -1.0, 0.9, 0.0, 2.0, "open"),
        Opening(0, 1.0, 0.9, 0.9, 2.1, "glass"),
        Opening(2, 0.0, 0.9, 0.0, 2.0, "leaf"),
    )
    room = build_room(replace(BARE, openings=openings), "room")
    T, image = drawn(room, (-1.0, 0.0, 1.4), (2.5, 0.0, 1.4))

    def depth_at(point):
        u, v = CAMERA.project(transform_points(inverse(T), np.array(point))).round().astype(int)
        return image.depth[v, u]

    assert depth_at((2.5, -1.0, 1.2)) == 0
    assert depth_at((2.5, 1.0, 1.5)) == 0
    assert depth_at((2.6, 1.0, 2.07)) > 0
    assert depth_at((2.5, 0.0, 1.2)) > 0
    _, other = drawn(room, (1.0, 0.0, 1.2), (-2.5, 0.0, 1.0))
    assert (other.depth > 0).all()
    middle = other.depth[CAMERA.height // 2, CAMERA.width // 2] / 1000
    assert middle > 3.54  # the leaf lies behind the wall's face


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_in_a_room_cuts_through_anything_or_leaves_the_room(kind):
    for room in rooms(kind):
        half = np.array([room.spec.length, room.spec.width]) / 2
        pieces = room.items[room.n_surfaces :]
        assert len(pieces) >= 3
        for k, item in enumerate(pieces):
            points = item.world_surface()
            assert (np.abs(points[:, :2]) <= half + 1e-6).all()
            assert points[:, 2].min() > -1e-6
            assert points[:, 2].max() < room.spec.height
            carried_by = item.stands_on - room.n_surfaces
            others = tuple(other for i, other in enumerate(pieces[:k]) if i != carried_by)
            assert is_free_of(item, others, 0.001), (item.spec_id, [o.spec_id for o in others])


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_stands_in_the_way_of_a_door(kind):
    n_doors = 0
    for room in rooms(kind):
        for door in (item for item in room.spec.openings if item.filling != "glass"):
            n_doors += 1
            T_wall_room = inverse(room.spec.wall_pose(door.wall))
            for item in room.items[room.n_surfaces :]:
                x, y, z = transform_points(T_wall_room, item.world_surface()).T
                is_before = (x < 0.9) & (np.abs(y - door.at) < door.width / 2) & (z < door.top)
                assert not is_before.any(), item.spec_id
    assert n_doors or kind == "hall"


@pytest.mark.parametrize("kind", KINDS)
def test_everything_stands_on_the_floor_or_on_something_or_hangs_on_a_wall(kind):
    for room in rooms(kind):
        for item in room.items[room.n_surfaces :]:
            points = item.world_surface()
            if item.stands_on >= 0:
                top = room.items[item.stands_on].world_surface()
                assert points[:, 2].min() == pytest.approx(top[:, 2].max(), abs=1e-4)
                assert (points[:, :2].min(axis=0) > top[:, :2].min(axis=0)).all()
                assert (points[:, :2].max(axis=0) < top[:, :2].max(axis=0)).all()
            elif points[:, 2].min() > 0.006:  # splayed legs are cut square
                walls = [wall for wall in range(4) if room.spec.walls[wall]]
                gaps = [transform_points(inverse(room.spec.wall_pose(w)), points)[:, 0].min() for w in walls]
                assert -1e-6 < min(gaps) < 0.1, item.spec_id


@pytest.mark.parametrize("kind", KINDS)
def test_a_room_is_made_again_from_the_plain_values_of_its_spec(kind):
    room = rooms(kind, 1)[0]
    again = build_room(RoomSpec.from_plain(json.loads(json.dumps(room.plain))), room.room_id)
    for item, other in zip(room.items, again.items, strict=True):
        assert item.spec_id == other.spec_id
        np.testing.assert_array_equal(item.occluder.mesh.vertices, other.occluder.mesh.vertices)
        np.testing.assert_array_equal(item.T_world_object, other.T_world_object)


def test_a_bare_room_has_no_furniture():
    spec = sample_room("office", RoomConfig(furniture=0.0), np.random.default_rng(1))
    assert spec.pieces == ()
    assert spec.openings


def test_taken_floor_is_the_floor_within_the_radius_of_what_stands_there():
    floor = Occupancy(2.0, 1.0)
    floor.take(np.array([[0.31, 0.11], [5.0, 5.0]]), 0.2)
    x, y = np.meshgrid(
        *(np.linspace(-h + CELL / 2, h - CELL / 2, n) for h, n in ((1, 40), (0.5, 20))), indexing="ij"
    )
    np.testing.assert_array_equal(floor.is_taken, np.hypot(x - 0.325, y - 0.125) <= 0.2 + 1e-9)
    assert floor.is_free(np.array([[-0.5, 0.0]]))
    assert not floor.is_free(np.array([[-0.5, 0.0], [0.31, 0.2]]))
    assert not floor.is_free(np.array([[1.2, 0.0]]))
    prints = footprint(np.array([(-0.31, 0.21, 0.0), (-0.311, 0.211, 1.0), (0.31, 0.21, 0.4)]))
    np.testing.assert_allclose(np.sort(prints[:, 0]), (-0.3125, 0.3125), atol=0.013)


def test_a_floor_is_free_where_no_point_lies_outside_or_on_a_taken_cell():
    rng = np.random.default_rng(0)
    floor = Occupancy(2.0, 1.0)
    floor.is_taken[:] = rng.random(floor.is_taken.shape) < 0.1
    verdicts = []
    for _ in range(200):
        points = rng.uniform(-0.4, 0.4, 2) * (2.0, 1.0) + rng.normal(0, 0.05, (4, 2))
        cells = floor.cells_of(points)
        is_inside = ((cells >= 0) & (cells < floor.is_taken.shape)).all()
        want = bool(is_inside and not floor.is_taken[cells[:, 0], cells[:, 1]].any())
        assert floor.is_free(points) is want
        verdicts.append(want)
    assert 20 < sum(verdicts) < 180


ROOMS = RoomConfig(kinds=RoomWeights(living=1.0))


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        (
            {"room": replace(ROOMS, sides=(1.0, 1.0)), "people": PeopleConfig(number=(8, 8))},
            r"number=\(8, 8\) do not fit into a living room .* so at most 0 do",
        ),
        ({"people": PeopleConfig(number=(2, 2))}, "give room kinds too"),
        ({"room": ROOMS, "distance": (12.0, 15.0)}, "leaves the camera nobody to see"),
    ],
)
def test_settings_that_contradict_each_other_are_refused_in_one_sentence(settings, sentence):
    with pytest.raises(ValueError, match=sentence):
        SceneConfig(**settings)


def test_unknown_surfaces_and_numbers_name_what_is_allowed():
    with pytest.raises(
        ValueError, match="surface 'carpet' is unknown; known are floor, wall, ceiling, background"
    ):
        RoomConfig(surfaces=("floor", "carpet"))
    with pytest.raises(ValueError, match=r"people number=\(0, 9\) must be \(lowest, highest\) within 0\.\.8"):
        PeopleConfig(number=(0, 9))


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_left_out_of_a_view_would_not_have_been_seen(kind):
    room = rooms(kind)[0]
    for target in [(2.0, 0.1, 0.8), (-2.0, 1.9, 1.2), (0.1, -1.5, 1.4)]:
        T, image = drawn(room, (0.1, 0.3, 1.5), target)
        is_near = room.may_show(inverse(T), CAMERA)
        assert not is_near.all()
        assert is_near[np.unique(image.instance[image.instance > 0]) - 1].all()
        assert (image.object_pixels[1:][~is_near] == 0).all()
