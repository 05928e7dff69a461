"""Leaf tables without what is missing, rounded to the steps that votes are counted in: as files hold them."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

WEIGHT_ONE = 32767
"""A leaf vote's weight of one: int16 keeps an entry of a vote table at ten bytes, and reading entries is what
voting waits for."""
PROBABILITY_ONE = 65535
FACING_ONE = 127
FARTHEST_MM = 32000
"""Longest offset of a leaf's vote along an axis."""


class LeafTable(NamedTuple):
    """What a tree's leaves know. Layer 0: votes learned from body samples; layer 1: from occluder samples.

    Attributes:
        probability: (n_leaves, n_classes) float32, p(c | leaf), sums to 1.
        vote: (n_leaves, n_layers, n_joints, n_leaf_votes, 3) float32, offsets from the pixel's point to the joint
            [m], the heaviest first; 0 where missing. n_layers is 1 for the baseline, else 2.
        weight: (n_leaves, n_layers, n_joints, n_leaf_votes) float32, of the leaf's samples that know the joint, in
            both layers, the share that ended in the vote's mode; 0 where missing.
        facing: (n_leaves, n_layers, n_joints, n_leaf_votes, 2) float32, mean cosine and sine of the headings of
            the people whose samples ended near the vote; zeros where missing. None = not learned.
    """

    probability: NDArray[np.float32]
    vote: NDArray[np.float32]
    weight: NDArray[np.float32]
    facing: NDArray[np.float32] | None = None


class PackedLeaves(NamedTuple):
    """A leaf table of which only what is not 0 is kept, in rounded numbers.

    Attributes:
        n_classes: Classes.
        shape: (n_leaves, n_layers, n_joints, n_leaf_votes).
        has_class: (ceil(n_leaves * n_classes / 8),) uint8, a bit for each probability, the highest first.
        probability: (n_set,) uint16, those that are not 0, PROBABILITY_ONE = 1.
        has_vote: uint8, a bit for each vote, likewise.
        vote: (n_set, 3) int16, offsets of those that have a weight [mm].
        weight: (n_set,) int16, WEIGHT_ONE = 1, above 0.
        facing: (n_set, 2) int8, of those, FACING_ONE = 1; (0, 2) = not learned.
    """

    n_classes: int
    shape: tuple[int, int, int, int]
    has_class: NDArray[np.uint8]
    probability: NDArray[np.uint16]
    has_vote: NDArray[np.uint8]
    vote: NDArray[np.int16]
    weight: NDArray[np.int16]
    facing: NDArray[np.int8]

    @property
    def n_leaves(self) -> int:
        """Leaves of the tree."""
        return self.shape[0]

    def probabilities(self) -> NDArray[np.float32]:
        """(n_leaves, n_classes) float32, p(c | leaf)."""
        out = np.zeros((self.n_leaves, self.n_classes), np.float32)
        _scatter(self.has_class, self.probability, np.float32(PROBABILITY_ONE), out.reshape(-1))
        return out

    def unpacked(self) -> LeafTable:
        """The whole table."""
        size = math.prod(self.shape)
        vote, weight = np.zeros((size, 3), np.float32), np.zeros(size, np.float32)
        is_kept = np.unpackbits(self.has_vote, count=size).astype(bool)
        vote[is_kept] = self.vote.astype(np.float32) / np.float32(1000.0)
        weight[is_kept] = self.weight.astype(np.float32) / np.float32(WEIGHT_ONE)
        facing = None
        if len(self.facing):
            facing = np.zeros((size, 2), np.float32)
            facing[is_kept] = self.facing.astype(np.float32) / np.float32(FACING_ONE)
            facing = facing.reshape(*self.shape, 2)
        return LeafTable(self.probabilities(), vote.reshape(*self.shape, 3), weight.reshape(self.shape), facing)

    def voted_joints(self) -> NDArray[np.bool_]:
        """(n_joints,) bool, which joints any leaf votes for."""
        is_kept = np.unpackbits(self.has_vote, count=math.prod(self.shape)).astype(bool)
        return np.asarray(is_kept.reshape(self.shape).any(axis=(0, 1, 3)))


def pack_leaves(table: LeafTable) -> PackedLeaves:
    """Rounds a leaf table: votes to a millimetre, weights and probabilities to their units.

    A vote whose weight comes to nothing is left out, an offset is cut to FARTHEST_MM. What was unpacked before
    is packed to the same bytes.
    """
    units = np.rint(table.weight * WEIGHT_ONE).astype(np.int16)
    vote_mm = np.rint(np.clip(table.vote[units > 0] * 1000.0, -FARTHEST_MM, FARTHEST_MM)).astype(np.int16)
    probability = np.rint(table.probability * PROBABILITY_ONE).astype(np.uint16)
    n_leaves, n_layers, n_joints, n_leaf_votes = units.shape
    return PackedLeaves(
        probability.shape[1],
        (n_leaves, n_layers, n_joints, n_leaf_votes),
        np.packbits(probability > 0),
        probability[probability > 0],
        np.packbits(units > 0),
        vote_mm,
        units[units > 0],
        _packed_facing(table.facing, units > 0),
    )


def voting(leaves: PackedLeaves, max_offset_m: NDArray[np.float32]) -> PackedLeaves:
    """A packed table without the votes that are longer than lambda_j, (n_joints,) float32 [m]: those never vote."""
    size = math.prod(leaves.shape)
    places = np.flatnonzero(np.unpackbits(leaves.has_vote, count=size))
    x, y, z = (leaves.vote / np.float32(1e3)).T
    limit = np.asarray(max_offset_m, np.float32)[places // leaves.shape[3] % leaves.shape[2]]
    is_kept = (np.sqrt(x * x + y * y + z * z) <= limit) & (leaves.weight > 0)
    has_vote = np.zeros(size, np.bool_)
    has_vote[places[is_kept]] = True
    return leaves._replace(
        has_vote=np.packbits(has_vote),
        vote=leaves.vote[is_kept],
        weight=leaves.weight[is_kept],
        facing=leaves.facing[is_kept] if len(leaves.facing) else leaves.facing,
    )


def _packed_facing(facing: NDArray[np.float32] | None, is_kept: NDArray[np.bool_]) -> NDArray[np.int8]:
    if facing is None:
        return np.empty((0, 2), np.int8)
    return np.rint(np.clip(facing[is_kept], -1.0, 1.0) * FACING_ONE).astype(np.int8)


def check_leaves(leaves: PackedLeaves) -> None:
    """Makes sure that a packed table is whole and its numbers are in range, whatever file it came from.

    Raises:
        ValueError: Bits that do not fit what they count, votes that are too long or weigh less than nothing, or
            probabilities of a leaf that do not sum to 1.
    """
    _check_bits("class", leaves.has_class, leaves.n_leaves * leaves.n_classes, len(leaves.probability))
    _check_bits("vote", leaves.has_vote, math.prod(leaves.shape), len(leaves.weight))
    if leaves.vote.shape != (len(leaves.weight), 3):
        raise ValueError(f"votes are {leaves.vote.shape}, must be ({len(leaves.weight)}, 3)")
    if leaves.facing.shape not in ((0, 2), (len(leaves.weight), 2)):
        raise ValueError(f"facings are {leaves.facing.shape}, must be ({len(leaves.weight)}, 2), or none")
    is_short = leaves.vote.min(initial=0) >= -FARTHEST_MM and leaves.vote.max(initial=0) <= FARTHEST_MM
    if not is_short or leaves.weight.min(initial=0) < 0:
        raise ValueError(f"leaf votes must be within {FARTHEST_MM} mm, their weights not below 0")
    if _sums_apart(leaves.has_class, leaves.probability, leaves.n_leaves, leaves.n_classes) > leaves.n_classes:
        raise ValueError("the class probabilities of a leaf do not sum to 1")


def _check_bits(name: str, bits: NDArray[np.uint8], n_places: int, n_set: int) -> None:
    if len(bits) != -(-n_places // 8):
        raise ValueError(f"has_{name} has {len(bits)} bytes, must have {-(-n_places // 8)}")
    n_given = int(np.bitwise_count(bits).sum(dtype=np.int64))
    if n_given != n_set:
        raise ValueError(f"has_{name} has {n_given} bits set, must have {n_set}")
    if n_places % 8 and int(bits[-1]) & (0xFF >> n_places % 8):
        raise ValueError(f"has_{name} has bits set beyond its {n_places}")


@njit(cache=True, nogil=True)
def _scatter(bits: np.ndarray, values: np.ndarray, one: float, out: np.ndarray) -> None:
    """Fills in values / one where a bit is set, in order."""
    k = 0
    for byte in range(len(bits)):
        row = bits[byte]
        if row == 0:
            continue
        for bit in range(8):
            if row & (0x80 >> bit):
                out[8 * byte + bit] = np.float32(values[k]) / one
                k += 1


@njit(cache=True, nogil=True)
def _sums_apart(bits: np.ndarray, values: np.ndarray, n_leaves: int, n_classes: int) -> np.int64:
    """The most that a leaf's probabilities, summed up, are off PROBABILITY_ONE."""
    k, place, most = 0, 0, np.int64(0)
    for _ in range(n_leaves):
        total = np.int64(0)
        for _ in range(n_classes):
            if bits[place >> 3] & (0x80 >> (place & 7)):
                total += np.int64(values[k])
                k += 1
            place += 1
        most = max(most, abs(total - PROBABILITY_ONE))
    return most
