"""undergrowth predict on recordings: files of every kind, folders by layout, damaged files, smoothing, sheets."""

import json
import os
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest
from toy_recording import CAMERA, LAYOUT, silhouette, standing, write_layout, write_recording

from forests.boxes import upper_foreground_box
from forests.estimate import JointEstimate
from forests.frames import FrameSubset
from forests.growing import GrowthConfig
from forests.oarf.config import OARFConfig
from forests.oarf.storage import save_model as save_oarf
from forests.oarf.train import train as train_oarf
from forests.rwf.config import RWFConfig
from forests.rwf.storage import save_model as save_rwf
from forests.rwf.train import train as train_rwf
from forests.smoothing import FORGOTTEN_S
from pipelines.cli import main
from pipelines.corpus.sequence import CorpusFrames
from pipelines.drawing.tiles import N_SHOWN
from pipelines.models.asking import ask
from pipelines.models.opening import open_model
from pipelines.predicting.smooth import TrackSmoother
from pipelines.spread import first_to_last
from synth.vocabulary import JOINT_NAMES, N_JOINTS
from tests.shared_data import SHARED

REAL = SHARED / "data" / "real"
INTRINSICS = ("--intrinsics", "60", "60", "31.5", "23.5")
PEOPLE = """
[[foreground.boxes]]
pixels = [0, 0, 32, 48]

[[foreground.boxes]]
pixels = [32, 0, 64, 48]
"""


@pytest.fixture(scope="module")
def models(toy_corpus, tmp_path_factory):
    """A model file of each kind."""
    out = tmp_path_factory.mktemp("models")
    frames = FrameSubset(CorpusFrames(toy_corpus, toy_corpus.split("train")), tuple(range(0, 140, 10)))
    growth = GrowthConfig(max_depth=4, n_candidates=10)
    save_oarf(
        out / "oarf", train_oarf(frames, OARFConfig(n_trees=1, n_pixels=40, growth=growth), validation=frames)
    )
    save_rwf(out / "rwf", train_rwf(frames, RWFConfig(n_points=20, growth=growth), validation=None))
    return out


@pytest.fixture
def folder(tmp_path):
    return write_recording(tmp_path / "my recording", 4)


def predict(model, *words):
    return main(["predict", str(model), *map(str, words)])


def lines_of(out):
    return [json.loads(line) for line in (out / "skeletons.jsonl").read_text().splitlines()]


def names_of(out):
    return sorted(path.name for path in out.iterdir())


def joints_of(path):
    return json.loads(path.read_text())["joints"]


def error_line(capsys):
    err = [line for line in capsys.readouterr().err.splitlines() if line.startswith("undergrowth")]
    assert len(err) == 1
    return err[0]


@pytest.mark.parametrize("kind", ["oarf", "rwf"])
def test_a_folder_is_a_sequence_in_the_order_of_its_numbers(models, folder, tmp_path, kind):
    (tmp_path / "d_9.png").write_bytes((folder / "d_5.png").read_bytes())
    out = tmp_path / "out"
    assert predict(models / kind, folder, "--layout", write_layout(folder, joints=[]), "--out", out) == 0
    names = [f"d_{n}" for n in (5, 6, 7, 8)]
    assert names_of(out) == sorted(
        [f"{n}.json" for n in names] + [f"{n}.overlay.png" for n in names] + ["sheet.png", "skeletons.jsonl"]
    )
    lines = lines_of(out)
    assert [line.pop("name") for line in lines] == names
    assert lines == [json.loads((out / f"{name}.json").read_text()) for name in names]
    assert lines[0]["camera"] == {"fx": 60, "fy": 60, "cx": 31.5, "cy": 23.5}
    assert cv2.imread(str(out / "sheet.png")).std() > 5


def test_a_folder_whose_layout_has_joints_needs_none_of_them(models, folder, tmp_path):
    layout = write_layout(folder)
    for path in folder.glob("j_*"):
        path.unlink()
    assert predict(models / "oarf", folder, "--layout", layout, "--out", tmp_path / "out") == 0


def test_a_recognised_folder_needs_no_camera_and_neither_do_its_files(models, tmp_path):
    depth = cv2.resize(silhouette(standing()), (640, 480), interpolation=cv2.INTER_NEAREST)
    depth[depth > 0] = 1500
    depth[:, :20] = 3000
    for n in (1, 2, 10):
        depth.astype("<u2").tofile(tmp_path / f"depth-data-{n}.raw")
    assert predict(models / "oarf", tmp_path, "--out", tmp_path / "a") == 0
    assert [line["name"] for line in lines_of(tmp_path / "a")] == [f"depth-data-{n}" for n in (1, 2, 10)]
    assert predict(models / "oarf", tmp_path / "depth-data-2.raw", "--out", tmp_path / "b") == 0
    assert names_of(tmp_path / "b") == ["depth-data-2.json", "depth-data-2.overlay.png"]
    assert joints_of(tmp_path / "a" / "depth-data-2.json") == joints_of(tmp_path / "b" / "depth-data-2.json")
    words = ("--camera", "kinect_v1", "--far", "1.7", "--out", tmp_path / "c")
    assert predict(models / "oarf", tmp_path / "depth-data-2.raw", *words) == 0
    camera = json.loads((tmp_path / "c" / "depth-data-2.json").read_text())["camera"]
    assert camera["fx"] == pytest.approx(575.816)


def test_every_format_gives_the_same_skeleton(models, tmp_path):
    import h5py

    depth = np.zeros((240, 320), np.uint16)
    depth[60:108, 100:164] = silhouette(standing())
    cv2.imwrite(str(tmp_path / "a.png"), depth)
    np.save(tmp_path / "b.npy", depth.astype(np.int64))
    np.save(tmp_path / "c.npy", depth / 1000.0)
    depth.astype("<u2").tofile(tmp_path / "d.raw")
    rows = "\n".join(f"0 0 {z / 1000 if z else np.nan:.3f}" for z in depth.ravel())
    (tmp_path / "e.pcd").write_text(
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 320\nHEIGHT 240\n"
        f"POINTS {depth.size}\nDATA ascii\n{rows}\n"
    )
    with h5py.File(tmp_path / "f.h5", "w") as file:
        file["data"] = (depth[None] / 1000.0).astype(np.float32)
    files = sorted(tmp_path.iterdir())
    out = tmp_path / "out"
    assert predict(models / "oarf", *files, "--camera", "kinect_v1_qvga", "--out", out) == 0
    lines = lines_of(out)
    assert [line["name"] for line in lines] == ["a", "b", "c", "d", "e", "f_0"]
    assert all(line["joints"] == lines[0]["joints"] for line in lines)


def test_each_person_of_an_image_is_told_apart(models, tmp_path):
    (tmp_path / "two.toml").write_text(LAYOUT.format(format="png") + PEOPLE)
    both = silhouette(standing(-0.7)) + silhouette(standing(0.7))
    cv2.imwrite(str(tmp_path / "d_1.png"), both)
    out = tmp_path / "out"
    layout = ("--layout", tmp_path / "two.toml")
    assert predict(models / "rwf", tmp_path / "d_1.png", *layout, "--out", out) == 0
    left, right = (joints_of(out / f"d_1_{k}.json")["neck"]["xyz"] for k in (0, 1))
    assert left[0] < -0.2 < 0.2 < right[0]
    assert [line["image"]["source"].rsplit(", ")[-1] for line in lines_of(out)] == ["person 0", "person 1"]


def test_a_damaged_file_loses_no_other_and_is_told(models, folder, tmp_path, capsys):
    (folder / "d_6.png").write_bytes((folder / "d_6.png").read_bytes()[:-30])
    cv2.imwrite(str(folder / "d_7.png"), np.zeros((48, 64), np.uint16))
    out = tmp_path / "out"
    layout = ("--layout", write_layout(folder, joints=[]))
    assert predict(models / "oarf", folder, *layout, "--out", out) == 1
    told = capsys.readouterr()
    assert "d_6.png is damaged: the PNG is incomplete" in told.out
    assert "d_7.png shows no person" in told.out
    assert "2 of 4 images were skipped" in told.err
    errors = [line.get("error", "") for line in lines_of(out)]
    assert [bool(error) for error in errors] == [False, True, True, False]
    assert {"d_5.json", "d_8.json", "sheet.png"} <= set(names_of(out))
    assert "d_6.json" not in names_of(out)


def test_every_and_no_pictures(models, folder, tmp_path):
    out = tmp_path / "out"
    words = ("--layout", write_layout(folder, joints=[]), "--every", "3", "--no-pictures", "--out", out)
    assert predict(models / "oarf", folder, *words) == 0
    assert names_of(out) == ["d_5.json", "d_8.json", "sheet.png", "skeletons.jsonl"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["FOLDER"], "fits no known layout .*plain depth files need --camera NAME or --intrinsics"),
        (["FOLDER", "--layout", "LAYOUT", *INTRINSICS], "a layout defines its camera"),
        (["FOLDER", "FOLDER", *INTRINSICS], "give one folder, or files only; 2 paths were given"),
        (["FOLDER", "--camera", "kinect_v2"], "no file that can be read; the first one failed: .*has 512x424"),
        (["FOLDER/d_5.png", "--layout", "itopp"], "layout 'itopp' is unknown"),
        (["FOLDER/a.raw", *INTRINSICS], "a.raw does not contain the size of its images"),
        (["FOLDER/a.raw", "FOLDER/b/a.raw", *INTRINSICS], "several images are called a,"),
        (["MIXED", *INTRINSICS], "has files of several kinds"),
        (["EMPTY", *INTRINSICS], "has no depth files: none ends in"),
    ],
)
def test_requests_that_do_not_fit_are_one_line(models, folder, tmp_path, capsys, words, message):
    for name in ("mixed", "empty"):
        (tmp_path / name).mkdir()
    for name in ("a.png", "b.npy"):
        (tmp_path / "mixed" / name).write_bytes(b"")
    places = {
        "FOLDER": folder,
        "LAYOUT": write_layout(folder),
        "MIXED": tmp_path / "mixed",
        "EMPTY": tmp_path / "empty",
    }
    told = []
    for word in words:
        head, _, rest = word.partition("/")
        told.append(places.get(head, head) if not rest else places[head] / rest)
    assert predict(models / "oarf", *told, "--out", tmp_path / "out") == 1
    assert re.search(message, error_line(capsys))


def test_a_plain_folder_with_a_camera_is_read_whole(models, folder, tmp_path):
    out = tmp_path / "out"
    (folder / "d_5.overlay.png").write_bytes(b"")
    assert predict(models / "oarf", folder, *INTRINSICS, "--out", out) == 0
    assert [line["name"] for line in lines_of(out)] == [f"d_{n}" for n in (5, 6, 7, 8)]


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda depth: depth.byteswap(), "the bytes look swapped"),
        (lambda depth: depth.astype(np.float32), "floats are read as metres, but the values go up to 1950"),
        (lambda depth: depth * np.uint16(10), "a median depth of 19.5 m .* mm_per_unit = 0.1"),
        (lambda depth: depth // np.uint16(10), "a median depth of 0.195 m.* mm_per_unit = 10"),
        (lambda depth: np.full_like(depth, 65535), "shows nothing"),
    ],
)
def test_depth_that_cannot_be_a_persons_is_never_answered(models, folder, tmp_path, capsys, spoil, message):
    layout = write_layout(folder, "npy", joints=[])
    for path in folder.glob("d_*.png"):
        np.save(path.with_suffix(".npy"), cv2.imread(str(path), cv2.IMREAD_UNCHANGED))
    np.save(folder / "d_6.npy", spoil(np.load(folder / "d_6.npy")))
    out = tmp_path / "out"
    assert predict(models / "oarf", folder / "d_6.npy", *INTRINSICS, "--out", out) == 1
    assert re.search(message, error_line(capsys))
    assert names_of(out) == []
    assert predict(models / "oarf", folder, "--layout", layout, "--out", out) == 1
    message = message.replace("shows nothing", "shows no person")
    assert [bool(re.search(message, line.get("error", ""))) for line in lines_of(out)] == [
        False,
        True,
        False,
        False,
    ]
    assert "d_6.json" not in names_of(out)


def test_what_is_only_unlikely_is_answered_and_told(models, folder, tmp_path, capsys):
    depth = cv2.imread(str(folder / "d_5.png"), cv2.IMREAD_UNCHANGED)
    cv2.imwrite(str(tmp_path / "far.png"), np.where(depth > 0, 9000, 0).astype(np.uint16))
    assert (
        predict(
            models / "oarf", tmp_path / "far.png", "--intrinsics", "200", "200", "31.5", "23.5", "--out", tmp_path
        )
        == 0
    )
    assert "warning: " in capsys.readouterr().out
    assert (tmp_path / "far.json").exists()


def test_grey_maps_tiff_and_exr_give_the_skeleton_of_the_png(models, folder, tmp_path):
    import OpenEXR

    depth = cv2.imread(str(folder / "d_5.png"), cv2.IMREAD_UNCHANGED)
    many = tmp_path / "many"
    many.mkdir()
    cv2.imwrite(str(many / "a.png"), depth)
    (many / "b.pgm").write_bytes(b"P5 64 48 65535\n" + depth.astype(">u2").tobytes())
    cv2.imwrite(str(many / "c.tif"), (depth / 1000.0).astype(np.float32))
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"Z": (depth / 1000.0).astype(np.float32)}) as file:
        file.write(str(many / "d.exr"))
    out = tmp_path / "out"
    assert predict(models / "oarf", *sorted(many.iterdir()), *INTRINSICS, "--out", out) == 0
    assert [line["name"] for line in lines_of(out)] == ["a", "b", "c", "d"]
    assert all(line["joints"] == lines_of(out)[0]["joints"] for line in lines_of(out))
    for suffix in (".pgm", ".tif", ".exr"):
        (tmp_path / suffix[1:]).mkdir()
        (path,) = many.glob(f"*{suffix}")
        for k in (1, 2):
            (tmp_path / suffix[1:] / f"{k}{suffix}").write_bytes(path.read_bytes())
        assert predict(models / "oarf", tmp_path / suffix[1:], *INTRINSICS, "--out", tmp_path / f"o{suffix}") == 0
        assert len(lines_of(tmp_path / f"o{suffix}")) == 2


def test_names_that_are_no_text_are_written_as_text(models, folder, tmp_path):
    strange = tmp_path / os.fsdecode(b"caf\xe9")
    strange.mkdir()
    data = (folder / "d_5.png").read_bytes()
    for name in (b"d_\xff1.png", b"d_\xff2.png", "d_\u00e93.png".encode()):
        (strange / os.fsdecode(name)).write_bytes(data)
    (strange / os.fsdecode(b"d_\xfe4.png")).write_bytes(data[:-30])
    layout = write_layout(folder, joints=[])
    for k, words in enumerate([[strange, "--layout", layout], [*sorted(strange.iterdir()), *INTRINSICS]]):
        out = tmp_path / str(k)
        assert predict(models / "oarf", *words, "--out", out) == 1
        names = [r"d_\xff1", r"d_\xff2", "d_\u00e93"]
        assert {line["name"] for line in lines_of(out)} == {*names, r"d_\xfe4"}
        (out / "skeletons.jsonl").read_bytes().decode("utf-8")
        assert {f"{name}.json" for name in names} | {f"{name}.overlay.png" for name in names} <= set(names_of(out))
        assert cv2.imread(str(out / f"{names[0]}.overlay.png")) is not None
        for line in lines_of(out):
            json.dumps(line, ensure_ascii=False).encode("utf-8")


# Starts of walks


@pytest.mark.parametrize("kind", ["whole", "arms up", "upper"])
def test_walks_start_on_the_upper_body_of_who_is_cut_out(kind):
    joints = standing()
    if kind == "arms up":
        for name in ("r_elbow", "l_elbow", "r_hand", "l_hand"):
            joints[JOINT_NAMES.index(name), 1] = -0.75
    depth = silhouette(joints)
    if kind == "upper":
        depth[24:] = 0
    box = upper_foreground_box(depth, CAMERA)
    u, v = (box[0] + box[2] - 1) / 2, (box[1] + box[3] - 1) / 2
    x, y = (u - CAMERA.cx) / CAMERA.fx * 1.95, (v - CAMERA.cy) / CAMERA.fy * 1.95
    assert abs(x) < 0.06
    assert -0.5 < y < -0.25


def test_nothing_has_no_upper_body():
    assert upper_foreground_box(np.zeros((4, 4), np.uint16), CAMERA) is None


def test_only_models_that_need_a_start_are_given_one(models):
    told = []

    class Spy:
        def predict(self, depth, camera, box=None):
            told.append(box)

    depth = silhouette(standing())
    for kind in ("oarf", "rwf"):
        contestant = replace(open_model(models / kind)[0], predictor=Spy())
        ask(contestant, depth, CAMERA)
        ask(contestant, depth, CAMERA, (1, 2, 3, 4))
    assert told == [None, (1, 2, 3, 4), upper_foreground_box(depth, CAMERA), (1, 2, 3, 4)]


# Smoothing


def estimate_of(xyz, probability=0.9, confidence=5.0):
    there = np.isfinite(xyz).all(axis=1)
    return JointEstimate(
        np.asarray(xyz, np.float32)[:, None],
        np.where(there, confidence, 0.0).astype(np.float32)[:, None],
        np.full(N_JOINTS, probability, np.float32),
        np.full(N_JOINTS, np.nan, np.float32),
        np.full(N_JOINTS, 0.1, np.float32),
        CAMERA,
    )


@pytest.mark.parametrize("probability", [0.8, np.nan])
def test_smoothing_steadies_the_estimates_of_either_kind(probability):
    """Calibrated or not: the confidence of regression forests is no share, and is not taken for one."""
    rng = np.random.default_rng(0)
    truth = np.array([standing(0.005 * k) for k in range(60)])
    noisy = truth + rng.normal(0, 0.05, truth.shape)
    smoother = TrackSmoother(30.0)
    smooth = np.array(
        [smoother.smoothed("", k, estimate_of(xyz, probability)).joints for k, xyz in enumerate(noisy)]
    )
    assert np.abs(smooth - truth)[20:].mean() < 0.7 * np.abs(noisy - truth)[20:].mean()
    assert np.abs(np.diff(smooth, 2, axis=0))[20:].mean() < 0.4 * np.abs(np.diff(noisy, 2, axis=0))[20:].mean()


def test_a_joint_that_is_lost_goes_on_for_a_while_and_is_forgotten_then():
    smoother = TrackSmoother(10.0)
    lost = standing()
    lost[0] = np.nan
    assert np.isfinite(smoother.smoothed("", 0, estimate_of(standing())).joints).all()
    after = [smoother.smoothed("", k, estimate_of(lost)) for k in range(1, 9)]
    is_guessed = [bool(np.isfinite(estimate.joints[0]).all()) for estimate in after]
    assert is_guessed == [k / 10 <= FORGOTTEN_S for k in range(1, 9)]
    assert not after[0].confidence[0]


def test_people_and_long_gaps_are_not_smoothed_into_one_another():
    smoother = TrackSmoother(10.0)
    here, there = estimate_of(standing(-1.0)), estimate_of(standing(1.0))
    for k in range(5):
        smoother.smoothed("a", k, here)
        np.testing.assert_allclose(smoother.smoothed("b", k, there).joints, there.joints, atol=0.01)
    np.testing.assert_allclose(smoother.smoothed("a", 30, there).joints, there.joints, atol=1e-6)
    np.testing.assert_allclose(smoother.smoothed("a", 3, here).joints, here.joints, atol=1e-6)


@pytest.mark.parametrize("kind", ["oarf", "rwf"])
def test_the_command_smooths_and_says_so(models, folder, tmp_path, kind):
    layout = ("--layout", write_layout(folder, joints=[]))
    for name, words in {"raw": (), "smooth": ("--smooth", "--fps", "10")}.items():
        assert predict(models / kind, folder, *layout, *words, "--out", tmp_path / name) == 0
    raw, smooth = lines_of(tmp_path / "raw"), lines_of(tmp_path / "smooth")
    assert (raw[0]["smoothed_fps"], smooth[0]["smoothed_fps"]) == (None, 10)
    assert raw[0]["joints"]["head"]["xyz"] == pytest.approx(smooth[0]["joints"]["head"]["xyz"], abs=1e-5)
    assert raw[3]["joints"]["head"]["xyz"] != smooth[3]["joints"]["head"]["xyz"]


# Sheets


def test_a_sheet_shows_the_first_the_last_and_what_is_evenly_between():
    assert first_to_last(5, N_SHOWN).tolist() == [0, 1, 2, 3, 4]
    places = first_to_last(1000, N_SHOWN)
    assert (len(places), places[0], places[-1]) == (N_SHOWN, 0, 999)
    assert np.ptp(np.diff(places)) <= 1


# Recordings of others


@pytest.mark.parametrize(("name", "n_people"), [("skeltrack", 12), ("five_people", 5)])
def test_real_recordings_are_asked_about_without_a_word_on_them(models, tmp_path, name, n_people):
    if not (REAL / name).is_dir():
        pytest.skip(f"needs the recordings {REAL / name}")
    assert predict(models / "rwf", REAL / name, "--no-pictures", "--out", tmp_path / "out") == 0
    lines = lines_of(tmp_path / "out")
    assert len(lines) == n_people
    assert all(line["joints"]["head"]["xyz"] is not None for line in lines)
