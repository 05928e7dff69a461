"""Reads ahead: a kernel that knows what it will read soon has the processor fetch it while it does something else."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

_READ, _KEEP, _DATA = 0, 3, 1
"""Of the instruction `llvm.prefetch`: fetched to be read, to stay in all caches, no code."""


@intrinsic
def prefetch(typing_context: Any, array: Any, index: Any) -> Any:
    """Has an element of a contiguous array of one dimension fetched into the cache. It changes nothing but speed.

    Args:
        typing_context: Given by numba; kernels call `prefetch(array, index)`.
        array: Of any element type.
        index: Of the element; not checked, since what is fetched is not read.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> None:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        place = context.cast(builder, arguments[1], signature.args[1], types.intp)
        pointer = builder.bitcast(builder.gep(data, [place]), ir.IntType(8).as_pointer())
        number = ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [pointer.type, number, number, number])
        fetch = builder.module.declare_intrinsic("llvm.prefetch", [pointer.type], kind)
        builder.call(fetch, [pointer, number(_READ), number(_KEEP), number(_DATA)])

    return types.void(array, index), generate
