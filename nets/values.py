"""Values in ONNX graphs, to calculate with as with arrays: `a + b` adds a node to the graph."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from nets.graph import Graph, Typed

LAST = 2**62
"""End of a slice: the end of the axis."""


class Value:
    """What a node of a graph puts out, or an input, or a constant.

    Numbers and arrays that it meets become constants of its type. As in ONNX, nothing else changes a type but
    `cast`, shapes are broadcast as in numpy, and integers are divided towards 0.

    Attributes:
        graph: Where it is.
        name: Its name there.
        dtype: Its type.
    """

    def __init__(self, graph: Graph, name: str, dtype: DTypeLike) -> None:
        self.graph, self.name, self.dtype = graph, name, np.dtype(dtype)

    def node(self, operator: str, *others: Operand, dtype: DTypeLike | None = None, **attributes: Any) -> Value:
        """A node whose first input this is, and its output.

        Args:
            operator: ONNX's name.
            others: Further inputs.
            dtype: Of the output; None = that of this value.
            attributes: Of the node.
        """
        inputs = [self.name, *(self.constant(other).name for other in others)]
        return Value(self.graph, self.graph.add(operator, inputs, **attributes), dtype or self.dtype)

    def constant(self, values: Operand) -> Value:
        """A number or an array of numbers as a value of this one's type; arrays that have a type keep it."""
        if isinstance(values, Value):
            return values
        array = values if isinstance(values, np.ndarray) else np.asarray(values, self.dtype)
        return constant(self.graph, array)

    def called(self, name: str) -> Value:
        """The same value under a name of its own."""
        return Value(self.graph, self.graph.add("Identity", [self.name], name), self.dtype)

    def cast(self, dtype: DTypeLike) -> Value:
        """As another type; reals are cut off towards 0."""
        return self.node("Cast", dtype=dtype, to=self.graph.number_of(dtype))

    def __add__(self, other: Operand) -> Value:
        return self.node("Add", other)

    def __sub__(self, other: Operand) -> Value:
        return self.node("Sub", other)

    def __mul__(self, other: Operand) -> Value:
        return self.node("Mul", other)

    def __truediv__(self, other: Operand) -> Value:
        return self.node("Div", other)

    def __and__(self, other: Value) -> Value:
        return self.node("And", other)

    def __invert__(self) -> Value:
        return self.node("Not")

    def __lt__(self, other: Operand) -> Value:
        return self.node("Less", other, dtype=bool)

    def __le__(self, other: Operand) -> Value:
        return self.node("LessOrEqual", other, dtype=bool)

    def __gt__(self, other: Operand) -> Value:
        return self.node("Greater", other, dtype=bool)

    def __ge__(self, other: Operand) -> Value:
        return self.node("GreaterOrEqual", other, dtype=bool)

    def equals(self, other: Operand) -> Value:
        """Where both are the same, bool."""
        return self.node("Equal", other, dtype=bool)

    def least(self, other: Operand) -> Value:
        """The lower of two."""
        return self.node("Min", other)

    def most(self, other: Operand) -> Value:
        """The greater of two."""
        return self.node("Max", other)

    def floor(self) -> Value:
        """The greatest whole number that is not above it."""
        return self.node("Floor")

    def where(self, then: Operand, otherwise: Operand) -> Value:
        """One where this is true, the other elsewhere; one of them must be a value."""
        typed = then if isinstance(then, Value) else otherwise
        if not isinstance(typed, Value):
            raise TypeError("one of two alternatives must be a value")
        return self.node("Where", typed.constant(then), typed.constant(otherwise), dtype=typed.dtype)

    def sum(self, axis: int, keepdims: bool = False) -> Value:
        """Sum over an axis."""
        return self.node("ReduceSum", _whole(axis), keepdims=int(keepdims))

    def max(self, axis: int, keepdims: bool = False) -> Value:
        """Greatest over an axis."""
        return self.node("ReduceMax", axes=[axis], keepdims=int(keepdims))

    def first_of_most(self, axis: int, is_last: bool = False) -> Value:
        """Where along an axis the greatest is, the first or the last of them, int64."""
        how = {"axis": axis, "keepdims": 0, "select_last_index": int(is_last)}
        return self.node("ArgMax", dtype=np.int64, **how)

    def running_sum(self, axis: int) -> Value:
        """Sums from the start along an axis."""
        return self.node("CumSum", np.array(axis, np.int64))

    def size(self, axis: int) -> Value:
        """Length of an axis, an int64 of no dimension."""
        return self.node("Shape", dtype=np.int64).pick(axis)

    def pick(self, index: int, axis: int = 0) -> Value:
        """One place of an axis, which disappears."""
        return self.node("Gather", np.array(index, np.int64), axis=axis)

    def at(self, places: Operand, axis: int = 0) -> Value:
        """What is at places of an axis, which becomes those of the places."""
        return self.node("Gather", places, axis=axis)

    def at_each(self, places: Value) -> Value:
        """What is at places (..., k) of the first k axes."""
        return self.node("GatherND", places)

    def true_places(self) -> Value:
        """(n_axes, n) int64: places that are not 0, in order."""
        return self.node("NonZero", dtype=np.int64)

    def with_axis(self, *axes: int) -> Value:
        """With further axes of length one."""
        return self.node("Unsqueeze", _whole(*axes))

    def reshaped(self, *sides: int) -> Value:
        """In another shape; -1 stands for what is left, 0 for the side that it has."""
        return self.node("Reshape", _whole(*sides))

    def turned(self, *axes: int) -> Value:
        """With its axes in another order."""
        return self.node("Transpose", perm=list(axes))

    def part(self, start: Sequence[int], end: Sequence[int], axes: Sequence[int]) -> Value:
        """Slices of axes."""
        return self.node("Slice", _whole(*start), _whole(*end), _whole(*axes))

    def sorted(self, n: Value, axis: int, is_rising: bool) -> tuple[Value, Value]:
        """The first n in order, and where they were, int64; of the same, the first comes first."""
        inputs = [self.name, n.name]
        names = self.graph.add_several("TopK", inputs, 2, axis=axis, largest=int(not is_rising))
        return Value(self.graph, names[0], self.dtype), Value(self.graph, names[1], np.int64)


Operand = Value | float | int | Sequence[Any] | NDArray[Any]


def _whole(*numbers: int) -> NDArray[np.int64]:
    return np.array(numbers, np.int64)


def constant(graph: Graph, array: NDArray[Any]) -> Value:
    """An array in a graph; one that is there already is used again."""
    return Value(graph, graph.shared(array), array.dtype)


def joined(values: Sequence[Value], axis: int) -> Value:
    """Values behind one another."""
    first, *others = values
    return first.node("Concat", *others, axis=axis)


def zeros(like: DTypeLike, sides: Sequence[Value | int], graph: Graph) -> Value:
    """Zeros in a shape of which some sides are values."""
    whole = constant(graph, np.zeros((), np.int64))
    shape = joined([whole.constant(side).reshaped(1) for side in sides], 0)
    return constant(graph, np.zeros((), like)).node("Expand", shape)


def counted(n: Value) -> Value:
    """0, 1, ..., n - 1."""
    return n.constant(0).node("Range", n, 1)


Step = Callable[[list[Value]], tuple[Value, list[Value], list[Value]]]
"""Of a loop: takes the state, gives whether to go on (() bool), the next state, and what is told of the step."""


def repeated(step: Step, state: list[Value], most: int) -> tuple[list[Value], list[Value]]:
    """Repeats a step until it says that it is enough.

    Args:
        step: Builds the nodes of one step.
        state: Before the first step.
        most: Steps, at most.

    Returns:
        The state after the last step, and what the steps told, behind one another along a new first axis.
    """
    graph = state[0].graph
    before = [Value(graph, graph.new_name("state"), of.dtype) for of in state]
    inputs: list[Typed] = [(graph.new_name("step"), np.int64), (graph.new_name("goes"), bool)]
    inputs += [(of.name, of.dtype) for of in before]
    with graph.inside() as nodes:
        is_going, after, told = step(before)
        # What was there before the step needs a node of its own to be an output.
        ends = [of.called(graph.new_name("end")) for of in (is_going, *after, *told)]
    body = graph.loop_body(nodes, inputs, [(of.name, of.dtype) for of in ends])
    first = state[0].constant(np.array(most, np.int64)), state[0].constant(np.array(True))
    names = [of.name for of in (*first, *state)]
    results = graph.add_several("Loop", names, len(ends) - 1, body=body)
    values = [Value(graph, name, of.dtype) for name, of in zip(results, ends[1:], strict=True)]
    return values[: len(after)], values[len(after) :]
