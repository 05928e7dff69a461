"""Tracking measured by a public implementation of the measures, on people who walk about."""

import numpy as np
import pytest

from pipelines.online.tracker import Tracker
from tests.pipelines.online.walkers import detected, walk

mm = pytest.importorskip("motmetrics", reason="motmetrics is not installed")


def measured(truth, messages, skip=3):
    """MOTA and switches of the tracker; the first frames, in which nobody can be known yet, do not count."""
    tracker, score = Tracker(), mm.MOTAccumulator(auto_id=True)
    for k, message in enumerate(messages):
        told = tracker.update(message).persons
        if k < skip:
            continue
        people = np.flatnonzero(truth.is_there[k])
        squares = (
            (truth.places[k][people][:, None] - np.array([p.place for p in told]).reshape(1, -1, 2)) ** 2
        ).sum(2)
        score.update(people, [p.track_id for p in told], np.where(squares <= 0.5**2, squares, np.nan))
    names = ["mota", "num_switches", "num_objects"]
    return mm.metrics.create().compute(score, metrics=names, name="walk").iloc[0]


@pytest.mark.parametrize("seed", range(2))
def test_walking_people_are_tracked(seed):
    rng = np.random.default_rng(seed)
    truth = walk(rng, n_people=6, n_frames=300)
    found = measured(truth, detected(truth, rng))
    assert found.mota >= 0.9
    assert found.num_switches <= max(1, found.num_objects / 1000)
