"""Work on frames in threads: in order, a little ahead, and stopped by the first error."""

import threading
import time

import pytest

from forests.frames import in_order


@pytest.mark.parametrize("n_threads", [1, 2, 5])
def test_results_come_in_order_of_the_numbers(n_threads):
    def slow(number):
        time.sleep(0.002 * (number % 3))
        return number * number

    assert list(in_order(slow, 40, n_threads)) == [k * k for k in range(40)]
    assert list(in_order(slow, 0, n_threads)) == []


def test_work_is_not_far_ahead_of_the_reader():
    begun, lock = [], threading.Lock()

    def work(number):
        with lock:
            begun.append(number)
        return number

    results = in_order(work, 1000, 2)
    assert [next(results) for _ in range(3)] == [0, 1, 2]
    time.sleep(0.05)
    assert len(begun) <= 3 + 4 * 2 + 1
    results.close()
    assert len(begun) < 1000


@pytest.mark.parametrize("n_threads", [1, 3])
def test_an_error_reaches_the_reader_at_its_place(n_threads):
    def work(number):
        if number == 7:
            raise ValueError("seven")
        return number

    got = []
    with pytest.raises(ValueError, match="seven"):
        got.extend(in_order(work, 100, n_threads))
    assert got == list(range(7))
