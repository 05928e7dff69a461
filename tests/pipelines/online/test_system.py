"""The whole without a finder: walking people in, answers of the right tracks out, and bad input told once."""

from dataclasses import replace

import numpy as np
import pytest

from forests.frames import Intrinsics
from pipelines.online.detecting import Seen
from pipelines.online.given import placed
from pipelines.online.messages import (
    NS,
    CameraFrame,
    Detections,
    Notice,
    OrientationResult,
    Plan,
    TrackedPerson,
    TrackedPersons,
)
from pipelines.online.modules.inline import InlineModules
from pipelines.online.modules.jobs import ModuleSettings
from pipelines.online.notices import Notices
from pipelines.online.planner import PlannerSettings
from pipelines.online.system import OnlineSystem, SystemSettings
from tests.pipelines.online.walkers import FPS, detected, walk

KIND = "tests.pipelines.online.faulty:Obedient"
CAMERA = Intrinsics(100, 100, 32, 24)
T_FLOOR_CAMERA = np.array([[0, 0, 1.0, -1], [-1, 0, 0, 2.5], [0, -1, 0, 1.4], [0, 0, 0, 1]])


class Played:
    """A detector that tells what it was given, by stamp."""

    def __init__(self, messages):
        self.messages = {message.stamp: message for message in messages}

    def detect(self, frame):
        nobody = Detections(frame.stamp, "floor", ())
        return Seen(self.messages.get(frame.stamp, nobody), T_FLOOR_CAMERA, None, False)


def frame_at(k, **changes):
    whole = CameraFrame(k * NS // FPS, "camera", np.full((48, 64), 2000, np.uint16), CAMERA)
    return replace(whole, **changes)


def system_of(messages, model="fine", budget_s=0.02):
    modules = InlineModules((ModuleSettings("orientation", KIND, model, cost_s=0.001),))
    system = OnlineSystem(Played(messages), modules, SystemSettings(planner=PlannerSettings(budget_s=budget_s)))
    heard = []
    system.bus.subscribe(object, heard.append)
    return system, heard


def of_kind(heard, kind):
    return [message for message in heard if isinstance(message, kind)]


@pytest.fixture
def messages():
    rng = np.random.default_rng(4)
    return list(detected(walk(rng, n_people=5, n_frames=90), rng))


def test_every_answer_carries_stamp_frame_and_track(messages):
    system, heard = system_of(messages)
    for k in range(90):
        system.step(frame_at(k))
    tracks = {t.stamp: {p.track_id for p in t.persons} for t in of_kind(heard, TrackedPersons)}
    results = of_kind(heard, OrientationResult)
    assert len(results) > 300
    for result in results:
        assert result.frame_id == "camera"
        assert result.track_id in tracks[result.stamp]
    assert not of_kind(heard, Notice)


def test_every_person_of_every_image_is_asked_about_or_skipped_with_a_reason(messages):
    system, heard = system_of(messages, budget_s=0.003)
    for k in range(90):
        system.step(frame_at(k))
    n_skips = 0
    for tracks, plan in zip(of_kind(heard, TrackedPersons), of_kind(heard, Plan), strict=True):
        asked = [r.track_id for r in plan.requests] + [s.track_id for s in plan.skips]
        assert sorted(asked) == sorted(p.track_id for p in tracks.persons)
        assert all(skip.reason for skip in plan.skips)
        assert plan.spent_s <= plan.budget_s + 1e-9
        n_skips += len(plan.skips)
    assert n_skips > 50


@pytest.mark.parametrize(
    ("kind", "changes"),
    [
        ("unusable images", {"depth": np.zeros((48, 64), np.float32)}),
        ("unusable images", {"depth": np.zeros((0, 64), np.uint16)}),
        ("unusable cameras", {"camera": Intrinsics(0.0, 100, 32, 24)}),
        ("unusable cameras", {"camera": Intrinsics(np.nan, 100, 32, 24)}),
        ("unusable poses", {"T_world_camera": np.full((4, 4), np.nan)}),
        ("late images", {"stamp": 3 * NS // FPS}),
    ],
)
def test_a_bad_image_is_told_and_left_out(messages, kind, changes, caplog):
    system, heard = system_of(messages)
    notices = Notices()
    system.bus.subscribe(Notice, notices.take)
    for k in range(90):
        if 20 <= k < 25:
            system.step(frame_at(k, **changes))
        system.step(frame_at(k))
    assert notices.counts == {kind: 5}
    assert len(caplog.records) == 1
    assert notices.summary() == [f"{kind}: 5 times in all"]
    assert len(of_kind(heard, TrackedPersons)) == 90


def test_time_that_runs_backwards_begins_anew(messages):
    system, heard = system_of(messages)
    for k in [*range(90), *range(90)]:
        system.step(frame_at(k))
    told = of_kind(heard, TrackedPersons)
    first, second = ({p.track_id for t in part for p in t.persons} for part in (told[:90], told[90:]))
    assert first
    assert second
    assert first.isdisjoint(second)
    assert [n.kind for n in of_kind(heard, Notice)] == ["time ran backwards"]


def test_an_empty_box_is_told_and_no_module_sees_it(messages):
    empty = [replace(m, people=tuple(replace(p, box=(9.0, 9.0, 9.0, 20.0)) for p in m.people)) for m in messages]
    system, heard = system_of(empty)
    for k in range(90):
        system.step(frame_at(k))
    assert {n.kind for n in of_kind(heard, Notice)} == {"empty boxes"}
    assert not of_kind(heard, OrientationResult)


def test_a_module_that_raises_is_told_and_goes_on(messages):
    system, heard = system_of(messages, model=f"raise@{40 * NS // FPS}")
    for k in range(90):
        system.step(frame_at(k))
    assert [n.kind for n in of_kind(heard, Notice)] == ["module orientation failed"]
    assert {r.stamp for r in of_kind(heard, OrientationResult)} >= {k * NS // FPS for k in (39, 41, 89)}


def test_tracks_of_another_tracker_are_taken_instead(messages):
    system, heard = system_of(messages)
    for k in range(5):
        person = TrackedPerson(77, np.array([1.0, 2.5]), np.zeros(2), np.eye(4), 1.7, 1.0, 1.0, 0.0, None)
        system.step(frame_at(k), TrackedPersons(k * NS // FPS, "floor", (person,)))
    assert {r.track_id for r in of_kind(heard, OrientationResult)} == {77}


def test_given_tracks_are_seen_where_the_image_shows_something_at_their_distance():
    def at(x, y):
        person = TrackedPerson(1, np.array([x, y]), np.zeros(2), np.eye(4), 1.7, 1.0, 1.0, 0.0, None)
        return placed(TrackedPersons(0, "floor", (person,)), frame_at(0), T_FLOOR_CAMERA).persons[0].detection

    # The image shows a wall 2 m before the camera, which stands at x = -1, y = 2.5 and looks along x.
    found = at(1.0, 2.5)
    assert found.visible == 1.0
    assert found.distance == pytest.approx(2.0)
    left, top, right, bottom = found.box
    assert left < 32 < right
    assert 0 <= top < bottom <= 48
    assert at(3.0, 2.5) is None
    assert at(-3.0, 2.5) is None
    assert at(1.0, 9.0) is None
