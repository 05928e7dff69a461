"""undergrowth predict on whole scenes: everybody answered and numbered, nobody told once, cut-outs as before."""

import json

import cv2
import numpy as np
import pytest

from forests.frames import FrameSubset
from forests.growing import GrowthConfig
from forests.kinds import load_model
from forests.oarf.config import OARFConfig
from forests.oarf.storage import save_model as save_oarf
from forests.oarf.train import train as train_oarf
from forests.rwf.config import RWFConfig
from forests.rwf.storage import save_model as save_rwf
from forests.rwf.train import train as train_rwf
from pipelines.cli import main
from pipelines.corpus import write_corpus
from pipelines.corpus.sequence import CorpusFrames
from pipelines.generation.drawn import drawn_order
from pipelines.viewer.answers import AnswerShow
from synth.scene.config import SceneConfig
from synth.scene.room.config import PeopleConfig, RoomConfig, RoomWeights
from synth.vocabulary import JOINT_NAMES
from tests.reference_finder import CAMERA, cast, figure, standing
from tests.shared_data import SHARED

INTRINSICS = ("--intrinsics", "182", "182", "127.5", "105.5")
PLACES = ((2.4, -0.6), (3.2, 0.5), (3.0, -1.1))
FIVE = SHARED / "data" / "real" / "five_people"


@pytest.fixture(scope="module")
def models(toy_corpus, tmp_path_factory):
    """A model file of each kind."""
    out = tmp_path_factory.mktemp("models")
    frames = FrameSubset(CorpusFrames(toy_corpus, toy_corpus.split("train")), tuple(range(0, 140, 10)))
    growth = GrowthConfig(max_depth=4, n_candidates=10)
    save_oarf(out / "oarf", train_oarf(frames, OARFConfig(n_trees=1, n_pixels=40, growth=growth)))
    save_rwf(out / "rwf", train_rwf(frames, RWFConfig(n_points=20, growth=growth)))
    return out


def room(*places):
    return cast(standing(), [part for place in places for part in figure(*place)], wall=5.5)


@pytest.fixture
def folder(tmp_path):
    """Images of a room: with three people, with nobody, with one."""
    out = tmp_path / "seen"
    out.mkdir()
    for n, places in enumerate((PLACES, (), PLACES[:1])):
        cv2.imwrite(str(out / f"d_{n}.png"), room(*places))
    return out


def predict(model, *words):
    return main(["predict", str(model), *map(str, words)])


def lines_of(out):
    return [json.loads(line) for line in (out / "skeletons.jsonl").read_text().splitlines()]


def names_of(out):
    return sorted(path.name for path in out.iterdir())


def error_line(capsys):
    err = capsys.readouterr().err
    assert err.count("undergrowth: error: ") == 1
    return err


@pytest.mark.parametrize("kind", ["oarf", "rwf"])
def test_everybody_in_a_whole_image_is_answered_from_left_to_right(models, folder, tmp_path, capsys, kind):
    out = tmp_path / "out"
    assert predict(models / kind, folder / "d_0.png", *INTRINSICS, "--out", out) == 0
    assert "so people are looked for" in capsys.readouterr().out
    assert names_of(out) == ["d_0.overlay.png", "d_0_0.json", "d_0_1.json", "d_0_2.json"]
    documents = [json.loads((out / f"d_0_{k}.json").read_text()) for k in range(3)]
    floor = standing()
    for k, (document, (x, y)) in enumerate(
        zip(documents, sorted(PLACES, key=lambda p: -p[1] / p[0]), strict=True)
    ):
        found = document["found"]
        assert found["number"] == k
        assert found["confidence"] > 0.5
        assert found["place"] == pytest.approx((x, y), abs=0.12)
        assert found["distance"] == pytest.approx(np.hypot(x, y), abs=0.12)
        assert found["height"] == pytest.approx(1.75, abs=0.15)
        assert found["floor"]["normal"] == pytest.approx(floor.normal.tolist(), abs=0.01)
        assert found["floor"]["height"] == pytest.approx(floor.height, abs=0.02)
        left, top, right, bottom = found["box"]
        for joint in document["joints"].values():
            assert joint["xyz"] is None or abs(joint["xyz"][2] - found["axis"][2]) < 1.5
        assert left < right
        assert top < bottom
    assert cv2.imread(str(out / "d_0.overlay.png")).std() > 5


def test_an_answer_is_that_of_the_cut_out_person(models, folder, tmp_path):
    from forests import PeopleFinder, cut_person

    depth = room(*PLACES)
    found = PeopleFinder().find(depth, CAMERA)
    assert predict(models / "oarf", folder / "d_0.png", *INTRINSICS, "--out", tmp_path / "a") == 0
    leftmost = min(range(3), key=lambda k: found.people[k].axis[0] / found.people[k].axis[2])
    cut = cut_person(depth, CAMERA, found, leftmost)
    truth = load_model(models / "oarf").predict(cut, CAMERA)
    joints = json.loads((tmp_path / "a" / "d_0_0.json").read_text())["joints"]
    assert list(joints) == list(JOINT_NAMES)
    for joint, place, sure in zip(joints.values(), truth.joints, truth.confidence, strict=True):
        assert joint["xyz"] == (pytest.approx(place.tolist(), rel=1e-5) if sure else None)


def test_an_empty_room_is_told_once_and_is_no_error(models, folder, tmp_path, capsys):
    out = tmp_path / "out"
    assert predict(models / "oarf", folder / "d_1.png", *INTRINSICS, "--out", out) == 0
    assert capsys.readouterr().out.count("nobody is found") == 1
    assert names_of(out) == ["d_1.overlay.png"]


def test_a_sequence_has_a_line_for_everybody_and_for_images_with_nobody(models, folder, tmp_path, capsys):
    out = tmp_path / "out"
    assert predict(models / "oarf", folder, *INTRINSICS, "--out", out) == 0
    assert "4 people; 1 image in which nobody is found" in capsys.readouterr().out
    lines = lines_of(out)
    assert [line["name"] for line in lines] == ["d_0_0", "d_0_1", "d_0_2", "d_1", "d_2_0"]
    assert lines[3] == {"name": "d_1", "n_people": 0}
    assert cv2.imread(str(out / "sheet.png")).std() > 5
    show = AnswerShow(out)
    assert [len(show.moment(k).skeletons) for k in range(len(show))] == [3, 1]
    np.testing.assert_array_equal(show.moment(0).depth, room(*PLACES))
    np.testing.assert_allclose(show.moment(0).T_floor_camera, standing().T_floor_camera, atol=0.03)


def test_people_of_an_earlier_run_are_not_left_behind(models, folder, tmp_path):
    out = tmp_path / "out"
    assert predict(models / "oarf", folder / "d_0.png", *INTRINSICS, "--out", out, "--no-pictures") == 0
    (out / "d_0_notes.json").write_text("{}")
    cv2.imwrite(str(folder / "d_0.png"), room(PLACES[0]))
    assert predict(models / "oarf", folder / "d_0.png", *INTRINSICS, "--out", out, "--no-pictures") == 0
    assert names_of(out) == ["d_0_0.json", "d_0_notes.json"]


def test_files_of_others_are_not_replaced(models, folder, tmp_path, capsys):
    (tmp_path / "d_0_1.json").write_text("{}")
    assert predict(models / "oarf", folder / "d_0.png", *INTRINSICS, "--out", tmp_path) == 1
    assert "was not written by this command" in error_line(capsys)


@pytest.mark.parametrize("words", [("--people", "one"), ("--box", 40, 20, 200, 200), ("--far", 5.0)])
def test_who_says_what_is_the_person_gets_one_answer(models, folder, tmp_path, words):
    assert predict(models / "oarf", folder / "d_2.png", *INTRINSICS, "--out", tmp_path / "out", *words) == 0
    assert names_of(tmp_path / "out") == ["d_2.json", "d_2.overlay.png"]
    assert json.loads((tmp_path / "out" / "d_2.json").read_text())["found"] is None


def test_people_can_be_looked_for_in_images_of_little_depth(models, tmp_path):
    depth = room(*PLACES[:2])
    depth[depth > 4000] = 0
    assert (depth > 0).mean() < 0.5
    np.save(tmp_path / "near.npy", depth)
    assert predict(models / "oarf", tmp_path / "near.npy", *INTRINSICS, "--out", tmp_path / "a") == 0
    assert names_of(tmp_path / "a") == ["near.json", "near.overlay.png"]
    words = ("--people", "all", "--out", tmp_path / "b")
    assert predict(models / "oarf", tmp_path / "near.npy", *INTRINSICS, *words) == 0
    assert names_of(tmp_path / "b") == ["near.overlay.png", "near_0.json", "near_1.json"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--smooth",), "--smooth follows one person"),
        (("--people", "all", "--box", 1, 2, 30, 40), "leave --box out"),
    ],
)
def test_settings_that_contradict_are_one_line(models, folder, tmp_path, capsys, words, message):
    assert predict(models / "oarf", folder, *INTRINSICS, "--out", tmp_path / "out", *words) == 1
    assert message in error_line(capsys)


def test_frames_of_a_corpus_of_rooms_are_whole_scenes(models, tmp_path, capsys):
    scene = SceneConfig(
        camera="custom",
        intrinsics=(256, 212, 182.0, 182.0, 127.5, 105.5),
        room=RoomConfig(kinds=RoomWeights(1.0, 1.0, 1.0)),
        people=PeopleConfig(number=(2, 2), visible=(0.5, 1.0)),
    )
    write_corpus(tmp_path / "rooms", drawn_order(scene, 5, 3))
    out = tmp_path / "out"
    words = ("--corpus", tmp_path / "rooms", "--frame", 0, 1, 2, "--sensor", "kinect_v2", "--out", out)
    assert predict(models / "oarf", *words) == 0
    assert "so people are looked for" not in capsys.readouterr().out
    assert {line["name"][:12] for line in lines_of(out)} == {f"frame_00000{k}" for k in range(3)}
    assert sum("joints" in line for line in lines_of(out)) >= 3


@pytest.mark.skipif(not FIVE.exists(), reason=f"needs the recording {FIVE}")
def test_five_people_are_found_in_the_raw_image(models, tmp_path):
    words = (FIVE / "five_people_depth_mm.png", "--intrinsics", 525, 525, 319.5, 239.5)
    assert predict(models / "oarf", *words, "--out", tmp_path / "raw") == 0
    assert predict(models / "oarf", FIVE, "--people", "all", "--out", tmp_path / "cloud") == 0
    for name, folder in (("five_people_depth_mm", "raw"), ("five_people", "cloud")):
        assert names_of(tmp_path / folder) == [f"{name}.overlay.png"] + [f"{name}_{k}.json" for k in range(5)]
