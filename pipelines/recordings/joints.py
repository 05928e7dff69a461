"""Recorded joints as ours: read, turned to the camera's axes, put in our order."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.foreign import ForeignFileError, reading
from pipelines.recordings.formats.whole import read_whole
from pipelines.recordings.layout import Annotation
from synth.camera import Camera
from synth.vocabulary import JOINT_NAMES, N_JOINTS


class Skeleton(NamedTuple):
    """A person's joints, in the camera frame.

    Attributes:
        joints: (15, 3) float64 [m]; NaN where unknown.
        places: (15, 3) float64 [m], joints and guides; NaN where neither is given.
    """

    joints: NDArray[np.float64]
    places: NDArray[np.float64]

    @property
    def is_known(self) -> NDArray[np.bool_]:
        """(15,) bool, which joints are annotated."""
        return np.asarray(np.isfinite(self.joints).all(axis=1))


_FARTHEST_M = 65.535
NOBODY = Skeleton(np.full((N_JOINTS, 3), np.nan), np.full((N_JOINTS, 3), np.nan))
"""What is known of a person whose joints are not annotated."""


def read_joint_file(path: Path, annotation: Annotation) -> NDArray[np.float64]:
    """(n_names, 3) annotated joints of one frame [m], the file's axes; text, a joint a line.

    Raises:
        ForeignFileError: The file is missing, no table of numbers, or of another number of joints.
    """
    with reading(path, "a table of numbers"):
        text = read_whole(path).decode("utf-8-sig")
        try:
            table = np.array([line.split() for line in text.splitlines() if line.strip()], dtype=np.float64)
        except ValueError:
            raise ForeignFileError(f"{path} is not a table of numbers, a joint a line: x y z [m]") from None
    return checked_joints(table, annotation, str(path))


def checked_joints(
    table: NDArray[np.float64], annotation: Annotation, what: str, may_lack: bool = False
) -> NDArray[np.float64]:
    """The table itself, if it can be a frame's joints.

    Args:
        table: (n_names, 3) [m], the file's axes.
        annotation: What they are.
        what: Where they come from, for messages.
        may_lack: Joints may be NaN, which are unknown then; at least one is known.

    Raises:
        ForeignFileError: Another shape, no finite numbers, or a joint that is not in front of the camera, or too far.
    """
    shape = (len(annotation.names), 3)
    if table.shape != shape:
        raise ForeignFileError(f"{what} holds joints of shape {table.shape}, but the layout says {shape}")
    if may_lack and np.isnan(table).all():
        raise ForeignFileError(f"{what} knows no joint")
    for name, point in zip(annotation.names, table, strict=True):
        if may_lack and np.isnan(point).all():
            continue
        if not np.isfinite(point).all():
            raise ForeignFileError(f"{what}: joint {name} is {point.tolist()}, must be finite")
        if not point[2] > 0.0:
            raise ForeignFileError(f"{what}: joint {name} at z = {point[2]:g} m is not in front of the camera")
        if np.abs(point).max() > _FARTHEST_M:
            raise ForeignFileError(
                f"{what}: joint {name} is {point.tolist()}, but nothing is farther than {_FARTHEST_M:g} m; "
                "joints must be in metres"
            )
    return table


def as_ours(table: NDArray[np.float64], annotation: Annotation, camera: Camera, is_shifted: bool) -> Skeleton:
    """Annotated joints as ours.

    Args:
        table: (n_names, 3) [m], the file's axes.
        annotation: What they are.
        camera: Whose pixels `shift_px` counts.
        is_shifted: Apply `shift_px`.
    """
    xyz = table.copy()
    if annotation.y_up:
        xyz[:, 1] = -xyz[:, 1]
    if is_shifted:
        focal = np.array([camera.fx, camera.fy])
        xyz[:, :2] += np.array(annotation.shift_px) * xyz[:, 2:] / focal
    theirs = {name: xyz[i] for i, name in enumerate(annotation.names)}
    joints, places = np.full((2, N_JOINTS, 3), np.nan)
    for ours, blend in annotation.guides.items():
        places[JOINT_NAMES.index(ours)] = sum(share * theirs[name] for name, share in blend.items())
    for ours, name in annotation.joints.items():
        place = JOINT_NAMES.index(ours)
        joints[place] = places[place] = theirs[name]
    return Skeleton(joints, places)
