"""A file that HDF5 writes into, which says at the end that a disk was full instead of ending the process."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any


class _Sink(io.FileIO):
    """A file whose first failed write is kept; HDF5 crashes when it cannot close a file that it failed to write."""

    error: OSError | None = None

    def write(self, data: Any) -> int:  # of io.FileIO, which takes any buffer
        """Writes all of it, or keeps the error."""
        view = memoryview(data).cast("B")
        n_done = 0
        try:
            while self.error is None and n_done < len(view):
                n_done += super().write(view[n_done:])
        except OSError as error:
            self.error = error
        return len(view)

    def truncate(self, size: int | None = None) -> int:
        """Sets the size, or keeps the error."""
        try:
            return super().truncate(size)
        except OSError as error:
            self.error = self.error or error
            return size or 0


@contextmanager
def writing_hdf5(path: Path, libver: tuple[str, str] | None = None) -> Iterator[Any]:
    """A new HDF5 file; whole if the block and its end raise nothing.

    Args:
        path: The file.
        libver: Oldest and newest version of HDF5 whose format is used, as h5py names them; None = h5py's choice.

    Raises:
        OSError: It cannot be written; names the path.
    """
    import h5py

    with _Sink(path, "w+") as sink:
        with h5py.File(sink, "w", libver=libver) as file:
            yield file
        if sink.error is not None:
            raise OSError(sink.error.errno, sink.error.strerror, str(path)) from sink.error
