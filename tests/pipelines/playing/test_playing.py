"""Images are played in the order and at the time at which they were taken."""

from types import SimpleNamespace

import numpy as np
import pytest

from forests.frames import Intrinsics
from pipelines.errors import UserError
from pipelines.online.messages import NS, CameraFrame, Notice
from pipelines.playing.pace import paced
from pipelines.playing.sources import BETWEEN_CLIPS_S, CorpusSource, PlayOptions, open_source


def frame(seconds):
    return CameraFrame(round(seconds * NS), "camera", np.ones((2, 2), np.uint16), Intrinsics(1, 1, 1, 1))


class Clock:
    """Time that passes only while somebody sleeps or works."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds


def test_images_come_when_they_were_taken():
    clock, times = Clock(), []
    for _ in paced([frame(5 + k / 10) for k in range(5)], clock, clock.sleep):
        times.append(clock.now)
        clock.now += 0.03
    np.testing.assert_allclose(np.diff(times), 0.1)


def test_who_is_too_slow_gets_the_newest_images_and_is_told_of_the_others():
    clock, played, told = Clock(), [], 0
    for item in paced([frame(k / 10) for k in range(40)], clock, clock.sleep):
        if isinstance(item, Notice):
            told += 1
            continue
        played.append(item.stamp)
        assert clock.now - 100 - item.stamp / NS <= 0.1 + 1e-9
        clock.now += 0.25
    assert told + len(played) == 40
    assert told > 15


def test_a_gap_or_a_new_beginning_is_not_waited_for():
    clock = Clock()
    items = list(paced([frame(0), frame(3600), frame(0.5), frame(0.6)], clock, clock.sleep))
    assert len(items) == 4
    assert clock.now == pytest.approx(100.1)


def test_clips_follow_one_another_and_views_do_not_mix():
    split, clip, step, view = np.array(
        [(s, c, t, v) for s in (0, 1) for c in (0, 1) for t in range(4) for v in (0, 1)]
    ).T
    arrays = {"split": split, "clip": clip, "time": step, "view": view}
    header = SimpleNamespace(fields=arrays, config={"scene": {"fps": 10.0}})
    corpus = SimpleNamespace(indices=np.arange(32), header=header, arrays=arrays.__getitem__)
    numbers, stamps = CorpusSource("x")._order(corpus)
    assert numbers.tolist() == list(range(0, 32, 2))
    gaps = np.diff(stamps).reshape(-1) / NS
    is_clip = np.arange(15) % 4 != 3
    np.testing.assert_allclose(gaps[is_clip], 0.1)
    np.testing.assert_allclose(gaps[~is_clip], BETWEEN_CLIPS_S)


def test_what_is_no_source_is_one_clear_error(tmp_path):
    with pytest.raises(UserError, match="there is no file or folder"):
        open_source(tmp_path / "missing", PlayOptions())
    with pytest.raises(UserError, match="--sensor is for generated corpora"):
        open_source(tmp_path, PlayOptions(sensor="kinect_v2"))
