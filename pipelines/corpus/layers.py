"""The body layer, stored only where it differs from the composite: split on writing, joined on reading."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def _take_apart(depth, part, body_depth, body_part, hidden_depth, hidden_part):  # type: ignore[no-untyped-def]
    """Fills hidden_* over flat maps; true if somewhere a seen person has no body layer.

    Selections instead of branches, and the check in a loop of its own: LLVM vectorises both.
    """
    for i in range(depth.size):
        is_same = (part[i] != 0) & (body_part[i] == part[i]) & (body_depth[i] == depth[i])
        hidden_depth[i] = np.uint16(0) if is_same else body_depth[i]
        hidden_part[i] = np.uint8(0) if is_same else body_part[i]
    is_wrong = False
    for i in range(depth.size):
        is_wrong |= (part[i] != 0) & (body_part[i] == 0)
    return is_wrong


@njit(cache=True, nogil=True)
def _put_together(depth, part, hidden_depth, hidden_part):  # type: ignore[no-untyped-def]
    """Turns hidden_* over flat maps into the body layer, in place."""
    for i in range(depth.size):
        is_same = (part[i] != 0) & (hidden_part[i] == 0)
        hidden_depth[i] = depth[i] if is_same else hidden_depth[i]
        hidden_part[i] = part[i] if is_same else hidden_part[i]


def hidden_layer(
    depth: NDArray[np.uint16],
    part: NDArray[np.uint8],
    body_depth: NDArray[np.uint16],
    body_part: NDArray[np.uint8],
) -> tuple[NDArray[np.uint16], NDArray[np.uint8]]:
    """The body layer with zeros where the composite shows the same.

    Args:
        depth: (height, width) composite depth [mm].
        part: (height, width) composite part.
        body_depth: (height, width) depth of the person alone [mm].
        body_part: (height, width) part of the person alone.

    Returns:
        (height, width) hidden depth [mm] and (height, width) hidden part.

    Raises:
        ValueError: The composite shows a person where the body layer has none.
    """
    flat = [np.ascontiguousarray(image).reshape(-1) for image in (depth, part, body_depth, body_part)]
    hidden_depth, hidden_part = np.empty(depth.shape, np.uint16), np.empty(depth.shape, np.uint8)
    if _take_apart(*flat, hidden_depth.reshape(-1), hidden_part.reshape(-1)):
        n_wrong = np.count_nonzero((part > 0) & (body_part == 0))
        raise ValueError(f"the composite shows a person in {n_wrong} pixels where the body layer has none")
    return hidden_depth, hidden_part


def body_layer(
    depth: NDArray[np.uint16],
    part: NDArray[np.uint8],
    hidden_depth: NDArray[np.uint16],
    hidden_part: NDArray[np.uint8],
) -> tuple[NDArray[np.uint16], NDArray[np.uint8]]:
    """Undoes `hidden_layer`; contiguous arrays of one shape, (..., height, width)."""
    body_depth, body_part = hidden_depth.copy(), hidden_part.copy()
    _put_together(depth.reshape(-1), part.reshape(-1), body_depth.reshape(-1), body_part.reshape(-1))
    return body_depth, body_part
