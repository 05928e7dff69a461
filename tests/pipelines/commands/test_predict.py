"""undergrowth predict: skeletons and pictures out of depth files and corpora; what cannot be asked is one line."""

import io
import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from forests.estimate import JointEstimate
from forests.frames import FrameSubset, Intrinsics
from forests.growing import GrowthConfig
from forests.modelfile import write_model
from forests.oarf.config import OARFConfig
from forests.oarf.predict import Predictor
from forests.oarf.storage import load_model, save_model
from forests.oarf.train import train
from pipelines.cli import main
from pipelines.corpus.sequence import CorpusFrames
from pipelines.drawing import palette
from pipelines.drawing.labels import PixelLabels, label_colours
from pipelines.drawing.overlays import PANEL_HEIGHT, overlay
from pipelines.predicting.skeleton import body_values, joint_values
from synth.vocabulary import JOINT_NAMES, N_JOINTS, PART

CONFIG = OARFConfig(
    learn_skeleton=False,
    n_trees=1, n_pixels=60, n_occluder_pixels=60, n_voting_pixels=100,
    growth=GrowthConfig(max_depth=6, n_candidates=20),
)  # fmt: skip
CAMERA = ("--intrinsics", "60", "60", "31.5", "23.5")


@pytest.fixture(scope="module")
def model(toy_corpus, tmp_path_factory):
    path = tmp_path_factory.mktemp("models") / "toy.safetensors"
    frames = CorpusFrames(toy_corpus, toy_corpus.split("train"))
    few = FrameSubset(frames, tuple(range(0, 140, 5)))
    validation = FrameSubset(frames, tuple(range(1, 140, 10)))
    save_model(path, train(few, CONFIG, validation=validation))
    return path


@pytest.fixture
def png(toy_corpus, tmp_path):
    path = tmp_path / "seen.png"
    cv2.imwrite(str(path), toy_corpus.arrays("depth", [5])[0])
    return path


def predict(model, *words):
    return main(["predict", str(model), *map(str, words)])


def error_line(capsys):
    err = capsys.readouterr().err
    assert err.startswith("undergrowth: error: ")
    assert err.count("\n") == 1
    return err


def test_a_skeleton_and_a_picture_come_out_of_a_depth_file(model, png, toy_corpus, tmp_path, capsys):
    out = tmp_path / "out"
    assert predict(model, png, "--out", out, *CAMERA) == 0
    assert "of 15 joints, " in capsys.readouterr().out
    assert sorted(path.name for path in out.iterdir()) == ["seen.json", "seen.overlay.png"]
    document = json.loads((out / "seen.json").read_text())
    assert (document["schema"], document["schema_version"]) == ("undergrowth skeleton", 1)
    assert document["image"] == {"source": str(png), "width": 64, "height": 48}
    assert document["model"]["kind"] == "oarf"
    truth = Predictor(load_model(model)).predict(
        toy_corpus.arrays("depth", [5])[0], Intrinsics(60, 60, 31.5, 23.5)
    )
    assert list(document["joints"]) == list(JOINT_NAMES)
    n_found = 0
    for k, joint in enumerate(document["joints"].values()):
        if not truth.confidence[k]:
            assert joint["xyz"] is joint["uv"] is None
            assert joint["proposals"] == []
            continue
        n_found += 1
        assert joint["xyz"] == pytest.approx(truth.joints[k].tolist(), rel=1e-5)
        assert joint["uv"] == pytest.approx(truth.joints_2d[k].tolist(), rel=1e-5)
        assert joint["confidence"] == joint["proposals"][0]["confidence"] > 0
        assert joint["proposals"][0]["xyz"] == joint["xyz"]
        assert 0 <= joint["probability"] <= 1
        assert 0 <= joint["hidden_probability"] <= 1
    assert n_found > 10
    assert cv2.imread(str(out / "seen.overlay.png")).shape[0] > PANEL_HEIGHT // 2


def test_npy_and_corpus_give_the_answers_of_the_png(model, png, toy_corpus, tmp_path):
    arrays = tmp_path / "array.npy"
    np.save(arrays, toy_corpus.arrays("depth", [5])[0].astype(np.int32))
    assert predict(model, png, arrays, "--out", tmp_path / "a", *CAMERA) == 0
    assert predict(model, "--corpus", toy_corpus.path, "--frame", 5, "--out", tmp_path / "b") == 0
    files = tmp_path / "a" / "seen.json", tmp_path / "a" / "array.json", tmp_path / "b" / "frame_000005.json"
    joints = [json.loads(path.read_text())["joints"] for path in files]
    assert joints[0] == joints[1] == joints[2]


def test_what_is_too_near_or_far_is_cut(model, toy_corpus, tmp_path):
    """A wall behind the person is as if it were not there; so is a hand before the camera."""
    depth = toy_corpus.arrays("depth", [5])[0]
    depth[depth == 0] = 6000
    depth[:3, :9] = 400
    np.save(tmp_path / "room.npy", depth)
    words = ("--near", 0.5, "--far", 5.0, "--out", tmp_path)
    assert predict(model, tmp_path / "room.npy", *words, *CAMERA) == 0
    assert predict(model, "--corpus", toy_corpus.path, "--frame", 5, "--out", tmp_path) == 0
    room, clean = (json.loads((tmp_path / f"{name}.json").read_text()) for name in ("room", "frame_000005"))
    assert room["joints"] == clean["joints"]
    assert (room["near"], room["far"], clean["far"]) == (0.5, 5.0, None)


def test_a_box_says_where_the_person_is(model, png, tmp_path):
    assert predict(model, png, "--box", 20, 10, 44, 30, "--out", tmp_path, *CAMERA) == 0
    assert json.loads((tmp_path / "seen.json").read_text())["box"] == [20, 10, 44, 30]


def bad_files(folder):
    image = np.full((48, 64), 1500, np.uint16)
    whole = cv2.imencode(".png", image)[1].tobytes()
    (folder / "bits.png").write_bytes(cv2.imencode(".png", image.astype(np.uint8))[1].tobytes())
    (folder / "colour.png").write_bytes(cv2.imencode(".png", np.dstack([image] * 3))[1].tobytes())
    (folder / "cut.png").write_bytes(whole[:-30])
    (folder / "spoilt.png").write_bytes(whole[:20] + b"\xff\xff" + whole[22:])
    (folder / "text.png").write_text("no picture")
    np.save(folder / "metres.npy", image / 1000.0)
    np.save(folder / "deep.npy", np.full((48, 64), 70000, np.int32))
    np.save(folder / "flat.npy", image.reshape(-1))
    np.save(folder / "objects.npy", np.array([{}]), allow_pickle=True)
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(buffer, {"descr": "<u2", "fortran_order": False, "shape": (10**6, 10**6)})
    (folder / "huge.npy").write_bytes(buffer.getvalue())
    (folder / "folder.png").mkdir()
    np.save(folder / "empty.npy", np.zeros((48, 64), np.uint16))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("missing.png", "there is no file"),
        ("bits.png", "has 8 bits a pixel, must have at least 16"),
        ("colour.png", "has 3 channels, must have one"),
        ("cut.png", "is damaged: the PNG is incomplete"),
        ("spoilt.png", "is damaged: a part of the PNG has another checksum"),
        ("text.png", "is not a PNG file"),
        ("deep.npy", "integers are read as millimetres, but the values go up to 70000 "),
        ("flat.npy", "must hold integers or floats of shape (height, width)"),
        ("objects.npy", "is damaged, or does not hold a plain array"),
        ("huge.npy", "is damaged, or does not hold a plain array"),
        ("folder.png", "has no depth files: none ends in .png, .npy"),
        ("empty.npy", "shows nothing between 0 and inf m"),
    ],
)
def test_files_that_hold_no_depth_are_one_line(model, tmp_path, capsys, name, message):
    bad_files(tmp_path)
    assert predict(model, tmp_path / name, "--out", tmp_path / "out", *CAMERA) == 1
    assert message in error_line(capsys)
    assert not any((tmp_path / "out").glob("*"))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "give depth images, or --corpus DIR --frame N"),
        (["PNG"], "the camera is needed: give either --camera NAME or --intrinsics"),
        (["PNG", "--camera", "kinect_v2", *CAMERA], "the camera is needed: give either"),
        (["PNG", "--camera", "kinect_v9"], "camera 'kinect_v9' is unknown; known cameras: azure_kinect"),
        (["PNG", "--camera", "kinect_v2"], "is 64x48, but the camera kinect_v2 has 512x424"),
        (["PNG", "--intrinsics", "0", "60", "31", "23"], "fx and fy above 0"),
        (["PNG", "--intrinsics", "60", "60", "nan", "23"], "must be finite"),
        (["PNG", "PNG", *CAMERA], "several images are called seen"),
        (["PNG", "--frame", "3", *CAMERA], "--frame and --sensor need --corpus DIR"),
        (["PNG", "--corpus", "CORPUS", "--frame", "3"], "give depth images, or --corpus"),
        (["--corpus", "CORPUS"], "--corpus needs --frame N"),
        (["--corpus", "CORPUS", "--frame", "3", "--smooth"], "--smooth needs a sequence of files"),
        (["--corpus", "CORPUS", "--frame", "200"], "frame 200 is not in"),
        (["--corpus", "CORPUS", "--frame", "3", "--sensor", "eye"], "sensor 'eye' is unknown"),
        (["PNG", "--box", "0", "0", "2", "2", *CAMERA], "shows nothing in the box between 0 and inf m"),
        (["PNG", "--far", "0.5", *CAMERA], "shows nothing between 0 and 0.5 m"),
    ],
)
def test_wrong_requests_are_one_line(model, png, toy_corpus, tmp_path, capsys, words, message):
    places = {"PNG": str(png), "CORPUS": str(toy_corpus.path)}
    assert predict(model, *(places.get(word, word) for word in words), "--out", tmp_path / "out") == 1
    assert message in error_line(capsys)


@pytest.mark.parametrize("words", [["--near", "2", "--far", "1"], ["--box", "5", "5", "5", "9"]])
def test_ranges_that_hold_nothing_end_with_code_2(model, png, words):
    with pytest.raises(SystemExit) as caught:
        predict(model, png, *words, *CAMERA)
    assert caught.value.code == 2


def test_models_that_cannot_be_asked_are_one_line(png, tmp_path, capsys):
    (tmp_path / "notes").write_text("not a model, but text")
    write_model(tmp_path / "other", "svm", {}, {})
    write_model(tmp_path / "hollow", "oarf", {}, {})
    for name, message in (
        ("missing", "there is no model file"),
        ("notes", "is no model file: it is not in the safetensors format"),
        ("other", "holds a model of kind 'svm'; known are oarf"),
        ("hollow", "holds no usable model"),
    ):
        assert predict(tmp_path / name, png, *CAMERA) == 1
        assert message in error_line(capsys)


def estimate_of(xyz, hidden):
    proposals = np.tile(np.asarray(xyz, np.float32), (N_JOINTS, 1, 1))
    ones = np.ones((N_JOINTS, 1), np.float32)
    return JointEstimate(
        proposals,
        ones,
        ones[:, 0],
        np.full(N_JOINTS, hidden, np.float32),
        ones[:, 0],
        Intrinsics(60, 60, 31.5, 23.5),
    )


def test_a_joint_that_was_not_found_is_null():
    values = joint_values(estimate_of((np.nan,) * 3, np.nan), JOINT_NAMES)["head"]
    assert values["xyz"] is values["uv"] is values["hidden_probability"] is None
    assert values["proposals"] == []


def test_the_person_and_the_other_heading_are_told():
    other = replace(estimate_of((0.1, 0, 2), 0.1), heading=-2.5, heading_probability=0.2)
    estimate = replace(
        estimate_of((0, 0, 2), 0.1),
        heading=0.25,
        heading_probability=0.7,
        person_probability=0.9,
        alternative=other,
    )
    values = body_values(estimate, JOINT_NAMES)
    assert (values["heading"], values["heading_probability"], values["person_probability"]) == (0.25, 0.7, 0.9)
    assert values["alternative"]["heading"] == -2.5
    assert values["alternative"]["joints"]["head"] == [0.1, 0.0, 2.0]
    assert values["joints"]["head"]["xyz"] == [0.0, 0.0, 2.0]
    alone = body_values(estimate_of((0, 0, 2), 0.1), JOINT_NAMES)
    assert alone["heading"] is alone["alternative"] is alone["person_probability"] is None


def test_nothing_is_drawn_where_there_is_probably_nobody():
    depth = np.zeros((48, 64), np.uint16)
    depth[8:40, 8:56] = 2000
    somebody = replace(estimate_of((0, 0, 2), 0.1), person_probability=0.6)
    drawn, bare, empty = (
        overlay(depth, estimate, JOINT_NAMES)
        for estimate in (
            somebody,
            replace(somebody, person_probability=0.4),
            estimate_of((np.nan,) * 3, np.nan),
        )
    )
    assert (drawn != empty).any()
    np.testing.assert_array_equal(bare, empty)


def test_hidden_joints_are_hollow():
    depth = np.zeros((48, 64), np.uint16)
    depth[8:40, 8:56] = 2000
    seen, hidden, nothing = (
        overlay(depth, estimate_of(xyz, share), JOINT_NAMES)
        for xyz, share in (((0, 0, 2), 0.1), ((0, 0, 2), 0.9), ((np.nan,) * 3, np.nan))
    )
    of_joint = np.argwhere((seen != nothing).any(axis=2))
    of_hole = np.argwhere((seen != hidden).any(axis=2))
    assert np.abs(of_joint.mean(axis=0) - of_hole.mean(axis=0)).max() < 1
    assert 5 < np.ptp(of_hole, axis=0).min() < np.ptp(of_joint, axis=0).max() - 4 < 20


def test_pixels_have_the_colours_of_contact_sheets():
    colours = label_colours(np.array([[0, 1, 2, 3]], np.uint8), ("neck", "table", "occluder"))[0]
    assert np.array_equal(colours[0], palette.NO_RETURN)
    assert np.array_equal(colours[1], palette.PART_COLOURS[PART["neck"]])
    assert np.array_equal(colours[2], palette.CLASS_COLOURS[1])
    assert np.array_equal(colours[3], palette.FAINT)


def test_labels_of_pixels_are_drawn_beside_the_depth(toy_corpus):
    depth = toy_corpus.arrays("depth", [5])[0]
    labels = (depth > 0).astype(np.uint8) * 2
    alone = overlay(depth, estimate_of((0, 0, 2), 0.1), JOINT_NAMES)
    beside = overlay(depth, estimate_of((0, 0, 2), 0.1), JOINT_NAMES, PixelLabels(labels, ("neck", "table")))
    width = alone.shape[1]
    assert np.array_equal(beside[:100, :width], alone[:100])
    assert beside.shape[1] > 1.9 * width
    right = beside[: PANEL_HEIGHT // 2, width:]
    light = palette.CLASS_COLOURS[1]
    of_light, of_dark = ((right == colour).all(axis=2).mean() for colour in (light, light // 2))
    assert of_light + of_dark > 0.3
    assert of_light == pytest.approx(of_dark, rel=0.05)
