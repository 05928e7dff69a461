"""Calculating with values of a graph gives what numpy gives."""

import numpy as np
import pytest

from nets.graph import Graph
from nets.values import LAST, Value, constant, counted, joined, repeated, zeros

pytest.importorskip("onnx", reason="onnx is not installed")
runtime = pytest.importorskip("onnxruntime", reason="onnxruntime is not installed")

A = np.array([[3.5, -1.25, 0.0], [2.0, 7.75, -4.5]], np.float32)
K = np.array([5, -3, 2, 2, 9], np.int64)


def check(build, wanted):
    """Compares what a graph with the inputs a (2, 3) float32 and k (5,) int64 puts out."""
    graph = Graph()
    a = Value(graph, graph.input("a", "rows", "columns"), np.float32)
    k = Value(graph, graph.input("k", "n", dtype=np.int64), np.int64)
    results = build(a, k)
    names = [f"out{number}" for number in range(len(results))]
    for name, value, array in zip(names, results, wanted, strict=True):
        value.called(name)
        graph.output(name, *(f"{name}_{axis}" for axis in range(array.ndim)), dtype=value.dtype)
    session = runtime.InferenceSession(graph.finish({}), providers=["CPUExecutionProvider"])
    for array, other in zip(session.run(names, {"a": A, "k": K}), wanted, strict=True):
        np.testing.assert_array_equal(array, other)


def test_arithmetic_is_that_of_arrays():
    check(
        lambda a, k: [
            a * 2.0 - a / 4.0 + a.floor(),
            k / 2 * 2,
            (a > 0.0).where(a, -1.0),
            a.most(-1.0).least(3.0),
            a.cast(np.int32),
            ((k >= 2) & ~k.equals(9)).cast(np.int64),
        ],
        [
            A * 2 - A / 4 + np.floor(A),
            np.trunc(K / 2).astype(np.int64) * 2,
            np.where(A > 0, A, -1.0),
            A.clip(-1, 3),
            A.astype(np.int32),
            ((K >= 2) & (K != 9)).astype(np.int64),
        ],
    )


def test_what_moves_values_does_what_numpy_does():
    check(
        lambda a, k: [
            a.sum(1),
            a.max(0, keepdims=True),
            a.first_of_most(1),
            k.running_sum(0),
            a.turned(1, 0).part([1], [LAST], [0]),
            k.at(np.array([[1, 4]])),
            (a > 0.0).true_places(),
            joined([counted(k.size(0)), zeros(np.int64, [2], k.graph)], 0),
            a.at_each(constant(a.graph, np.array([[1, 1], [0, 2]]))),
            k.sorted(constant(k.graph, np.array([5])), 0, is_rising=True)[1],
        ],
        [
            A.sum(1),
            A.max(0, keepdims=True),
            A.argmax(1),
            np.cumsum(K),
            A.T[1:],
            K[[[1, 4]]],
            np.array(np.nonzero(A > 0)),
            np.array([0, 1, 2, 3, 4, 0, 0]),
            A[[1, 0], [1, 2]],
            np.argsort(K, kind="stable"),
        ],
    )


@pytest.mark.parametrize(("most", "n_steps"), [(3, 3), (50, 7)])
def test_a_loop_ends_when_it_is_told_or_has_gone_far_enough(most, n_steps):
    def build(a, k):
        def step(state):
            [here] = state
            there = here * 2.0
            return there.reshaped(-1).max(0) < 500.0, [there], [there]

        (end,), (way,) = repeated(step, [a], most)
        return [end, way]

    check(build, [A * 2**n_steps, np.stack([A * 2**n for n in range(1, n_steps + 1)])])


def test_arrays_are_kept_once():
    graph = Graph()
    values = [constant(graph, np.arange(n)) for n in (3, 4, 3)]
    assert values[0].name == values[2].name != values[1].name


def test_one_of_two_alternatives_must_have_a_type():
    graph = Graph()
    with pytest.raises(TypeError, match="must be a value"):
        constant(graph, np.ones(2, bool)).where(1.0, 2.0)
