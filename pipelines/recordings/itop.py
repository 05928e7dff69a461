"""ITOP's HDF5 files: depth maps or point clouds, and joints, of many frames in one file."""

import contextlib
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.foreign import ForeignFileError, check_size, reading
from pipelines.recordings.layout import CameraLayout, Layout
from pipelines.recordings.plausible import judge_values
from pipelines.recordings.readers import DepthImage, in_millimetres

JOINTS_KEY, DEPTH_KEY = "real_world_coordinates", "data"
UNKNOWN_KEY = "unknown_joints"
"""Attribute of a file of joints that may hold some joints of a frame and not others: says how it marks those."""
UNKNOWN_TEXT = "NaN in real_world_coordinates; is_valid is 0 where a frame has any"
INTRINSICS_KEY = "intrinsics"
"""Attribute of a file of depth maps: fx, fy, cx, cy of its frames."""


@dataclass(frozen=True)
class ItopIndex:
    """What two files of ITOP hold.

    Attributes:
        depth: The file of depth maps or clouds.
        labels: The file of joints; None if there is none.
        rows: Frames whose joints are valid; without joints, all.
        subjects: Of these frames: what stands before "_" in their identifiers.
        has_unknown: The file of joints may hold some joints of a frame and not others.
    """

    depth: Path
    labels: Path | None
    rows: tuple[int, ...]
    subjects: tuple[str, ...]
    has_unknown: bool = False


def read_index(depth: Path, labels: Path | None, layout: Layout) -> ItopIndex:
    """Checks both files and lists the frames whose joints are valid; all frames without a file of joints.

    Raises:
        ForeignFileError: A file is missing or damaged, lacks an array, or has one of another shape.
    """
    with _opened(depth) as file:
        data = _array(file, depth, DEPTH_KEY)
        n, n_pixels = data.shape[0], layout.width * layout.height
        allowed = ((n, layout.height, layout.width), (n, n_pixels, 3))
        if data.shape not in allowed:
            raise ForeignFileError(f"{depth}: {DEPTH_KEY} is {data.shape}, must be {allowed[0]} or {allowed[1]}")
        names = [_text(value) for value in _whole(file, depth, "id")] if "id" in file else [""] * n
    if len(names) != n:
        raise ForeignFileError(f"{depth} has {len(names)} identifiers for {n} frames")
    rows, has_unknown = (tuple(range(n)), False) if labels is None else _valid_rows(labels, depth, n)
    return ItopIndex(depth, labels, rows, tuple(names[row].split("_")[0] for row in rows), has_unknown)


def as_exported(path: Path, layout: Layout) -> Layout:
    """The layout with the image size and the camera that a file tells, as `undergrowth export --to itop` writes them.

    Files that do not tell them, or cannot be read, leave it as it is.
    """
    with contextlib.suppress(ForeignFileError), _opened(path) as file:
        given = np.unique(np.atleast_2d(np.asarray(file.attrs.get(INTRINSICS_KEY, ()), np.float64)), axis=0)
        shape = _array(file, path, DEPTH_KEY).shape
        if given.shape == (1, 4) and len(shape) == 3 and shape[2] != 3:
            fx, fy, cx, cy = map(float, given[0])
            camera = CameraLayout(fx, fy, cx, cy, layout.camera.height_m, layout.camera.tilt_deg)
            return replace(layout, width=int(shape[2]), height=int(shape[1]), camera=camera)
    return layout


def _valid_rows(labels: Path, depth: Path, n: int) -> tuple[tuple[int, ...], bool]:
    """Frames whose joints are valid, or some of whose joints are known; and whether the others may be unknown."""
    with _opened(labels) as file:
        joints = _array(file, labels, JOINTS_KEY)
        if joints.shape[0] != n:
            raise ForeignFileError(
                f"{labels} holds joints of {joints.shape[0]} frames, but {depth} has {n} frames"
            )
        if UNKNOWN_KEY in file.attrs:
            is_known = np.isfinite(_whole(file, labels, JOINTS_KEY)).all(axis=-1).reshape(n, -1).any(axis=1)
            return tuple(int(row) for row in np.flatnonzero(is_known)), True
        is_valid = np.asarray(_whole(file, labels, "is_valid") if "is_valid" in file else np.ones(n), bool)
        if is_valid.shape != (n,):
            raise ForeignFileError(f"{labels}: is_valid is {is_valid.shape}, must be {(n,)}")
    return tuple(int(row) for row in np.flatnonzero(is_valid)), False


def read_depth_row(index: ItopIndex, row: int, layout: Layout) -> DepthImage:
    """(height, width) uint16 depth [mm] of a frame's person.

    Pixels that `segmentation` calls background are cut away, if the file of joints has it.

    Raises:
        UserError: The frame cannot be read, or its values are no depths in the layout's unit.
    """
    with _opened(index.depth) as file:
        values = _row(file, index.depth, DEPTH_KEY, row)
    values = values if values.ndim == 2 and values.shape[1] != 3 else values[:, 2]
    values = values.reshape(layout.height, layout.width)
    judge_values(f"{index.depth}, row {row}", values, layout)
    image = in_millimetres(values, layout)
    if index.labels is not None:
        with _opened(index.labels) as file:
            if "segmentation" in file:
                image[_row(file, index.labels, "segmentation", row) < 0] = 0
    return image


def read_joint_row(index: ItopIndex, row: int) -> NDArray[np.float64]:
    """(n_names, 3) joints of a frame as the file has them [m].

    Raises:
        ForeignFileError: There is no file of joints, or it cannot be read.
    """
    if index.labels is None:
        raise ForeignFileError(f"{index.depth} has no joints: there is no file of labels beside it")
    with _opened(index.labels) as file:
        return np.asarray(_row(file, index.labels, JOINTS_KEY, row), np.float64)


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[Any]:
    import h5py

    with reading(path, "an HDF5 file as ITOP has them"), h5py.File(path, "r") as file:
        yield file


def _array(file: Any, path: Path, key: str) -> Any:
    import h5py

    found = file.get(key)
    if found is None:
        raise ForeignFileError(f"{path} has no array {key!r}; it has {', '.join(file) or 'none'}")
    if not isinstance(found, h5py.Dataset) or not found.shape:
        raise ForeignFileError(f"{path}: {key!r} is no array")
    if found.chunks:
        check_size(path, math.prod(found.chunks) * found.dtype.itemsize, f"a piece of {key!r}")
    return found


def _whole(file: Any, path: Path, key: str) -> NDArray:
    """All of a small array."""
    found = _array(file, path, key)
    check_size(path, math.prod(found.shape) * found.dtype.itemsize, f"{key!r}")
    return np.asarray(found[()])


def _row(file: Any, path: Path, key: str, row: int) -> NDArray:
    """One frame's entry of an array."""
    found = _array(file, path, key)
    check_size(path, math.prod(found.shape[1:]) * found.dtype.itemsize, f"a frame of {key!r}")
    return np.asarray(found[row])


def _text(value: object) -> str:
    return value.decode(errors="backslashreplace") if isinstance(value, bytes) else str(value)
