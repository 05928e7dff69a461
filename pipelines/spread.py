"""Evenly spread choices out of a sequence."""

import numpy as np
from numpy.typing import NDArray


def spread(numbers: NDArray[np.int64], limit: int) -> NDArray[np.int64]:
    """At most `limit` of the numbers, evenly spread from the first on; all of them if the limit is 0."""
    if not 0 < limit < len(numbers):
        return numbers
    return numbers[np.arange(limit) * len(numbers) // limit]
