"""The floor is found once, and anew when the camera may stand anywhere."""

from dataclasses import replace

import numpy as np
import pytest

from forests.finder.find import Found
from pipelines.online import detecting
from pipelines.online.detecting import DetectorSettings, PersonDetector
from pipelines.online.messages import NS
from tests.pipelines.online.test_system import frame_at


class Nobody:
    """A finder that finds nobody on the floor that it is told."""

    def find(self, depth, camera, floor, score):
        return Found((), floor if hasattr(floor, "T_floor_camera") else None)


@pytest.fixture
def floors(monkeypatch):
    """The heights that the floor is found at, by time in seconds; and when it was looked for."""
    looked = []

    def find_floor(depth, camera, prior):
        height = int(depth[0, 0]) / 1000
        looked.append(height)
        return detecting.Floor(np.array([0.0, -1.0, 0.0]), height)

    monkeypatch.setattr(detecting, "find_floor", find_floor)
    return looked


def seen(detector, seconds, height):
    frame = replace(frame_at(0, depth=np.full((4, 4), int(1000 * height), np.uint16)), stamp=int(seconds * NS))
    return detector.detect(frame)


def test_a_floor_is_believed_until_another_is_found_twice(floors):
    detector = PersonDetector(Nobody(), DetectorSettings(check_every=3))
    heights = [1.2] + [1.6] * 6
    found = [seen(detector, k / 30, height) for k, height in enumerate(heights)]
    assert [one.is_moved for one in found] == [False, False, False, False, True, False, False]
    assert [one.T_floor_camera[2, 3] for one in found] == [1.2] * 4 + [1.6] * 3
    assert len(floors) == 3


@pytest.mark.parametrize("later", [30.0, -30.0])
def test_after_a_long_gap_the_floor_is_found_anew_at_once(floors, later):
    detector = PersonDetector(Nobody(), DetectorSettings(check_every=100))
    for k in range(4):
        assert seen(detector, 100 + k / 30, 1.2).T_floor_camera[2, 3] == 1.2
    found = seen(detector, 100 + later, 1.6)
    assert found.T_floor_camera[2, 3] == 1.6
    assert not found.is_moved
    assert floors == [1.2, 1.6]
    seen(detector, 100 + later + 4.0, 1.9)
    assert floors == [1.2, 1.6]
