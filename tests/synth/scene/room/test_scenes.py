import functools
import hashlib
import json
from dataclasses import asdict, replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from synth.bodies.body import Pose
from synth.bodies.rig.skinning import pose_vertices
from synth.bodies.shape.make import make_body
from synth.bodies.spec import BodySpec
from synth.geometry import LabelledMesh, inverse, transform_points
from synth.occluders.background.catalogue import from_plain, make
from synth.occluders.solids.distance import solid_distances
from synth.render.among import measure_person, object_fractions
from synth.render.labels import measure_visibility
from synth.render.rasterize import Renderer
from synth.render.records import RenderObject
from synth.render.rooms import RenderedRoom, RenderPerson, RoomRenderer
from synth.scene.config import SceneConfig, SplitShares
from synth.scene.room.cast import Rooms
from synth.scene.room.config import GroupWeights, PeopleConfig, RoomConfig, RoomWeights
from synth.scene.room.groups import GROUPS, are_apart
from synth.scene.room.source import RoomSource
from synth.vocabulary import SCENE_CODE, JointState

INTRINSICS = (128, 106, 91.4, 91.4, 63.7, 51.3)
N_FRAMES = 16


def config(number=(0, 8), **changes):
    return SceneConfig(
        camera="custom",
        intrinsics=INTRINSICS,
        splits=SplitShares(0.5, 0.25, 0.25),
        room=RoomConfig(kinds=RoomWeights(1.0, 1.0, 1.0)),
        people=PeopleConfig(number=number, visible=(0.0, 1.0)),
        **changes,
    )


@pytest.fixture(scope="module")
def frames():
    return list(RoomSource(config(), 11, N_FRAMES))


def digest(frame):
    parts = [frame.depth, frame.part, frame.person, frame.occluder, frame.instance, frame.T_world_camera]
    for view in frame.people:
        parts += [np.array(view.box), view.body_depth, view.body_part, view.joints, view.joint_state, view.angles]
    told = json.dumps(asdict(frame.info), sort_keys=True).encode()
    return hashlib.sha256(told + b"".join(np.ascontiguousarray(part).tobytes() for part in parts)).hexdigest()


@pytest.fixture(scope="module")
def skins(frames):
    """Every person's skin of some frames made again from the record alone, world frame."""
    return {frame.info.index: [skin_of(frame, k)[1] for k in range(len(frame.people))] for frame in frames[:8]}


@functools.cache
def solids_of(spec):
    return make(from_plain(json.loads(spec))).solids


@functools.cache
def body_of(subject):
    return make_body(BodySpec(**json.loads(subject)))


def skin_of(frame, k):
    body, view = body_of(json.dumps(frame.info.people[k].subject)), frame.people[k]
    return body, pose_vertices(body, Pose(view.angles.astype(np.float64), view.T_world_root)).astype(np.float64)


def test_every_pixel_with_depth_is_a_part_of_one_person_or_an_object_or_a_surface_and_no_other_is_labelled(frames):
    for frame in frames:
        person, thing = frame.person > 0, frame.occluder > 0
        np.testing.assert_array_equal(frame.depth > 0, person ^ thing)
        np.testing.assert_array_equal(frame.part > 0, person)
        np.testing.assert_array_equal(frame.instance > 0, thing)
        assert not (person & thing).any()


def test_the_composite_shows_the_body_or_something_before_it(frames):
    for frame in frames:
        for k, view in enumerate(frame.people, start=1):
            seen = frame.person[view.window] == k
            assert seen.sum() == (frame.person == k).sum()
            np.testing.assert_array_equal(frame.part[view.window][seen], view.body_part[seen])
            np.testing.assert_array_equal(frame.depth[view.window][seen], view.body_depth[seen])
            alone = view.body_part > 0
            assert (frame.depth[view.window][alone] <= view.body_depth[alone]).all()
            if alone.any():  # the box is tight
                assert all(alone[edge].any() for edge in ((0,), (-1,), (slice(None), 0), (slice(None), -1)))


def test_nobody_stands_inside_another(skins):
    n_pairs = 0
    for listed in skins.values():
        trees = [cKDTree(skin) for skin in listed]
        for k, skin in enumerate(listed):
            for tree in trees[:k]:
                n_pairs += 1
                assert tree.query(skin, distance_upper_bound=0.03)[0].min() > 0.03
    assert n_pairs > 20


def test_nobody_sinks_into_an_object_or_the_floor_or_leaves_the_room(frames, skins):
    for frame in frames[:8]:
        half = np.array([frame.info.room["length"], frame.info.room["width"]]) / 2
        pieces = [item for item in frame.info.objects if item.class_name not in ("floor", "wall", "ceiling")]
        for skin in skins[frame.info.index]:
            assert skin[:, 2].min() > -0.011
            assert (np.abs(skin[:, :2]) < half).all()
            reach = np.linalg.norm(skin[:, :2] - skin[:, :2].mean(axis=0), axis=1).max() + 2.0
            for item in pieces:
                T = np.array(item.T_world_object)
                if np.linalg.norm(T[:2, 3] - skin[:, :2].mean(axis=0)) > reach:
                    continue
                depth = -solid_distances(solids_of(json.dumps(item.spec)), T, skin, 0.05).min()
                assert depth < 0.01, (item.spec_id, depth)


def test_people_of_a_frame_are_different_and_their_groups_have_the_sizes_of_their_kind(frames):
    kinds = set()
    for frame in frames:
        people = frame.info.people
        assert [one.number for one in people] == list(range(1, len(people) + 1))
        assert len({one.subject_id for one in people}) == len(people)
        assert len({one.pose_id for one in people}) == len(people)
        for number in {one.group_number for one in people}:
            group = [one for one in people if one.group_number == number]
            assert len({one.group for one in group}) == 1
            assert GROUPS[group[0].group].least <= len(group) <= GROUPS[group[0].group].most
            kinds.add(group[0].group)
        classes = {item.instance: item.class_name for item in frame.info.objects}
        assert all(classes[one.seat] == "chair" for one in people if one.seat)
    assert len(kinds) >= 3


def test_splits_share_no_room_no_subject_and_no_object(frames):
    owner = {}
    for frame in frames:
        info = frame.info
        names = [info.room_id, *(one.subject_id for one in info.people), *(item.spec_id for item in info.objects)]
        for name in names:
            assert owner.setdefault(name, info.split) == info.split
    assert set(owner.values()) == {"train", "val", "test"}


def test_neighbouring_rooms_are_of_several_kinds_as_often_as_they_weigh():
    weighed = replace(
        config(), room=RoomConfig(kinds=RoomWeights(living=2.0, office=1.0, hall=1.0), furniture=0.0)
    )
    rooms = Rooms(weighed, 4)
    kinds = [rooms._make("train", number)[0].spec.kind for number in range(40)]
    counts = {kind: kinds.count(kind) for kind in ("living", "office", "hall")}
    assert abs(counts["living"] - 20) <= 1
    assert abs(counts["office"] - 10) <= 1
    assert all(len(set(kinds[k : k + 5])) == 3 for k in range(36))


def test_a_frame_is_the_same_in_any_order_and_alone(frames):
    fresh = RoomSource(config(), 11, N_FRAMES)
    for index in (9, 3, N_FRAMES - 1):
        assert digest(fresh.frame(index)) == digest(frames[index])
    assert digest(RoomSource(config(), 12, N_FRAMES).frame(3)) != digest(frames[3])


def test_a_single_person_among_things_is_labelled_as_in_frames_of_one_person():
    """With nobody else there, the room's renderer and labels equal those of single frames to the bit."""
    source = RoomSource(config((1, 1)), 5, 8)
    renderer = Renderer(source._camera)
    states = set()
    for frame in source:
        view = frame.people[0]
        body, skin = skin_of(frame, 0)
        mesh = LabelledMesh(skin.astype(np.float32), body.mesh.faces, body.mesh.face_label, True)
        things = [
            RenderObject(
                make(from_plain(item.spec)).mesh, SCENE_CODE[item.class_name], item.instance, item.T_world_object
            )
            for item in frame.info.objects
            if item.class_name not in ("floor", "wall", "ceiling")
        ]
        pair = renderer.render(inverse(frame.T_world_camera), mesh, things)
        room = RoomRenderer(source._camera).render_room(
            inverse(frame.T_world_camera), [RenderPerson(mesh, np.eye(4))], things
        )
        np.testing.assert_array_equal(room.depth, pair.depth)
        np.testing.assert_array_equal(room.part, pair.part)
        np.testing.assert_array_equal(room.instance, pair.instance)
        np.testing.assert_array_equal(room.object_pixels, pair.object_pixels)
        left, top, width, height = room.bodies[0].box
        np.testing.assert_array_equal(pair.body_part[top : top + height, left : left + width], room.bodies[0].part)
        joints = view.joints.astype(np.float64)
        single = measure_visibility(pair, joints, source._camera)
        among = measure_person(room, 0, joints, source._camera)
        np.testing.assert_array_equal(single.joint_state, among.joint_state)
        np.testing.assert_array_equal(single.joint_visible_fraction, among.joint_visible_fraction)
        np.testing.assert_array_equal(single.part_visible_fraction, among.part_visible_fraction)
        assert single.visible_fraction == among.visible_fraction
        states |= set(among.joint_state.tolist())
    assert len(states) >= 3


def test_object_fractions_are_pixels_seen_over_pixels_alone():
    drawn = np.random.default_rng(0).integers(0, 6, (40, 50)).astype(np.uint8)
    drawn[:30] = np.sort(drawn[:30], axis=1)
    alone = np.array([0, 400, 500, 0, 600, 700, 800])
    room = RenderedRoom(*(np.zeros(()),) * 4, instance=drawn, bodies=(), object_pixels=alone)
    want = [0.0, *(np.count_nonzero(drawn == k) / max(alone[k], 1) for k in range(1, 7))]
    np.testing.assert_allclose(object_fractions(room), want)


def test_hidden_by_another_person_means_that_without_the_others_more_is_seen(frames):
    """A joint that another person hides is seen or hidden by something else once they are gone, and never else."""
    n_hidden = 0
    for frame in frames:
        for k, view in enumerate(frame.people, start=1):
            for j in np.flatnonzero(view.joint_state == JointState.OCCLUDED_BY_PERSON):
                n_hidden += 1
                u, v = frame.joints_2d(k - 1)[j]
                left, top, width, height = view.box
                assert left - 1 <= u <= left + width
                assert top - 1 <= v <= top + height
                others = (frame.person > 0) & (frame.person != k)
                near = others[max(0, int(v) - 14) : int(v) + 15, max(0, int(u) - 14) : int(u) + 15]
                assert near.any()
        if len(frame.people) < 2:
            assert not any((view.joint_state == JointState.OCCLUDED_BY_PERSON).any() for view in frame.people)
    assert n_hidden > 10


def test_people_are_apart_as_the_slow_way_measures_it():
    rng = np.random.default_rng(0)
    ball = rng.normal(size=(4000, 3))
    ball *= 0.2 / np.linalg.norm(ball, axis=1)[:, None]
    for gap in (0.01, 0.03, 0.08, 0.2):
        other = ball + np.array([0.4 + gap, 0.0, 0.0])
        assert are_apart([ball, other]) == (np.linalg.norm(ball[:, None] - other[None, ::7], axis=2).min() > 0.05)


def test_only_wanted_surfaces_give_depth():
    bare = config((1, 1))
    bare = replace(bare, room=replace(bare.room, surfaces=("floor",)))
    for frame in RoomSource(bare, 3, 4):
        names = {item.class_name for item in frame.info.objects if (frame.instance == item.instance).any()}
        assert not names & {"wall", "ceiling", "background"}
        assert (frame.occluder == SCENE_CODE["floor"]).any()


def test_tables_seat_several_with_hands_on_the_top():
    tables = replace(config((4, 4)), people=PeopleConfig((4, 4), GroupWeights(0, 0, 0, 1.0, 0), (0.0, 1.0)))
    frame = RoomSource(tables, 2, 1).frame(0)
    groups = {one.group for one in frame.info.people}
    assert "table" in groups
    for one, view in zip(frame.info.people, frame.people, strict=True):
        if one.group == "table":
            assert one.seat > 0
            hands = transform_points(frame.T_world_camera, view.joints)[[7, 8], 2]
            assert (hands > 0.55).all()


def test_a_camera_that_sees_nobody_gets_one_clear_error():
    blind = replace(config((1, 1)), people=PeopleConfig((1, 1), visible=(0.0, 0.0)))
    with pytest.raises(RuntimeError, match="the camera saw nobody"):
        RoomSource(blind, 1, 1).frame(0)


def test_rooms_need_weights_and_the_renderer_that_draws_them():
    with pytest.raises(ValueError, match="whole scenes need room kinds with a weight"):
        RoomSource(SceneConfig(), 1, 1)
    with pytest.raises(ValueError, match="drawn by 'numba' alone"):
        RoomSource(config(), 1, 1, renderer="pyrender")
