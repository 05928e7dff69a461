"""Numbered tasks are dealt once each, neighbours to one worker."""

import pytest

from pipelines.engine.dealing import Dealer


@pytest.mark.parametrize(("n_tasks", "n_workers"), [(0, 1), (1, 4), (7, 2), (100, 3), (5, 0)])
def test_every_task_is_dealt_once(n_tasks, n_workers):
    numbers = [3 * k + 1 for k in range(n_tasks)]
    dealer = Dealer(numbers, range(n_workers))
    asking = [*range(n_workers), "late"]
    dealt = []
    while (number := dealer.next_for(asking[len(dealt) % len(asking)])) is not None:
        dealt.append(number)
    assert sorted(dealt) == numbers
    assert all(dealer.next_for(worker) is None for worker in asking)


def test_a_worker_goes_through_neighbours_and_then_helps_from_the_end():
    dealer = Dealer(range(10), ["a", "b"])
    assert [dealer.next_for("a") for _ in range(6)] == [0, 1, 2, 3, 4, 9]
    assert [dealer.next_for("b") for _ in range(5)] == [5, 6, 7, 8, None]
