"""Depth images in memory that processes share: a few places that are written again once nobody reads them."""

from multiprocessing.shared_memory import SharedMemory
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Place(NamedTuple):
    """Where an image lies.

    Attributes:
        memory: Name of the shared memory.
        offset: Of its first byte.
        shape: (height, width); the values are uint16.
    """

    memory: str
    offset: int
    shape: tuple[int, int]


class FrameRing:
    """Places for images, counted by who still reads them; made anew when images grow.

    Attributes:
        n_places: How many images may be read at a time, and one more.
    """

    def __init__(self, n_places: int) -> None:
        self.n_places = n_places
        self._memory: SharedMemory | None = None
        self._old: list[SharedMemory] = []
        self._size = 0
        self._readers: dict[Place, int] = {}

    def write(self, depth: NDArray[np.uint16], n_readers: int) -> Place:
        """Copies an image to a free place.

        Args:
            depth: (height, width) uint16.
            n_readers: How often `release` will be told of the place.
        """
        if depth.nbytes > self._size:
            self._grow(depth.nbytes)
        assert self._memory is not None
        height, width = depth.shape
        taken = {place.offset for place in self._readers if place.memory == self._memory.name}
        offset = next(k * self._size for k in range(self.n_places) if k * self._size not in taken)
        place = Place(self._memory.name, offset, (height, width))
        view(self._memory, place)[:] = depth
        if n_readers:
            self._readers[place] = n_readers
        return place

    def release(self, place: Place) -> None:
        """One reader less."""
        self._readers[place] -= 1
        if not self._readers[place]:
            del self._readers[place]
        for memory in [old for old in self._old if all(used.memory != old.name for used in self._readers)]:
            self._old.remove(memory)
            _free(memory)

    @property
    def n_taken(self) -> int:
        """Places that are being read."""
        return len(self._readers)

    def close(self) -> None:
        """Frees the memory."""
        for memory in [*self._old, *([self._memory] if self._memory is not None else [])]:
            _free(memory)
        self._memory, self._old, self._size = None, [], 0
        self._readers.clear()

    def _grow(self, n_bytes: int) -> None:
        if self._memory is not None:
            if any(place.memory == self._memory.name for place in self._readers):
                self._old.append(self._memory)
            else:
                _free(self._memory)
        self._size = n_bytes
        self._memory = SharedMemory(create=True, size=n_bytes * self.n_places)


class Reader:
    """Reads places of a ring in another process."""

    def __init__(self) -> None:
        self._memory: SharedMemory | None = None

    def read(self, place: Place) -> NDArray[np.uint16]:
        """The image, without a copy; it is not valid for longer than the place is taken, and must not be changed.

        It is not marked as read-only, since numba would compile every kernel anew for such an array.
        """
        if self._memory is None or self._memory.name != place.memory:
            self.close()
            self._memory = SharedMemory(place.memory)
        return view(self._memory, place)

    def close(self) -> None:
        """Lets go of the memory."""
        if self._memory is not None:
            self._memory.close()
            self._memory = None


def view(memory: SharedMemory, place: Place) -> NDArray[np.uint16]:
    """(height, width) uint16, the image at a place."""
    return np.ndarray(place.shape, np.uint16, buffer=memory.buf, offset=place.offset)


def _free(memory: SharedMemory) -> None:
    memory.close()
    memory.unlink()
