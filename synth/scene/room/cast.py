"""The rooms and the people that a block of frames shares: nobody is in a frame twice."""

from collections import OrderedDict

import numpy as np
from numpy.typing import NDArray

from synth.scene.config import DRAWS_PER_BLOCK, SceneConfig
from synth.scene.objects import ObjectMix
from synth.scene.pools import Pools, Subject, cached, per_block
from synth.scene.room.furnish import sample_room
from synth.scene.room.occupancy import Occupancy
from synth.scene.room.shell import BuiltRoom, build_room, taken_floor
from synth.vocabulary import SPLITS

_ROOM_STREAM = 5
"""Kept apart from those of subjects, objects and composed frames."""
_MAX_ROOMS = 12
_START = 2**62
"""Number of no room: its stream says where the kinds begin."""
GOLDEN = 0.6180339887498949
"""Steps of the golden ratio go through the kinds of rooms, so that neighbours differ as their weights allow."""


class Cast(Pools):
    """Subjects and objects of whole scenes.

    A block has as many subjects a person as it would have for frames with one person. `begin` starts a frame;
    after that, every draw gives somebody else, until `leave` sends people away again.

    Args:
        config: How many frames share a subject or object, and how many people there are.
        seed: The corpus seed.
        imported: Imported objects among the procedural ones.
    """

    def __init__(self, config: SceneConfig, seed: int, imported: ObjectMix | None = None) -> None:
        self._n_subjects = per_block(config.frames_per_subject) * max(1, config.people.number[1])
        super().__init__(config, seed, imported, max_subjects=2 * self._n_subjects + 8)
        self._present: set[int] = set()

    def begin(self) -> None:
        """Empties the stage."""
        self._present = set()

    def present(self) -> frozenset[int]:
        """Numbers of who has been drawn."""
        return frozenset(self._present)

    def leave(self, stayed: frozenset[int]) -> None:
        """Sends away who was drawn after a call of `present`."""
        self._present = set(stayed)

    def draw_subject(self, split: str, frame_idx: int, rng: np.random.Generator, is_seated: bool) -> Subject:
        """One of the block's subjects who is not there yet, dressed for a seat if they sit."""
        first = (frame_idx // DRAWS_PER_BLOCK) * self._n_subjects
        free = [number for number in range(first, first + self._n_subjects) if number not in self._present]
        if not free:  # many attempts were drawn: an earlier one gives way
            self._present = set()
            free = list(range(first, first + self._n_subjects))
        number = free[int(rng.integers(len(free)))]
        self._present.add(number)
        return self.subject(split, number, is_seated)


class Rooms:
    """The rooms of a corpus, made from (seed, split, number) alone.

    Args:
        config: What they are drawn from.
        seed: The corpus seed.
    """

    def __init__(self, config: SceneConfig, seed: int) -> None:
        self._config = config.room
        self._seed = seed
        self._kinds = config.room.drawn_kinds()
        weights = np.array([getattr(config.room.kinds, kind) for kind in self._kinds])
        self._shares = weights / weights.sum()
        self._rooms: OrderedDict[tuple[str, int], tuple[BuiltRoom, Occupancy]] = OrderedDict()

    def draw(self, split: str, frame_idx: int, rng: np.random.Generator) -> tuple[BuiltRoom, Occupancy]:
        """One of the rooms of the frame's block, and its taken floor, which must not be changed."""
        n_rooms = per_block(self._config.frames_per_room)
        number = (frame_idx // DRAWS_PER_BLOCK) * n_rooms + int(rng.integers(n_rooms))
        return cached(self._rooms, (split, number), _MAX_ROOMS, lambda: self._make(split, number))

    def _make(self, split: str, number: int) -> tuple[BuiltRoom, Occupancy]:
        stream = [self._seed, _ROOM_STREAM, SPLITS.index(split)]
        rng = np.random.default_rng([*stream, number])
        start = float(np.random.default_rng([*stream, _START]).random())
        kind = self._kinds[_place_in(self._shares, (start + GOLDEN * number) % 1.0)]
        room = build_room(sample_room(kind, self._config, rng), f"room/{kind}/{split}/{number:05d}")
        return room, taken_floor(room)


def _place_in(shares: NDArray[np.float64], place: float) -> int:
    """Which of some shares, laid end to end from 0 to 1, a place lies in."""
    return min(int(np.searchsorted(np.cumsum(shares), place, side="right")), len(shares) - 1)
