"""Answers go to the tracks that they belong to, and skeletons over time are one track's."""

import numpy as np
import pytest

from pipelines.online.book import TrackBook
from pipelines.online.messages import (
    NS,
    Notice,
    OrientationResult,
    SkeletonResult,
    TrackedPerson,
    TrackedPersons,
    TrackSkeleton,
)
from pipelines.online.tracker import Tracker
from tests.pipelines.online.walkers import FPS, detected, walk

HERE = np.eye(4)
JOINTS = ("head", "neck")


def skeleton(stamp, track_id, place, module="walks", confidence=0.9):
    positions = np.repeat(np.array([[*place, 1.0]], np.float32), 2, axis=0)
    values = (np.full(2, value, np.float32) for value in (confidence, 0.02, 0.1))
    return SkeletonResult(stamp, "camera", track_id, module, 0.001, JOINTS, positions, *values)


def persons(stamp, *ids, velocity=(0.0, 0.0)):
    told = (
        TrackedPerson(k, np.array([3.0, 0.0]), np.array(velocity), np.eye(4), 1.7, 0.9, 1, 0, None) for k in ids
    )
    return TrackedPersons(stamp, "floor", tuple(told))


def test_ten_thousand_shuffled_delayed_and_repeated_answers_never_reach_a_wrong_track():
    rng = np.random.default_rng(7)
    truth = walk(rng, n_people=8, n_frames=330)
    tracker, book = Tracker(), TrackBook()
    waiting, told = [], []
    n_taken = n_refused = n_sent = 0
    for message in detected(truth, rng):
        tracks = tracker.update(message)
        book.turn(tracks)
        for person in tracks.persons:
            for module in ("walks", "skeleton"):
                answer = skeleton(message.stamp, person.track_id, person.place, module)
                late = (int(rng.exponential(4)) for _ in range(1 + int(rng.integers(3))))
                waiting += [(len(told) + delay, answer) for delay in late]
        due = [answer for when, answer in waiting if when <= len(told)]
        waiting = [pair for pair in waiting if pair[0] > len(told)]
        for k in rng.permutation(len(due)):
            n_sent += 1
            taken = book.take(due[k], HERE, "floor")
            n_refused += isinstance(taken, Notice)
            if isinstance(taken, TrackSkeleton):
                n_taken += 1
                own = book.last(due[k].track_id, due[k].module)
                assert own is due[k]
                assert taken.track_id == due[k].track_id
                # The place was told of the image's own track; smoothing lags behind the fastest by a few centimetres.
                assert np.linalg.norm(taken.positions[0, :2] - due[k].positions[0, :2]) < 0.25
        told.append(tracks)
    assert n_sent >= 10_000
    assert n_taken > 1000
    assert n_refused > 1000


def test_an_answer_about_an_unknown_track_is_refused():
    book = TrackBook()
    book.turn(persons(0, 1))
    refused = book.take(skeleton(0, 2, (0, 0)), HERE, "floor")
    assert isinstance(refused, Notice)
    assert "track 2" in refused.sentence


@pytest.mark.parametrize("stamp", [-1, 2 * NS])
def test_an_answer_of_a_time_without_the_track_is_refused(stamp):
    book = TrackBook()
    book.turn(persons(0, 1))
    book.turn(persons(NS, 1))
    assert isinstance(book.take(skeleton(stamp, 1, (0, 0)), HERE, "floor"), Notice)


def test_the_same_answer_twice_counts_once():
    book = TrackBook()
    book.turn(persons(0, 1))
    assert isinstance(book.take(skeleton(0, 1, (0, 0)), HERE, "floor"), TrackSkeleton)
    assert isinstance(book.take(skeleton(0, 1, (9, 9)), HERE, "floor"), Notice)


def test_smoothing_does_not_depend_on_where_the_camera_moves():
    """A person stands still, the camera drives: in the floor's frame of reference nothing moves."""
    book = TrackBook()
    for k in range(20):
        book.turn(persons(k * NS // FPS, 1))
        pose = np.eye(4)
        pose[0, 3] = 0.05 * k
        told = book.take(skeleton(k * NS // FPS, 1, (2.0 - 0.05 * k, 0.0)), pose, "world")
    np.testing.assert_allclose(told.positions[0], (2, 0, 1), atol=1e-4)


def test_smoothing_halves_the_jitter_of_a_standing_person():
    rng = np.random.default_rng(2)
    book, raw, smooth = TrackBook(), [], []
    for k in range(200):
        book.turn(persons(k * NS // FPS, 1))
        answer = skeleton(k * NS // FPS, 1, rng.normal(0, 0.03, 2), confidence=0.7)
        told = book.take(answer, HERE, "floor")
        raw.append(answer.positions)
        smooth.append(told.positions)
    jitter = [np.linalg.norm(np.diff(values, axis=0), axis=2).mean() for values in (raw, smooth)]
    assert jitter[1] < jitter[0] / 2


def test_a_gap_begins_the_skeleton_anew():
    book = TrackBook()
    for stamp, place in ((0, 0.0), (NS // 30, 0.0), (2 * NS, 5.0)):
        book.turn(persons(stamp, 1))
        told = book.take(skeleton(stamp, 1, (place, 0)), HERE, "floor")
    np.testing.assert_allclose(told.positions[0, 0], 5.0)


def test_the_planner_is_told_of_distance_approach_facing_and_staleness():
    book = TrackBook()
    tracks = persons(5 * NS, 1, velocity=(-1.0, 0.0))
    book.turn(persons(0, 1))
    book.turn(tracks)
    seen = book.states(tracks, HERE, ("walks", "orientation"))
    assert seen.distance == pytest.approx(3)
    assert seen.approach == pytest.approx(1)
    assert seen.facing == pytest.approx(1)
    np.testing.assert_allclose(seen.stale, [[6, 6]])
    answer = OrientationResult(5 * NS, "camera", 1, "orientation", 0.001, "body", np.pi, 9.0, 0.9, "standing", 0.9)
    assert book.take(answer, HERE, "floor") is None
    seen = book.states(tracks, HERE, ("walks", "orientation"))
    assert seen.facing == pytest.approx(-1)
    np.testing.assert_allclose(seen.stale, [[6, 0]])
