"""undergrowth live: people who walk through a room are followed, analysed, and recorded under their numbers."""

import cv2
import numpy as np
import pytest

from forests.frames import FrameSubset
from forests.growing import GrowthConfig
from forests.rwf.config import RWFConfig
from forests.rwf.storage import save_model
from forests.rwf.train import train
from pipelines.cli import main
from pipelines.corpus.sequence import CorpusFrames
from tests.reference_finder import cast, figure, standing

INTRINSICS = ("--intrinsics", "182", "182", "127.5", "105.5")
N = 16


@pytest.fixture(scope="module")
def model(toy_corpus, tmp_path_factory):
    out = tmp_path_factory.mktemp("live") / "walks"
    frames = FrameSubset(CorpusFrames(toy_corpus, toy_corpus.split("train")), tuple(range(0, 140, 10)))
    save_model(out, train(frames, RWFConfig(n_points=20, growth=GrowthConfig(max_depth=4, n_candidates=10))))
    return out


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two people who walk past each other, a third who stands."""
    out = tmp_path_factory.mktemp("live") / "walking"
    out.mkdir()
    for k in range(N):
        step = 0.04 * k
        places = ((2.4, -0.7 + step), (3.4, 0.8 - step), (3.0, -1.3))
        image = cast(standing(), [part for place in places for part in figure(*place)], wall=5.5)
        cv2.imwrite(str(out / f"d_{k:02d}.png"), image)
    return out


def live(*words):
    return main(["live", *map(str, words)])


def test_everybody_keeps_one_number_and_is_analysed(folder, model, tmp_path, capsys):
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    out = tmp_path / "out.mcap"
    assert live(folder, "--walks", model, *INTRINSICS, "--no-processes", "--record", out) == 0
    printed = capsys.readouterr().out
    assert f"{N} images, 3 tracks," in printed
    assert "walks: " in printed
    assert str(out) in printed
    mcap = pytest.importorskip("mcap_ros2.reader", reason="mcap-ros2-support is not installed")
    topic = "/spencer/perception_internal/people_tracking/rgbd_front_top/tracked_persons"
    told = [item.ros_msg for item in mcap.read_ros2_messages(str(out), topics=[topic])]
    assert len(told) == N
    last = {t.track_id: t for t in told[-1].tracks}
    speeds = sorted(abs(t.twist.twist.linear.y) for t in last.values())
    np.testing.assert_allclose(speeds, [0.0, 1.2, 1.2], atol=0.3)
    # What was recorded plays again, without a camera being told.
    assert live(out, "--no-processes") == 0
    assert f"{N} images, 3 tracks," in capsys.readouterr().out


def test_the_same_source_gives_the_same_bytes(folder, model, tmp_path):
    pytest.importorskip("rosbags", reason="rosbags is not installed")
    files = [tmp_path / "a.mcap", tmp_path / "b.mcap"]
    for path in files:
        live(folder, *INTRINSICS, "--no-processes", "--record", path, "--frames", 6)
    assert files[0].read_bytes() == files[1].read_bytes()


def test_damaged_files_are_told_once_and_counted(folder, tmp_path, capsys):
    bad = tmp_path / "bad"
    bad.mkdir()
    for k, path in enumerate(sorted(folder.iterdir())[:6]):
        (bad / path.name).write_bytes(b"nonsense" if k in (2, 3) else path.read_bytes())
    assert live(bad, *INTRINSICS, "--no-processes") == 0
    printed = capsys.readouterr().out
    assert printed.count("warning: ") == 1
    assert "unreadable files: 2 times in all" in printed
    assert "4 images" in printed


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--walks", "missing"), "there is no file missing"),
        (("--topic", "/a", "--sensor", "kinect_v2"), "--sensor is for generated corpora"),
    ],
)
def test_wrong_settings_are_one_clear_line(folder, words, message, capsys):
    assert live(folder, *INTRINSICS, "--no-processes", *words) == 1
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--fps", "0"), "fps=0.0 must be above 0"),
        (("--planner.budget-s", "-1"), "budget_s=-1.0 must be above 0"),
    ],
)
def test_values_that_make_no_sense_are_refused(folder, words, message, capsys):
    with pytest.raises(SystemExit):
        live(folder, *INTRINSICS, *words)
    assert message in capsys.readouterr().err
