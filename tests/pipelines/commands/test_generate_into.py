"""generate --into: furniture before recorded people keeps the laws of layers, gaps, splits and bytes."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from toy_walker import CAMERA, HEIGHT_M, NAMES, TILT_DEG, import_recording, write_recording

from pipelines.cli import main
from pipelines.commands.generate import GenerateSettings
from pipelines.corpus import Corpus
from pipelines.corpus.faults import faults
from pipelines.errors import CorpusError, UserError
from pipelines.generation.floor import Floor, find_floor, fit_floor
from pipelines.generation.writing import write_shown
from synth.geometry import inverse, transform_points
from synth.occluders import registry
from synth.occluders.solids.distance import solid_distances
from synth.render.labels import JOINT_RADIUS, measure_visibility
from synth.render.overlay import as_measured, lay_over
from synth.render.rasterize import Renderer
from synth.render.records import RenderedPair, RenderObject
from synth.scene import SceneConfig
from synth.scene.composed import ComposeConfig, ComposeWeights
from synth.scene.composed.person import THICKNESS, person_of
from synth.vocabulary import OCCLUDER_CODE, JointState
from tests.shared_data import SHARED

N_FRAMES = 70
REAL = SHARED / "data" / "real" / "eval_a"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """24 frames of somebody walking; the torso joint is unknown."""
    folder = tmp_path_factory.mktemp("recording")
    layout = write_recording(folder, known=[name for name in NAMES if name != "torso"])
    return Corpus.open(import_recording(folder, folder / "corpus", layout))


@pytest.fixture(scope="module")
def composed(recorded, tmp_path_factory):
    return compose(recorded, tmp_path_factory.mktemp("composed") / "c", frames=N_FRAMES, seed=3)


def compose(recorded, out, workers=1, **settings):
    write_shown(out, GenerateSettings(out, into=recorded.path, **settings).order(), workers)
    return Corpus.open(out)


def recorded_number(composed, recorded, index):
    """Number of a composed frame's recorded frame, by the name of its pose."""
    names = [recorded.info(int(i)).pose_id for i in recorded.indices]
    return names.index(composed.info(index).pose_id)


def objects_of(frame):
    """Occluder and T_world_object of each object, made again from the record."""
    return [
        (registry.make(registry.from_plain(item.spec)), np.array(item.T_world_object))
        for item in frame.info.objects
    ]


def test_a_composed_corpus_is_sound_and_objects_hide_something(composed):
    assert len(composed) == N_FRAMES
    assert list(faults(composed)) == []
    infos = [composed.info(i) for i in range(N_FRAMES)]
    hiding = [info for info in infos if info.objects]
    assert len(hiding) > 0.75 * N_FRAMES
    assert all(0.13 < info.visible_fraction < 0.97 for info in hiding)
    assert len({info.scene_family for info in hiding}) >= 4
    states = composed.arrays("joint_state")
    assert (states == JointState.OCCLUDED).mean() > 0.1


def test_the_body_layer_and_the_joints_are_the_recorded_ones_to_the_byte(composed, recorded):
    for index in range(N_FRAMES):
        frame, original = composed[index], recorded[recorded_number(composed, recorded, index)]
        assert frame.body_depth.tobytes() == original.body_depth.tobytes()
        assert frame.body_part.tobytes() == original.body_part.tobytes()
        assert frame.joints.tobytes() == original.joints.tobytes()
        is_unknown = original.joint_state == JointState.UNKNOWN
        assert is_unknown.any()
        assert ((frame.joint_state == JointState.UNKNOWN) == is_unknown).all()
        assert frame.info.split == original.info.split
        assert frame.camera == original.camera


def test_the_composite_is_the_nearer_layer_and_labels_say_which(composed):
    for frame in composed.frames():
        thing, person = frame.occluder > 0, frame.part > 0
        assert ((frame.depth > 0) == (thing | person)).all()
        assert not (thing & person).any()
        assert (frame.depth[person] == frame.body_depth[person]).all()
        behind = frame.body_depth > 0
        assert (frame.depth[thing & behind] <= frame.body_depth[thing & behind]).all()
        assert (person == (behind & ~thing)).all()


def test_clean_objects_are_those_that_the_records_draw(recorded, tmp_path):
    clean = compose(recorded, tmp_path / "c", frames=12, seed=5, compose=ComposeConfig(sensor="ideal"))
    renderer = Renderer(CAMERA)
    for frame in clean.frames():
        things = [
            RenderObject(occluder.mesh, OCCLUDER_CODE[occluder.class_name], k, T)
            for k, (occluder, T) in enumerate(objects_of(frame), start=1)
        ]
        drawn = renderer.render(inverse(frame.T_world_camera), None, things)
        far = np.iinfo(np.uint16).max
        layers = [np.where(image > 0, image, far).astype(int) for image in (drawn.depth, frame.body_depth)]
        nearest = np.minimum(*layers)
        differs = np.abs(np.where(nearest < far, nearest, 0) - frame.depth)
        assert (differs <= 1).mean() > 0.999  # poses were turned into the world and back
        pair = RenderedPair(frame.depth, frame.part, frame.occluder, frame.instance, frame.body_depth,
                            frame.body_part, drawn.object_pixels)  # fmt: skip
        seen = measure_visibility(pair, frame.joints, frame.camera)
        is_known = frame.joint_state != JointState.UNKNOWN
        assert (seen.joint_state[is_known] == frame.joint_state[is_known]).all()


def test_occluded_joints_are_behind_pixels_of_objects(composed):
    n_occluded = 0
    for frame in composed.frames():
        v, u = np.indices(frame.depth.shape)
        for joint in np.flatnonzero(frame.joint_state == JointState.OCCLUDED):
            place = frame.joints_2d[joint]
            radius = max(1.5, JOINT_RADIUS[joint] * frame.camera.fx / frame.joints[joint, 2])
            disc = (np.hypot(u - place[0], v - place[1]) <= radius) & (frame.body_part > 0)
            covered = disc & (frame.occluder > 0)
            assert covered.sum() > 0.2 * disc.sum()
            assert (frame.depth[covered] <= frame.body_depth[covered]).all()
            n_occluded += 1
    assert n_occluded > 50


def test_objects_keep_the_gap_to_the_person_and_the_nearest_stops_there(composed):
    for frame in composed.frames():
        if not frame.info.objects:
            continue
        person = person_of(frame, frame.T_world_camera, frame.T_world_root)
        points = transform_points(person.T_world_scene, person.body)
        gaps = [solid_distances(occluder.solids, T, points).min() for occluder, T in objects_of(frame)]
        assert min(gaps) > 0.03 - 0.0015
        assert min(gaps) < 0.05 + 0.0015


def test_the_unseen_body_lies_behind_the_seen_one(recorded):
    frame = recorded[0]
    person = person_of(frame, frame.T_world_camera, frame.T_world_root)
    behind = transform_points(person.T_camera_scene, person.body[len(person.surface) :])
    u, v = np.rint(frame.camera.project(behind)).astype(int).T
    depth = behind[:, 2] - frame.body_depth[v, u] * 1e-3
    on_body = frame.body_depth[v, u] > 0
    assert on_body.all()
    assert (depth[on_body] > 0.0).mean() > 0.95  # the others lie behind a nearer limb's outline
    assert depth.max() < THICKNESS.max() + 0.5
    assert np.allclose(person.surface[:, :2].mean(axis=0), 0.0, atol=0.1)


def test_furniture_stands_on_the_floor_that_the_feet_stand_on(composed):
    for frame in composed.frames():
        v, u = np.nonzero(frame.body_depth)
        points = frame.camera.backproject(np.stack([u, v], axis=1), frame.body_depth[v, u] * 1e-3)
        assert abs(transform_points(frame.T_world_camera, points)[:, 2].min()) < 0.04
        if frame.info.objects:
            T = np.array(frame.info.objects[0].T_world_object)
            assert abs(T[2, 3]) < 1e-9
            assert np.allclose(T[:3, 2], (0.0, 0.0, 1.0))


def test_the_floor_is_found_below_a_tilted_camera(recorded):
    floor = find_floor(recorded)
    assert floor.source == "feet"
    below = floor.height + floor.slope_x * 2.6  # where the person walks
    assert below == pytest.approx(
        -HEIGHT_M / np.cos(np.radians(TILT_DEG)) + 2.6 * np.tan(np.radians(TILT_DEG)), abs=0.03
    )
    assert np.degrees(np.arctan(floor.slope_x)) == pytest.approx(TILT_DEG, abs=1.5)
    T = floor.transform()
    assert np.allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3))
    on_it = np.array([[2.0, 0.5, floor.height + 2.0 * floor.slope_x + 0.5 * floor.slope_y]])
    assert transform_points(T, on_it)[0, 2] == pytest.approx(0.0, abs=1e-9)


def test_feet_in_the_air_do_not_lift_the_floor():
    rng = np.random.default_rng(0)
    lowest = np.stack([rng.uniform(2, 4, 200), rng.uniform(-1, 1, 200), np.zeros(200)], axis=1)
    lowest[:, 2] = -0.9 + 0.03 * lowest[:, 0] - 0.02 * lowest[:, 1] + rng.normal(0, 0.003, 200)
    lowest[::3, 2] += rng.uniform(0.05, 0.6, len(lowest[::3]))
    floor = fit_floor(lowest)
    assert (floor.height, floor.slope_x, floor.slope_y) == pytest.approx((-0.9, 0.03, -0.02), abs=0.005)
    assert floor.n_frames <= 200 - len(lowest[::3]) + 2
    still = fit_floor(np.array([[3.0, 0.0, -0.8]] * 30) + rng.normal(0, 0.01, (30, 3)))
    assert (still.slope_x, still.slope_y) == (0.0, 0.0)
    assert fit_floor(lowest[1:2]).height == pytest.approx(lowest[1, 2], abs=1e-6)


def test_a_layout_that_says_where_the_camera_is_needs_no_feet(tmp_path):
    layout = write_recording(tmp_path, 3, pose=f", height_m = {HEIGHT_M}, tilt_deg = {TILT_DEG}")
    corpus = Corpus.open(import_recording(tmp_path, tmp_path / "c", layout, "test=1"))
    assert find_floor(corpus) == Floor()


def test_two_workers_give_the_bytes_of_one_and_another_seed_gives_others(composed, recorded, tmp_path, bytes_of):
    two = compose(recorded, tmp_path / "two", workers=2, frames=N_FRAMES, seed=3)
    assert bytes_of(two.path) == bytes_of(composed.path)
    (two.path / "manifest.jsonl").write_text("")
    again = compose(recorded, two.path, frames=N_FRAMES, seed=3)
    assert bytes_of(again.path) == bytes_of(composed.path)
    other = compose(recorded, tmp_path / "other", frames=6, seed=4)
    assert any(other[i].depth.tobytes() != composed[i].depth.tobytes() for i in range(6))


def test_a_frame_can_be_made_alone(composed, recorded, tmp_path):
    source = GenerateSettings(tmp_path / "c", into=recorded.path, frames=N_FRAMES, seed=3).order().make_source()
    alone = source.frame(N_FRAMES - 1)
    assert alone.depth.tobytes() == composed[N_FRAMES - 1].depth.tobytes()
    assert alone.info == composed.info(N_FRAMES - 1)
    with pytest.raises(IndexError, match=f"frame {N_FRAMES} must be in 0..{N_FRAMES - 1}"):
        source.frame(N_FRAMES)


def test_splits_share_neither_objects_nor_recorded_frames(composed):
    by_split = {name: [composed.info(int(i)) for i in composed.split(name)] for name in ("train", "val", "test")}
    assert [len(infos) for infos in by_split.values()] == [35, 18, 17]
    for one, other in itertools.combinations(by_split.values(), 2):
        for names in (lambda i: {o.spec_id for o in i.objects}, lambda i: {i.pose_id}, lambda i: {i.subject_id}):
            assert not set().union(*map(names, one)) & set().union(*map(names, other))


def test_by_default_there_are_as_many_frames_as_recorded(recorded, tmp_path):
    assert GenerateSettings(tmp_path / "c", into=recorded.path).order().n_frames == len(recorded)
    assert GenerateSettings(tmp_path / "c").order().n_frames == 1000


def test_lost_pixels_show_the_ground_but_never_who_is_behind():
    shape = (CAMERA.height, CAMERA.width)
    depth = np.full(shape, 450, np.uint16)  # nearer than the sensor sees
    depth[:, 80:] = 1500
    nothing, label = np.zeros(shape, np.uint8), np.ones(shape, np.uint8)
    body = np.zeros(shape, np.uint16)
    body[:60] = 2000
    objects = RenderedPair(depth, nothing, label, label, np.zeros(shape, np.uint16), nothing, np.array([0, 1]))
    measured = as_measured(objects, body, "kinect_v1", CAMERA, np.random.default_rng(0))
    assert (measured.depth[:60, :70] == 450).all()
    assert not measured.depth[60:, :70].any()
    assert ((measured.depth > 0) == (measured.instance > 0)).all()
    pair = lay_over(body, (body > 0).astype(np.uint8), measured)
    assert not pair.part.any()
    tie = lay_over(depth, label, objects)
    assert not tie.part.any()
    with pytest.raises(ValueError, match="body_depth has shape"):
        lay_over(body[1:], label[1:], objects)


def test_other_commands_take_it(composed, recorded, tmp_path):
    path = str(composed.path)
    assert main(["inspect", path, "--frames", "2", "--out", str(tmp_path / "sheets")]) == 0
    assert main(["export", path, "--to", "coco", "--out", str(tmp_path / "coco"), "--split", "val"]) == 0
    assert main(["verify", path]) == 0


@pytest.mark.slow
def test_a_forest_trains_on_it_and_is_scored(tmp_path):
    folder = tmp_path / "recording"
    folder.mkdir()
    recorded = Corpus.open(import_recording(folder, tmp_path / "r", write_recording(folder)))
    corpus = str(compose(recorded, tmp_path / "c", frames=24).path)
    model = str(tmp_path / "model.safetensors")
    small = ("--n-trees", "1", "--n-pixels", "60", "--growth.max-depth", "6", "--growth.n-candidates", "20")
    assert main(["train", "oarf", corpus, "--mode", "semantic", "--out", model, *small]) == 0
    assert main(["evaluate", model, corpus, "--json", "--resamples", "10"]) == 0


def test_what_cannot_be_composed_is_said_in_one_sentence(composed, recorded, tmp_path, toy_corpus):
    out = tmp_path / "out"
    with pytest.raises(UserError, match="must be a corpus made by `undergrowth import depth`"):
        GenerateSettings(out, into=toy_corpus.path).order()
    with pytest.raises(UserError, match="must be a corpus made by `undergrowth import depth`"):
        GenerateSettings(out, into=composed.path).order()
    with pytest.raises(UserError, match="describe generated people"):
        GenerateSettings(out, into=recorded.path, scene=SceneConfig(camera="kinect_v1")).order()
    with pytest.raises(UserError, match="give --into CORPUS"):
        GenerateSettings(out, compose=ComposeConfig(sensor="ideal")).order()
    with pytest.raises(ValueError, match="sensor='kinect_v9' is unknown"):
        ComposeConfig(sensor="kinect_v9")
    with pytest.raises(ValueError, match="weight desk=-1"):
        ComposeWeights(desk=-1.0)
    with pytest.raises(CorpusError, match="cannot be applied"):
        composed.frame(0, sensor="kinect_v1")
    assert (composed.frame(0, sensor="ideal").depth == composed[0].depth).all()
    folder = tmp_path / "bare"
    folder.mkdir()
    bare = import_recording(folder, tmp_path / "bare_corpus", write_recording(folder, 2, known=[]))
    with pytest.raises(UserError, match="no joints that objects could occlude"):
        GenerateSettings(out, into=bare).order()


def test_a_recording_without_feet_tells_no_floor(recorded, monkeypatch):
    frame = recorded[0]
    cut = np.roll(frame.body_depth, CAMERA.height - 1 - np.flatnonzero(frame.body_depth.any(axis=1))[-1], axis=0)
    monkeypatch.setattr(Corpus, "__getitem__", lambda self, index: replace(frame, body_depth=cut))
    with pytest.raises(UserError, match="no frame shows a person down to the feet"):
        find_floor(recorded)


def test_a_corpus_that_changed_is_not_gone_on_with(tmp_path):
    layout = write_recording(tmp_path, 4)
    path = import_recording(tmp_path, tmp_path / "c", layout, "test=1")
    order = GenerateSettings(tmp_path / "out", into=path).order()
    (path / "corpus.json").write_text((path / "corpus.json").read_text() + "\n")
    with pytest.raises(UserError, match="has changed since the corpus was begun"):
        order.make_source()


@pytest.mark.skipif(not REAL.is_dir(), reason=f"no recorded frames at {REAL}")
def test_real_frames_are_composed(tmp_path):
    assert main(["import", "depth", str(REAL), "--out", str(tmp_path / "r"), "--every", "200"]) == 0
    assert main(["generate", str(tmp_path / "c"), "--into", str(tmp_path / "r")]) == 0
    corpus = Corpus.open(tmp_path / "c")
    assert list(faults(corpus)) == []
    assert corpus.header.config["into"]["floor"]["height"] == pytest.approx(-0.8, abs=0.05)
