"""Tracks: one a person, the same one after short occlusions, none for a moment's mistake."""

import numpy as np
import pytest

from pipelines.online.messages import NS, Detections
from pipelines.online.tracker import StaleMessageError, Tracker, TrackerSettings, matched
from tests.pipelines.online.walkers import FPS, detected, detection, walk


def run(messages, settings=None):
    tracker = Tracker(settings or TrackerSettings())
    return [tracker.update(message) for message in messages]


def straight(n, speed=1.0, start=(0.0, 0.0), gap=(), height=1.7, first=0):
    """One person who walks along x and is not detected in some frames."""
    for k in range(first, first + n):
        place = (start[0] + speed * k / FPS, start[1])
        yield Detections(k * NS // FPS, "floor", () if k in gap else (detection(place, height),))


def test_a_track_learns_place_and_velocity():
    person = run(straight(60))[-1].persons[0]
    np.testing.assert_allclose(person.place, (59 / FPS, 0), atol=0.01)
    np.testing.assert_allclose(person.velocity, (1, 0), atol=0.05)
    assert np.linalg.eigvalsh(person.covariance).min() > 0
    assert person.unseen_s == 0


def test_somebody_seen_once_or_twice_is_not_told_of():
    messages = list(straight(40))
    only_two = [m if k < 2 else Detections(m.stamp, "floor", ()) for k, m in enumerate(messages)]
    assert all(not tracks.persons for tracks in run(only_two))


def test_places_that_are_doubtful_never_become_people():
    doubtful = [Detections(k * NS // FPS, "floor", (detection((1, 1), confidence=0.6),)) for k in range(60)]
    assert all(not tracks.persons for tracks in run(doubtful))


@pytest.mark.parametrize("gap_s", [0.2, 1.0, 2.0])
def test_who_is_hidden_for_a_while_keeps_the_number(gap_s):
    gap = range(60, 60 + int(gap_s * FPS))
    told = run(straight(180, speed=0.6, gap=gap))
    numbers = {person.track_id for tracks in told for person in tracks.persons}
    assert len(numbers) == 1
    assert told[-1].persons


def test_who_is_gone_for_long_gets_a_new_number():
    settings = TrackerSettings(lost_s=1.0)
    numbers = {
        p.track_id for tracks in run(straight(180, 0.1, gap=range(60, 120)), settings) for p in tracks.persons
    }
    assert len(numbers) == 2


def test_another_height_is_another_person_after_an_occlusion():
    before = list(straight(60, 0.0))
    after = list(straight(60, 0.0, height=1.2, first=90))
    numbers = [{p.track_id for p in tracks.persons} for tracks in run(before + after)]
    assert numbers[59]
    assert numbers[-1]
    assert not numbers[59] & numbers[-1]


def test_two_people_who_cross_keep_their_numbers():
    def at(k):
        x = 2.0 * k / 90 - 1.0
        return Detections(k * NS // FPS, "floor", (detection((x, 0.1)), detection((-x, -0.1), height=1.8)))

    told = run(at(k) for k in range(90))
    owner = {p.track_id: p.place[0] > 0 for p in told[10].persons}
    assert {p.track_id: p.place[0] < 0 for p in told[-1].persons} == owner


def test_numbers_are_never_used_again():
    tracker = Tracker()
    seen = []
    for message in straight(10):
        seen += [p.track_id for p in tracker.update(message).persons]
    tracker.restart()
    for message in straight(10):
        seen += [-p.track_id for p in tracker.update(message).persons]
    assert {n for n in seen if n > 0}.isdisjoint({-n for n in seen if n < 0})
    assert min(seen) < 0 < max(seen)


def test_the_order_of_detections_does_not_matter():
    rng = np.random.default_rng(3)
    messages = list(detected(walk(rng, n_frames=120), rng))
    turned = [Detections(m.stamp, m.frame_id, m.people[::-1]) for m in messages]
    for one, other in zip(run(messages), run(turned), strict=True):
        np.testing.assert_array_equal(
            sorted(tuple(p.place) for p in one.persons), sorted(tuple(p.place) for p in other.persons)
        )


def test_time_that_does_not_pass_is_refused_and_changes_nothing():
    tracker = Tracker()
    messages = list(straight(30))
    for message in messages[:-1]:
        tracker.update(message)
    for old in messages[:-1]:
        with pytest.raises(StaleMessageError, match="before the last"):
            tracker.update(old)
    np.testing.assert_array_equal(
        tracker.update(messages[-1]).persons[0].place, run(messages)[-1].persons[0].place
    )


def test_assignment_is_as_cheap_as_the_cheapest_of_all_permutations():
    from itertools import permutations

    rng = np.random.default_rng(5)
    for _ in range(50):
        cost = rng.uniform(0, 1, (4, 5))
        cost[rng.uniform(size=cost.shape) < 0.4] = np.inf
        pairs = matched(cost)
        best = min(
            (-sum(np.isfinite(values)), sum(v for v in values if np.isfinite(v)))
            for values in ([cost[i, j] for i, j in enumerate(columns)] for columns in permutations(range(5), 4))
        )
        assert (-len(pairs), pytest.approx(sum(cost[i, j] for i, j in pairs))) == best


def test_settings_that_make_no_sense_are_refused():
    for wrong in ({"gate": 0.0}, {"sure": 1.5}, {"told_s": 9.0}, {"n_confirm": 0}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            TrackerSettings(**wrong)
