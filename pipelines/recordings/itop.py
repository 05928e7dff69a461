"""ITOP's HDF5 files: depth maps or point clouds, and joints, of many frames in one file."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import UserError
from pipelines.recordings.layout import Layout
from pipelines.recordings.readers import DepthImage, millimetres

JOINTS_KEY, DEPTH_KEY = "real_world_coordinates", "data"


@dataclass(frozen=True)
class ItopIndex:
    """What two files of ITOP hold.

    Attributes:
        depth: The file of depth maps or clouds.
        labels: The file of joints; None if there is none.
        rows: Frames whose joints are valid; without joints, all.
        subjects: Of these frames: what stands before "_" in their identifiers.
    """

    depth: Path
    labels: Path | None
    rows: tuple[int, ...]
    subjects: tuple[str, ...]


def read_index(depth: Path, labels: Path | None, layout: Layout) -> ItopIndex:
    """Checks both files and lists the frames whose joints are valid; all frames without a file of joints.

    Raises:
        UserError: A file is missing or damaged, lacks an array, or has one of another shape.
    """
    with _opened(depth) as file:
        data = _array(file, depth, DEPTH_KEY)
        n, n_pixels = data.shape[0], layout.width * layout.height
        allowed = ((n, layout.height, layout.width), (n, n_pixels, 3))
        if data.shape not in allowed:
            raise UserError(f"{depth}: {DEPTH_KEY} is {data.shape}, must be {allowed[0]} or {allowed[1]}")
        names = [_text(value) for value in file["id"][()]] if "id" in file else [""] * n
    if len(names) != n:
        raise UserError(f"{depth} has {len(names)} identifiers for {n} frames")
    rows = tuple(range(n)) if labels is None else _valid_rows(labels, depth, n)
    return ItopIndex(depth, labels, rows, tuple(names[row].split("_")[0] for row in rows))


def _valid_rows(labels: Path, depth: Path, n: int) -> tuple[int, ...]:
    with _opened(labels) as file:
        joints = _array(file, labels, JOINTS_KEY)
        if joints.shape[0] != n:
            raise UserError(f"{labels} holds joints of {joints.shape[0]} frames, but {depth} has {n} frames")
        is_valid = np.asarray(file["is_valid"][()] if "is_valid" in file else np.ones(n), bool)
    return tuple(int(row) for row in np.flatnonzero(is_valid))


def read_depth_row(index: ItopIndex, row: int, layout: Layout) -> DepthImage:
    """(height, width) uint16 depth [mm] of a frame's person.

    Pixels that `segmentation` calls background are cut away, if the file of joints has it.
    """
    with _opened(index.depth) as file:
        values = np.asarray(file[DEPTH_KEY][row], np.float32)
    metres = values if values.ndim == 2 and values.shape[1] != 3 else values[:, 2]
    image = millimetres(metres.reshape(layout.height, layout.width))
    if index.labels is not None:
        with _opened(index.labels) as file:
            if "segmentation" in file:
                image[np.asarray(file["segmentation"][row]) < 0] = 0
    return image


def read_joint_row(index: ItopIndex, row: int) -> NDArray[np.float64]:
    """(n_names, 3) joints of a frame as the file has them [m].

    Raises:
        UserError: There is no file of joints.
    """
    if index.labels is None:
        raise UserError(f"{index.depth} has no joints: there is no file of labels beside it")
    with _opened(index.labels) as file:
        return np.asarray(file[JOINTS_KEY][row], np.float64)


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[Any]:
    import h5py

    try:
        with h5py.File(path, "r") as file:
            yield file
    except OSError as error:
        reason = "there is no such file" if not path.exists() else f"it is damaged, or no HDF5 ({error})"
        raise UserError(f"cannot read {path}: {reason}") from None


def _array(file: Any, path: Path, key: str) -> Any:
    if key not in file:
        raise UserError(f"{path} has no array {key!r}; it has {', '.join(file) or 'none'}")
    return file[key]


def _text(value: object) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)
