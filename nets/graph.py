"""Graphs in the ONNX format, built node by node out of plain arrays; needs onnx, but not torch."""

import contextlib
import hashlib
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from nets.runtime import MissingLibraryError

OPSET = 17
IR_VERSION = 8
"""Old enough for runtimes of 2022."""

Side = int | str
"""Of a shape: a number, or the name of one that is not fixed."""

Typed = tuple[str, DTypeLike]
"""Name and type of a value."""


def load_onnx() -> Any:
    """The module onnx.

    Raises:
        MissingLibraryError: It is not installed; says how to get it.
    """
    try:
        import onnx
    except ImportError:
        raise MissingLibraryError(
            "the export needs onnx, which is not installed; install it with: pip install 'undergrowth[nets]'"
        ) from None
    return onnx


class Graph:
    """A graph that grows."""

    def __init__(self) -> None:
        self._onnx = load_onnx()
        self._nodes: list[Any] = []
        self._arrays: dict[str, NDArray[Any]] = {}
        self._n_names = 0
        self._shared: dict[str, str] = {}
        self._inputs: list[Any] = []
        self._outputs: list[Any] = []

    def add(self, operator: str, inputs: list[str], name: str = "", /, **attributes: Any) -> str:
        """Adds a node with one output and gives the output's name."""
        name = name or self.new_name(operator.lower())
        self._nodes.append(self._onnx.helper.make_node(operator, inputs, [name], name=name, **attributes))
        return name

    def add_several(self, operator: str, inputs: list[str], n_outputs: int, **attributes: Any) -> list[str]:
        """Adds a node with several outputs and gives their names."""
        name = self.new_name(operator.lower())
        outputs = [f"{name}_{k}" for k in range(n_outputs)]
        self._nodes.append(self._onnx.helper.make_node(operator, inputs, outputs, name=name, **attributes))
        return outputs

    def new_name(self, stem: str) -> str:
        """A name that nothing in the graph has yet."""
        self._n_names += 1
        return f"{stem}_{self._n_names}"

    @contextlib.contextmanager
    def inside(self) -> Iterator[list[Any]]:
        """Adds nodes to a list of their own, which is given: of a graph inside this one, which sees all values."""
        outside, self._nodes = self._nodes, []
        try:
            yield self._nodes
        finally:
            self._nodes = outside

    def loop_body(self, nodes: list[Any], inputs: list[Typed], outputs: list[Typed]) -> Any:
        """A graph inside this one, for a loop: its attribute.

        Args:
            nodes: Of the body.
            inputs: Number of the step, whether the loop goes on, and its state.
            outputs: Whether it goes on, its state, and what is told of the step.
        """
        info = self._onnx.helper.make_tensor_value_info
        scalars, state = inputs[:2], inputs[2:]
        given = [info(name, self.number_of(dtype), []) for name, dtype in scalars]
        given += [info(name, self.number_of(dtype), None) for name, dtype in state]
        (goes, goes_dtype), *others = outputs
        made = [info(goes, self.number_of(goes_dtype), [])]
        made += [info(name, self.number_of(dtype), None) for name, dtype in others]
        return self._onnx.helper.make_graph(nodes, self.new_name("body"), given, made)

    def constant(self, name: str, values: NDArray[Any]) -> str:
        """Adds an array and gives its name."""
        self._arrays[name] = np.asarray(values, order="C")
        return name

    def shared(self, values: NDArray[Any]) -> str:
        """Adds an array unless one like it was added so before, and gives its name."""
        contents = hashlib.sha256(f"{values.dtype.str}{values.shape}".encode() + values.tobytes()).hexdigest()
        name = self._shared.setdefault(contents, f"constant_{len(self._shared)}")
        return self.constant(name, values)

    def number_of(self, dtype: DTypeLike) -> int:
        """ONNX's number of a type."""
        return int(self._onnx.helper.np_dtype_to_tensor_dtype(np.dtype(dtype)))

    def input(self, name: str, *shape: Side, dtype: DTypeLike = np.float32) -> str:
        """Adds an input and gives its name."""
        self._inputs.append(self._onnx.helper.make_tensor_value_info(name, self.number_of(dtype), list(shape)))
        return name

    def output(self, name: str, *shape: Side, dtype: DTypeLike = np.float32) -> None:
        """Makes a node's output one of the graph."""
        self._outputs.append(self._onnx.helper.make_tensor_value_info(name, self.number_of(dtype), list(shape)))

    def finish(self, about: Mapping[str, str]) -> bytes:
        """The file's bytes.

        Args:
            about: Texts that the file tells.
        """
        onnx = self._onnx
        helper = onnx.helper
        values = [onnx.numpy_helper.from_array(array, name) for name, array in self._arrays.items()]
        graph = helper.make_graph(self._nodes, "undergrowth", self._inputs, self._outputs, values)
        model = helper.make_model(
            graph,
            opset_imports=[helper.make_opsetid("", OPSET)],
            producer_name="undergrowth",
            ir_version=IR_VERSION,
        )
        helper.set_model_props(model, dict(about))
        onnx.checker.check_model(model, full_check=True)
        return bytes(model.SerializeToString(deterministic=True))
