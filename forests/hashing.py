"""Random numbers that depend on what they are for and on nothing else: counter-based hashes for kernels."""

import numpy as np
from numba import njit, uint64

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_A = np.uint64(0xBF58476D1CE4E5B9)
_MIX_B = np.uint64(0x94D049BB133111EB)


@njit(cache=True, nogil=True, inline="always")
def splitmix64(state: int) -> int:
    """One output of SplitMix64 (Steele, Lea and Flood 2014) from a 64-bit state."""
    z = uint64(state) + _GOLDEN
    z = (z ^ (z >> uint64(30))) * _MIX_A
    z = (z ^ (z >> uint64(27))) * _MIX_B
    return z ^ (z >> uint64(31))


@njit(cache=True, nogil=True, inline="always")
def hash4(a: int, b: int, c: int, d: int) -> int:
    """A uint64 of four counters, such as (seed, tree, node, candidate)."""
    h = splitmix64(uint64(a))
    h = splitmix64(h ^ uint64(b))
    h = splitmix64(h ^ uint64(c))
    return splitmix64(h ^ uint64(d))


@njit(cache=True, nogil=True, inline="always")
def unit_float(key: int) -> float:
    """A float64 in [0, 1) out of a uint64's upper 53 bits."""
    return float(uint64(key) >> uint64(11)) * (1.0 / 9007199254740992.0)
