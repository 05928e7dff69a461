"""Laws of the planner, on drawn states."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from pipelines.online.planner import (
    BUDGET,
    CHOSEN,
    DOWN,
    FAR,
    FRESH,
    UNSEEN,
    ModuleStates,
    PlannerSettings,
    TrackStates,
    decide,
)

SETTINGS = PlannerSettings(budget_s=0.01)


def tracks_of(seed, n, m):
    rng = np.random.default_rng(seed)
    facing = np.where(rng.uniform(size=n) < 0.2, np.nan, rng.uniform(-1, 1, n))
    return TrackStates(
        rng.uniform(0.5, 8, n),
        rng.uniform(-2, 2, n),
        facing,
        rng.uniform(0, 1, n),
        rng.uniform(size=n) < 0.8,
        rng.exponential(0.3, (n, m)),
    )


def modules_of(seed, m):
    rng = np.random.default_rng(seed)
    return ModuleStates(
        rng.uniform(0.0005, 0.015, m),
        rng.uniform(0, 0.1, m),
        rng.uniform(4, 9, m),
        rng.uniform(0.5, 2, m),
        rng.uniform(size=m) < 0.8,
    )


states = st.tuples(st.integers(0, 2**32), st.integers(0, 20), st.integers(1, 4))


@given(states)
@settings(max_examples=60, deadline=None)
def test_whoever_is_nearer_facing_and_staler_is_not_passed_over(drawn):
    seed, n, m = drawn
    tracks, modules = tracks_of(seed, n, m), modules_of(seed, m)
    code = decide(tracks, modules, SETTINGS).code
    facing = np.nan_to_num(tracks.facing, nan=0.0)
    for column in range(m):
        for chosen in np.flatnonzero(code[:, column] == CHOSEN):
            is_before = (
                (tracks.distance < tracks.distance[chosen])
                & (tracks.approach >= tracks.approach[chosen])
                & (facing >= facing[chosen])
                & (tracks.visible >= tracks.visible[chosen])
                & (tracks.stale[:, column] >= tracks.stale[chosen, column])
            )
            assert not (is_before & (code[:, column] == BUDGET)).any()


@given(states)
@settings(max_examples=40, deadline=None)
def test_every_pair_is_chosen_or_has_its_reason(drawn):
    seed, n, m = drawn
    tracks, modules = tracks_of(seed, n, m), modules_of(seed, m)
    told = decide(tracks, modules, SETTINGS)
    assert set(map(tuple, told.order.tolist())) == set(map(tuple, np.argwhere(told.code == CHOSEN).tolist()))
    assert (np.diff([told.priority[i, j] for i, j in told.order]) <= 0).all()
    for i in range(n):
        for j in range(m):
            expected = {
                DOWN: not modules.is_up[j],
                UNSEEN: not tracks.is_seen[i],
                FAR: tracks.distance[i] > modules.reach[j],
                FRESH: tracks.stale[i, j] < modules.interval[j],
            }
            reason = next((code for code, holds in expected.items() if holds), None)
            assert told.code[i, j] == reason if reason is not None else told.code[i, j] in (CHOSEN, BUDGET)


@given(st.integers(0, 2**32))
@settings(max_examples=15, deadline=None)
def test_over_time_the_budget_holds_but_for_one_answer(seed):
    modules = modules_of(seed, 3)
    credit, spent = 0.0, []
    for k in range(60):
        told = decide(tracks_of(seed + k, 12, 3), modules, SETTINGS, credit)
        assert told.spent_s <= SETTINGS.budget_s + credit + 1e-12
        assert np.isclose(told.spent_s, sum(modules.cost[j] for _, j in told.order))
        credit = told.credit_s
        spent.append(told.spent_s)
    most = modules.cost[modules.is_up].max(initial=0.0)
    total = np.concatenate([[0.0], np.cumsum(spent)])
    for begin in range(60):
        lengths = np.arange(1, 61 - begin)
        assert (total[begin + 1 :] - total[begin] <= SETTINGS.budget_s * lengths + most + 1e-9).all()


@given(st.integers(0, 2**32))
@settings(max_examples=8, deadline=None)
def test_nobody_in_view_starves(seed):
    rng = np.random.default_rng(seed)
    n, m, dt = 20, 3, 1 / 30
    modules = modules_of(seed, m)._replace(is_up=np.ones(m, bool), reach=np.full(m, 20.0))
    tracks = tracks_of(seed, n, m)._replace(is_seen=np.ones(n, bool))
    # Everybody's turn comes once the last term outweighs all others, and the queue before them is done.
    others = SETTINGS.near + SETTINGS.approach + SETTINGS.facing + SETTINGS.visible
    ratio = modules.weight.max() / modules.weight.min()
    longest = ratio * (
        others * SETTINGS.stale_s / SETTINGS.stale + 2 * n * modules.cost.sum() / SETTINGS.budget_s * dt
    )
    credit, stale = 0.0, np.zeros((n, m))
    for _ in range(int(3 * longest / dt)):
        stale += dt
        told = decide(tracks._replace(stale=stale, distance=rng.uniform(0.5, 8, n)), modules, SETTINGS, credit)
        credit = told.credit_s
        stale[told.code == CHOSEN] = 0
        assert stale.max() <= longest + modules.interval.max() + dt


def test_the_same_state_gives_the_same_decision_and_stays_as_it_was():
    tracks, modules = tracks_of(1, 10, 3), modules_of(1, 3)
    before = [values.copy() for values in (*tracks, *modules)]
    one, other = decide(tracks, modules, SETTINGS, 0.001), decide(tracks, modules, SETTINGS, 0.001)
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a, b)
    for a, b in zip(before, (*tracks, *modules), strict=True):
        np.testing.assert_array_equal(a, b)


def test_a_module_too_costly_for_one_image_saves_up():
    modules = ModuleStates(np.array([0.035]), np.zeros(1), np.full(1, 9.0), np.ones(1), np.ones(1, bool))
    tracks = tracks_of(2, 1, 1)._replace(is_seen=np.ones(1, bool), stale=np.full((1, 1), 9.0))
    credit, chosen = 0.0, []
    for _ in range(16):
        told = decide(tracks, modules, SETTINGS, credit)
        credit = told.credit_s
        chosen.append(len(told.order))
    assert sum(chosen) == 4
    assert chosen.index(1) == 3
