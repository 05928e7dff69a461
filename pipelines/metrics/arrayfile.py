"""Arrays by name in an .npz file; sizes are judged before memory is taken."""

import io
import math
import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipelines.foreign import check_size

_SUFFIX = ".npy"


def read_arrays(path: Path, names: Sequence[str] = ()) -> dict[str, np.ndarray]:
    """The arrays of an .npz file.

    Args:
        path: The file.
        names: Which; all if empty.

    Raises:
        ForeignFileError: It promises more memory than `foreign.MAX_BYTES`.
        Exception: Whatever the readers raise about a damaged file; for use inside `foreign.reading`.
    """
    with zipfile.ZipFile(path) as archive:
        members = {item.filename.removesuffix(_SUFFIX): item for item in archive.infolist()}
        wanted = {name: members[name] for name in names or members}
        check_size(path, sum(item.file_size for item in wanted.values()), "its unpacked arrays")
        return {name: _array(archive.read(item)) for name, item in wanted.items()}


def _array(data: bytes) -> np.ndarray:
    """An array out of the bytes of an .npy file that holds exactly what its header promises."""
    file = io.BytesIO(data)
    version = np.lib.format.read_magic(file)
    read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = read_header(file)
    if min(shape, default=0) < 0 or math.prod(shape) * dtype.itemsize != len(data) - file.tell():
        raise ValueError("an array has another size than its header says")
    file.seek(0)
    return np.asarray(np.lib.format.read_array(file, allow_pickle=False))
