"""Recorded frames in the report and the demo: examples by rule, scores of known joints, folders of any kind."""

import re
import subprocess
from pathlib import Path

import cv2
import numpy as np
import pytest
from toy_recording import LAYOUT, NAMES, silhouette, standing, write_layout, write_recording

from forests.estimate import JointEstimate
from pipelines.cli import main
from pipelines.errors import UserError
from pipelines.metrics import read_truths
from pipelines.models.asking import Contestant
from pipelines.predicting.recording import N_ASKED, N_SHOWN, Folder, ask_recording
from pipelines.recordings.layout import read_layout
from synth.vocabulary import JOINT_NAMES, N_JOINTS
from tests.pipelines.ablate.test_run import TINY
from tests.pipelines.report.test_report import BROWSER, FITS, Page, answers_of, write_folder

KNOWN = [name for name in NAMES if not name.endswith("_hip")]


class Answering:
    """Says that somebody stands as in the recording's first frame, some way off; without a place for the head."""

    def __init__(self, off_m):
        self.off_m = off_m

    def predict(self, depth, camera, box=None):
        joints = (standing() + np.array([0, 0, self.off_m])).astype(np.float32)
        joints[0] = np.nan
        ones = np.ones(N_JOINTS, np.float32)
        return JointEstimate(joints[:, None], ones[:, None], ones, 0 * ones, ones, camera)


def model(name, off_m=0.0):
    return Contestant(name, Answering(off_m), JOINT_NAMES)


def recorded(folder, layout):
    return Folder(folder, "mine", read_layout(Path(layout)))


# Asking


def test_scores_are_over_the_known_joints(tmp_path):
    folder = write_recording(tmp_path / "recording", 3)
    path = write_layout(folder, joints=KNOWN)
    found = ask_recording(recorded(folder, path), {"near": model("near", 0.03), "far": model("far", 0.2)})
    assert (found.name, found.layout, found.n_frames, found.n_asked) == ("recording", "mine", 3, 3)
    # The person walks 1 cm a frame; the head is never answered.
    error = np.hypot(0.03, [0.0, 0.01, 0.02]).mean()
    near, far = found.scores["near"], found.scores["far"]
    assert near.n_joints == 3 * len(KNOWN)
    assert near.within == pytest.approx(1 - 1 / len(KNOWN))
    assert near.mean_m == pytest.approx(error, abs=1e-4)
    assert (far.n_joints, far.within) == (near.n_joints, 0.0)


def test_frames_are_evenly_spread_and_without_joints_there_are_no_scores(tmp_path):
    folder = write_recording(tmp_path / "recording", 1)
    path = write_layout(folder, joints=[])
    for k in range(N_ASKED * 2):
        cv2.imwrite(str(folder / f"d_{k}.png"), silhouette(standing()))
    found = ask_recording(recorded(folder, path), {"semantic": model("semantic")})
    assert (found.n_frames, found.n_asked, len(found.shown)) == (2 * N_ASKED, N_ASKED, N_SHOWN)
    assert (found.shown[0].key, found.shown[-1].key) == ("d_0", f"d_{2 * N_ASKED - 1}")
    assert not found.scores


def test_what_cannot_be_read_is_left_out_and_told(tmp_path):
    folder = write_recording(tmp_path / "recording", 3)
    (folder / "d_6.png").write_bytes(b"no picture")
    found = ask_recording(recorded(folder, write_layout(folder)), {"semantic": model("semantic")})
    assert (found.n_frames, found.n_asked) == (3, 2)
    assert ["d_6.png is not a PNG" in reason for reason in found.skipped] == [True]
    assert [item.key for item in found.shown] == ["d_5", "d_7"]


def test_a_folder_of_nothing_readable_has_no_examples(tmp_path):
    folder = write_recording(tmp_path / "recording", 1)
    (folder / "d_5.png").write_bytes(b"no picture")
    found = ask_recording(recorded(folder, write_layout(folder)), {"semantic": model("semantic")})
    assert (found.n_asked, found.shown, found.scores) == (0, (), {})
    with pytest.raises(UserError, match="has no files"):
        ask_recording(recorded(tmp_path, write_layout(folder)), {"semantic": model("semantic")})


# The report


@pytest.fixture(scope="module")
def made(tmp_path_factory, toy_corpus):
    """An ablation's folder with files in place of models."""
    answers = answers_of(read_truths(toy_corpus, toy_corpus.split("test")), ("baseline", "semantic", "rwf"))
    return write_folder(tmp_path_factory.mktemp("report") / "a", toy_corpus, answers, models=tuple(answers))


@pytest.fixture
def report(made, toy_corpus, monkeypatch):
    """Runs the command with models that answer."""
    monkeypatch.setattr("pipelines.report.models.open_model", lambda path: (model(path.stem), {}))

    def run(out, *words):
        return main(["report", str(made), "--corpus", str(toy_corpus.path), "--out", str(out), *map(str, words)])

    return run


def test_the_page_shows_recorded_frames_and_is_the_same_again(report, tmp_path):
    folder, other = (write_recording(tmp_path / name, 9) for name in ("one & two", "joints"))
    layout = write_layout(folder, joints=KNOWN)
    words = ("--recorded", folder, other, "--layout", layout)
    assert report(tmp_path / "a.html", *words) == 0
    assert report(tmp_path / "b.html", *words) == 0
    text = (tmp_path / "a.html").read_text()
    assert text == (tmp_path / "b.html").read_text()
    page = Page(text)
    assert len(page.ids) == len(set(page.ids))
    assert all(source.startswith("data:image/") for source in page.sources)
    assert list(page.cells("recorded-0")) == [
        "Baseline",
        "OARF with semantics",
        "Random walks, learned with objects",
    ]
    assert page.cells("recorded-1")["Baseline"][0] == str(9 * len(KNOWN))
    section = text[text.index('<section id="recorded">') :]
    section = section[: section.index("</section>")]
    assert "<h3>one &amp; two</h3>" in section
    for words in ("depth", "joints of the recording", "joints, with semantics", "joints, random walks"):
        assert section.count(f'alt="{words}"') == 2 * N_SHOWN, words
    assert 'alt="joints, baseline"' not in section


def test_without_recordings_there_is_no_section(report, tmp_path):
    assert report(tmp_path / "a.html") == 0
    assert 'id="recorded"' not in (tmp_path / "a.html").read_text()


def test_without_joints_there_is_neither_truth_nor_table(report, tmp_path):
    folder = write_recording(tmp_path / "recording", 2)
    assert report(tmp_path / "a.html", "--recorded", folder, "--layout", write_layout(folder, joints=[])) == 0
    text = (tmp_path / "a.html").read_text()
    assert text.count('alt="joints, random walks"') >= 2
    assert "joints of the recording" not in text
    assert 'id="recorded-0"' not in text


def test_models_that_are_gone_and_folders_of_no_layout_are_one_line(made, toy_corpus, tmp_path, capsys):
    folder = write_recording(tmp_path / "recording", 2)
    gone = write_folder(
        tmp_path / "gone", toy_corpus, answers_of(read_truths(toy_corpus, toy_corpus.split("test")), ("baseline",))
    )
    words = ("--corpus", str(toy_corpus.path), "--out", str(tmp_path / "r.html"), "--recorded", str(folder))
    assert main(["report", str(gone), *words, "--layout", write_layout(folder)]) == 1
    assert "holds no models that could predict the recorded frames" in capsys.readouterr().err
    assert main(["report", str(made), *words]) == 1
    assert "fits no known layout" in capsys.readouterr().err
    assert not (tmp_path / "r.html").exists()


@pytest.mark.skipif(BROWSER is None, reason="there is no chromium or google-chrome")
def test_recorded_frames_fit_a_phone(report, tmp_path):
    folder = write_recording(tmp_path / "a folder of quite a long name", 3)
    assert report(tmp_path / "page.html", "--recorded", folder, "--layout", write_layout(folder)) == 0
    (tmp_path / "frame.html").write_text(FITS.format(390))
    options = ["--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--dump-dom"]
    options += ["--allow-file-access-from-files", f"--user-data-dir={tmp_path / 'profile'}"]
    command = [BROWSER, *options, "--window-size=1300,1000", f"file://{tmp_path / 'frame.html'}"]
    dom = subprocess.run(command, capture_output=True, text=True, check=True, timeout=100).stdout
    assert "<title>390 of 390</title>" in dom


# The demo


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    """Runs the demo at a tiny size; the forests are trained once."""
    out = tmp_path_factory.mktemp("demo")
    (out / "tiny.toml").write_text(TINY.replace("n_seeds = 2", "n_seeds = 1"))

    def run(*words):
        command = ["demo", "--out", str(out / "demo"), "--config", str(out / "tiny.toml")]
        return main([*command, *map(str, words)]), out / "demo"

    return run


def test_the_demo_shows_skeletons_on_a_real_folder(demo, tmp_path, capsys, monkeypatch):
    folder = write_recording(tmp_path / "my recording", 3)
    layout = write_layout(folder)
    monkeypatch.chdir(tmp_path)
    code, out = demo("--real", "my recording", "--layout", layout)
    assert code == 0
    for method in ("semantic", "rwf"):
        written = {path.name for path in (out / "recorded" / "my recording" / method).iterdir()}
        assert {"d_5.json", "d_5.overlay.png", "d_7.overlay.png", "sheet.png", "skeletons.jsonl"} <= written
    told = capsys.readouterr().out
    assert f"{out / 'recorded' / 'my recording' / 'rwf' / 'sheet.png'}" in told
    assert re.search(r"my recording, OARF with semantics: \d+\.\d % of 45 known joints within 10 cm", told)
    assert told.strip().splitlines()[-1] == f"report: {out / 'report.html'}"
    page = (out / "report.html").read_text()
    assert "<h3>my recording</h3>" in page
    assert page.count('alt="joints of the recording"') == 3


def test_the_demo_takes_plain_pngs_with_a_camera_and_goes_on_after_a_damaged_one(demo, tmp_path, capsys):
    folder = tmp_path / "plain"
    folder.mkdir()
    for k in range(3):
        depth = np.full((240, 320), 4000, np.uint16)
        body = silhouette(standing())
        depth[60:108, 100:164] = np.where(body > 0, body, 4000)
        cv2.imwrite(str(folder / f"f{k}.png"), depth)
    (folder / "f1.png").write_bytes(b"")
    code, out = demo("--real", folder, "--camera", "kinect_v1_qvga", "--far", "3")
    assert code == 1
    told = capsys.readouterr().out
    assert "f1.png is not a PNG file" in told
    assert (out / "recorded" / "plain" / "semantic" / "f2.overlay.png").exists()
    assert "Left out, because they cannot be read" in (out / "report.html").read_text()


def test_the_demo_says_what_is_missing_before_it_trains(tmp_path, capsys):
    folder = write_recording(tmp_path / "recording", 1)
    for words, message in (
        (("--real", folder), "fits no known layout .*--layout.*plain depth files need --camera NAME"),
        (("--real", tmp_path / "nowhere"), "nowhere is not a folder"),
        (("--real", folder, "--camera", "kinect"), "camera 'kinect' is unknown; known cameras: "),
    ):
        assert main(["demo", "--out", str(tmp_path / "demo"), *map(str, words)]) == 1
        assert re.search(message, capsys.readouterr().err)
    assert not (tmp_path / "demo").exists()


@pytest.mark.parametrize(
    "words", [("--layout", "itop"), ("--far", "2"), ("--real", "x", "--far", "2"), ("--real", "x", "--far", "-1")]
)
def test_settings_of_no_folder_end_with_code_2(words):
    with pytest.raises(SystemExit) as caught:
        main(["demo", *words])
    assert caught.value.code == 2


def test_layouts_that_are_files_may_be_relative(demo, tmp_path, monkeypatch):
    folder = write_recording(tmp_path / "recording", 1)
    (tmp_path / "mine.toml").write_text(LAYOUT.format(format="png"))
    monkeypatch.chdir(tmp_path)
    code, out = demo("--real", folder, "--layout", "mine.toml")
    assert code == 0
    assert (out / "recorded" / "recording" / "rwf" / "sheet.png").exists()
