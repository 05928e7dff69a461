"""The page shows everybody who is followed, and forgets who is gone."""

import numpy as np
import pytest

pytest.importorskip("viser", reason="viser is not installed")

from pipelines.online.messages import CameraPose, Plan, TrackedPerson, TrackedPersons, TrackSkeleton
from pipelines.viewer.page import Page
from tests.pipelines.online.test_system import T_FLOOR_CAMERA, frame_at

JOINTS = ("head", "neck", "torso")


@pytest.fixture
def page():
    shown = Page(port=0)
    frame = frame_at(0)
    shown.take(frame)
    shown.take(CameraPose(0, "floor", "camera", T_FLOOR_CAMERA))
    person = TrackedPerson(7, np.array([1.5, 0.0]), np.array([0.0, 1.0]), np.eye(4), 1.7, 0.9, 1.0, 0.0, None)
    shown.take(TrackedPersons(0, "floor", (person,)))
    positions = np.array([[1.5, 0, 1.6], [1.5, 0, 1.4], [1.5, 0, 1.1]], np.float32)
    values = (np.full(3, 0.9, np.float32), np.full(3, 0.02, np.float32), np.array([0, 1, np.nan], np.float32))
    shown.take(TrackSkeleton(0, "floor", 7, "walks", JOINTS, positions, *values))
    shown.take(Plan(0, (), (), 0.0, 0.02))
    yield shown
    shown.close()


def test_who_is_gone_is_shown_no_more(page):
    assert set(page._shown) == {7}
    assert set(page._skeletons) == {(7, "walks")}
    page.take(TrackedPersons(1, "floor", ()))
    assert not page._shown
    assert not page._skeletons
