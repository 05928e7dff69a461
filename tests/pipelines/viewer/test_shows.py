"""What is shown of corpora, recordings and answers is what they hold."""

import json
from dataclasses import asdict

import numpy as np
import pytest

from forests.estimate import JointEstimate
from forests.finder.floor import Floor
from forests.frames import Intrinsics
from pipelines.cli import main
from pipelines.commands.view import ViewSettings
from pipelines.corpus import Corpus, write_corpus
from pipelines.errors import UserError
from pipelines.generation.drawn import drawn_order
from pipelines.online.messages import CameraPose, Plan, TrackedPersons, TrackSkeleton
from pipelines.orientation.truths import headings
from pipelines.predicting.skeleton import SCHEMA, body_values
from pipelines.viewer.answers import AnswerShow
from pipelines.viewer.moments import heading_of_camera
from pipelines.viewer.truth import CorpusShow, facing_of
from synth.scene.config import SceneConfig, SplitShares
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights
from synth.vocabulary import JOINT_NAMES, JointState
from tests.pipelines.online.test_record import recorded  # noqa: F401
from tests.pipelines.online.test_system import frame_at

N_RECORDED = 20
CAMERA = Intrinsics(100.0, 100.0, 47.5, 35.5)


@pytest.fixture(scope="module")
def rooms(tmp_path_factory):
    root = tmp_path_factory.mktemp("shows") / "corpus"
    scene = SceneConfig(
        camera="custom",
        intrinsics=(256, 212, 182.0, 182.0, 127.5, 105.5),
        splits=SplitShares(1.0, 0.0, 0.0),
        room=RoomConfig(kinds=RoomWeights(0.0, 1.0, 1.0)),
        people=PeopleConfig(number=(2, 3), visible=(0.5, 1.0)),
    )
    write_corpus(root, drawn_order(scene, 11, 3))
    return Corpus.open(root)


def test_a_room_is_shown_with_its_people_where_they_are(rooms):
    show = CorpusShow(rooms)
    assert len(show) == 3
    n_people = 0
    for number in range(3):
        moment, scene = show.moment(number), rooms.scene(number)
        np.testing.assert_array_equal(moment.depth, scene.depth)
        np.testing.assert_array_equal(moment.labels["people"].codes, scene.person)
        seen = [k for k, view in enumerate(scene.people) if (view.joint_state != JointState.OUTSIDE).any()]
        assert [one.track_id for one in moment.persons] == [scene.info.people[k].number for k in seen]
        T_camera_floor = np.linalg.inv(moment.T_floor_camera)
        for skeleton, k in zip(moment.skeletons, seen, strict=True):
            back = skeleton.positions @ T_camera_floor[:3, :3].T + T_camera_floor[:3, 3]
            np.testing.assert_allclose(back, scene.people[k].joints, atol=1e-5)
            is_seen = np.isin(scene.people[k].joint_state, (JointState.VISIBLE, JointState.OUTSIDE))
            np.testing.assert_array_equal(skeleton.hidden < 0.5, is_seen)
            n_people += 1
    assert n_people >= 5


def test_arrows_point_where_pelvises_face(rooms):
    off = []
    for number in range(3):
        scene, moment = rooms.scene(number), CorpusShow(rooms).moment(number)
        roots = {one.number: view.T_world_root for one, view in zip(scene.info.people, scene.people, strict=True)}
        off += [arrow.direction @ roots[arrow.track_id][:2, 0] for arrow in moment.arrows]
    assert len(off) >= 5
    assert np.median(off) > 0.9


def test_facing_is_to_the_left_hand_turned_back_by_a_quarter():
    joints = np.zeros((len(JOINT_NAMES), 3), np.float32)
    joints[[JOINT_NAMES.index("l_hip"), JOINT_NAMES.index("l_shoulder")], 1] = 0.3
    np.testing.assert_allclose(facing_of(joints), [1.0, 0.0], atol=1e-6)
    assert np.isnan(facing_of(joints * 0)).all()


def test_headings_of_the_camera_agree_with_those_of_nets():
    rng = np.random.default_rng(2)
    for yaw in rng.uniform(-np.pi, np.pi, 6):
        T = Floor(np.array([0.0, -1.0, 0.0]), 1.2).T_floor_camera  # looks along x from the origin
        root = np.eye(4)
        root[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
        root[0, 3] = 3.0
        angle = float(headings(root[None], T[None])[0])
        np.testing.assert_allclose(heading_of_camera(angle, T), root[:2, 0], atol=1e-9)


def test_a_corpus_of_single_people_is_shown(toy_corpus):
    show = CorpusShow(toy_corpus)
    assert len(show) == len(toy_corpus)
    moment, frame = show.moment(7), toy_corpus.frame(7)
    np.testing.assert_array_equal(moment.labels["body parts"].codes, frame.part)
    assert [one.track_id for one in moment.skeletons] == [1]
    with pytest.raises(UserError, match=r"view=1 must be in 0\.\.0"):
        CorpusShow(toy_corpus, view=1)


def test_a_recorded_run_shows_all_that_was_told(recorded):  # noqa: F811
    pytest.importorskip("viser", reason="viser is not installed")
    path, heard = recorded
    page = ViewSettings(path, port=0).page()
    show = page._show
    told = [m for m in heard if isinstance(m, TrackedPersons)]
    plans = {m.stamp: m for m in heard if isinstance(m, Plan)}
    poses = {m.stamp: m for m in heard if isinstance(m, CameraPose)}
    (skeleton,) = (m for m in heard if isinstance(m, TrackSkeleton))
    assert len(show) == N_RECORDED
    assert show.fps == pytest.approx(30, rel=0.01)
    for k in (0, 7, N_RECORDED - 1):
        moment, persons = show.moment(k), told[k].persons
        np.testing.assert_array_equal(moment.depth, np.full((48, 64), 1000 + k))
        assert moment.camera == frame_at(0).camera
        np.testing.assert_allclose(moment.T_floor_camera, poses[told[k].stamp].T_floor_camera, atol=1e-9)
        assert [one.track_id for one in moment.persons] == [one.track_id for one in persons]
        for one, other in zip(moment.persons, persons, strict=True):
            np.testing.assert_allclose(one.place, other.place)
            np.testing.assert_allclose(np.diag(one.covariance), np.diag(other.covariance), atol=1e-6)
        plan = plans[told[k].stamp]
        asked = [(one.track_id, one.module) for one in plan.requests]
        assert [(one.track_id, one.module) for one in moment.plan.requests] == asked
        assert [(one.track_id, one.reason) for one in moment.plan.skips] == [
            (one.track_id, one.reason) for one in plan.skips
        ]
        assert {arrow.track_id for arrow in moment.arrows} == ({1, 2, 3} if k > 3 else set())
    (shown,) = show.moment(N_RECORDED - 1).skeletons
    np.testing.assert_array_equal(shown.positions, skeleton.positions)
    assert shown.track_id == 1
    page.close()


def test_answers_are_shown_with_their_images(toy_corpus, tmp_path):
    joints = ("head", "neck", "torso")
    proposals = np.array([[0.1, -0.5, 2.0], [0.1, -0.3, 2.0], [np.nan] * 3], np.float32)[:, None]
    values = (np.full(3, value, np.float32) for value in (0.9, 0.2, 0.05))
    sure = np.ones((3, 1), np.float32)
    outside = np.array([0.0, 0.9, 0.0], np.float32)
    estimate = JointEstimate(proposals, sure, *values, CAMERA, outside, heading=np.pi / 2)
    head = {"schema": SCHEMA, "model": {"name": "forest"}, "camera": asdict(CAMERA), "found": None}
    lines = [head | {"image": {"source": f"frame {k}"}} | body_values(estimate, joints) for k in (3, 9)]
    (tmp_path / "skeletons.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    show = AnswerShow(tmp_path, toy_corpus)
    assert len(show) == 2
    moment = show.moment(1)
    assert moment.words == "frame 9"
    np.testing.assert_array_equal(moment.depth, toy_corpus.frame(9).depth)
    (skeleton,) = moment.skeletons
    # A level camera looks along x; what probably lies outside the image is not shown.
    np.testing.assert_allclose(skeleton.positions[0], [2.0, -0.1, 0.5], atol=1e-6)
    assert np.isnan(skeleton.positions[1:]).all()
    np.testing.assert_allclose(moment.arrows[0].direction, [0.0, -1.0], atol=1e-5)
    without = AnswerShow(tmp_path).moment(1)
    assert without.depth is None
    assert without.words == "frame 9 (--corpus tells where its image is)"


@pytest.mark.parametrize(
    ("text", "words"), [("{", "is no JSON"), ('{"name": "x", "skipped": "no"}\n', "holds no skeletons")]
)
def test_other_files_are_no_answers(tmp_path, text, words):
    (tmp_path / "skeletons.jsonl").write_text(text)
    with pytest.raises(UserError, match=words):
        AnswerShow(tmp_path)


def test_view_refuses_what_it_cannot_show(tmp_path, capsys):
    assert main(["view", str(tmp_path / "nothing")]) != 0
    assert "there is no file or folder" in capsys.readouterr().err
    assert main(["view", str(tmp_path)]) != 0
    assert "skeletons.jsonl cannot be read" in capsys.readouterr().err
