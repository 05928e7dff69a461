"""PoseLibrary: poses of our skeleton out of recordings, in one file that needs neither them nor their reader."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from storage.digested import DigestedFormat, read_digested, write_digested
from synth.bodies.skeleton import DOF_IDX, DOFS, LOWER, N_DOFS, UPPER
from synth.vocabulary import SPLITS

FOOT_UP, FOOT_DOWN, FOOT_FLAT = 0, 1, 2
"""A foot in the air, on the floor with a part of its sole, flat on the floor."""
_BEND = [DOF_IDX["lumbar_flexion"], DOF_IDX["thorax_flexion"]]
_KNEES = [DOF_IDX["l_knee_flexion"], DOF_IDX["r_knee_flexion"]]
_ARRAYS = {
    "angles": ("float32", (N_DOFS,)), "root": ("float32", (3, 3)), "is_sitting": ("bool", ()),
    "feet": ("uint8", (2,)), "trial": ("int32", ()), "frame": ("int32", ()),
}  # fmt: skip


class PoseLibraryError(ValueError):
    """A file that is no pose library, is damaged, or was made for another skeleton."""


FORMAT = DigestedFormat(
    "undergrowth pose library", 2, "pose library", PoseLibraryError, "import the recordings again"
)


@dataclass(frozen=True)
class Trial:
    """One recording.

    Attributes:
        name: Identifier, such as "02_06".
        subject: Who was recorded.
        split: The one split that all recordings of this subject belong to.
        file: Name of the file that it came from.
    """

    name: str
    subject: str
    split: str
    file: str


@dataclass(frozen=True)
class PoseLibrary:
    """Poses that fit a body of any size; standing on z = 0 or sitting is up to who places them.

    Attributes:
        source: What kind of recordings, first part of a pose's identifier.
        trials: The recordings.
        angles: (n, n_dofs) float32 within the limits [rad].
        root: (n, 3, 3) float32 rotation of the root; the pelvis faces x.
        is_sitting: (n,) bool; the others stand.
        feet: (n, 2) uint8 left and right, `FOOT_UP`, `FOOT_DOWN` or `FOOT_FLAT`.
        trial: (n,) int32 index in `trials`.
        frame: (n,) int32 number of the frame in its recording.
        settings: What it was made with, as JSON values.
    """

    source: str
    trials: tuple[Trial, ...]
    angles: NDArray[np.float32]
    root: NDArray[np.float32]
    is_sitting: NDArray[np.bool_]
    feet: NDArray[np.uint8]
    trial: NDArray[np.int32]
    frame: NDArray[np.int32]
    settings: dict[str, object]

    def __post_init__(self) -> None:
        n = len(self.angles)
        for name, (dtype, shape) in _ARRAYS.items():
            array = getattr(self, name)
            if array.dtype != dtype or array.shape != (n, *shape):
                raise PoseLibraryError(f"{name} is {array.dtype} {array.shape}, must be {dtype} {(n, *shape)}")
        if (
            not np.isfinite(self.root).all()
            or not ((self.angles >= LOWER - 1e-4) & (self.angles <= UPPER + 1e-4)).all()
        ):
            raise PoseLibraryError("a pose exceeds the joint limits or is not finite")
        if n and not (self.trial.min() >= 0 and self.trial.max() < len(self.trials)):
            raise PoseLibraryError("a pose names a recording that is not there")
        split_of: dict[str, str] = {}
        for trial in self.trials:
            if trial.split not in SPLITS:
                raise PoseLibraryError(f"split {trial.split!r} is unknown; known are {', '.join(SPLITS)}")
            if split_of.setdefault(trial.subject, trial.split) != trial.split:
                raise PoseLibraryError(f"subject {trial.subject} stands in two splits")

    def __len__(self) -> int:
        return len(self.angles)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of everything in it."""
        return _digest(self)

    @cached_property
    def _rows(self) -> dict[tuple[str, bool], NDArray[np.int64]]:
        split = np.array([SPLITS.index(t.split) for t in self.trials], dtype=np.int64)[self.trial]
        return {
            (name, is_sitting): np.flatnonzero((split == k) & (self.is_sitting == is_sitting))
            for k, name in enumerate(SPLITS)
            for is_sitting in (False, True)
        }

    @cached_property
    def is_upright(self) -> NDArray[np.bool_]:
        """(n,) whether the trunk is upright and the legs are about straight, as in standing and walking."""
        bend = self.angles[:, _BEND].sum(axis=1)
        knees = self.angles[:, _KNEES].max(axis=1)
        return (self.root[:, 2, 2] > np.cos(0.4)) & (bend < 0.5) & (knees < 1.2)

    def rows(self, split: str, is_sitting: bool) -> NDArray[np.int64]:
        """(m,) indices of the poses of a split that stand or sit."""
        return self._rows[split, is_sitting]

    def pose_id(self, row: int) -> str:
        """Identifier of a pose: source, split, recording, frame."""
        trial = self.trials[int(self.trial[row])]
        return f"{self.source}/{trial.split}/{trial.name}/{int(self.frame[row]):04d}"

    def taken(self, rows: NDArray[np.int64]) -> "PoseLibrary":
        """The library with these poses only."""
        return replace(self, **{name: getattr(self, name)[rows] for name in _ARRAYS})


def joined(parts: Sequence[PoseLibrary]) -> PoseLibrary:
    """One library out of several of the same source; the first one's settings are kept.

    Args:
        parts: At least one.
    """
    first = np.cumsum([0, *(len(part.trials) for part in parts[:-1])])
    return PoseLibrary(
        parts[0].source,
        tuple(trial for part in parts for trial in part.trials),
        np.concatenate([part.angles for part in parts]),
        np.concatenate([part.root for part in parts]),
        np.concatenate([part.is_sitting for part in parts]),
        np.concatenate([part.feet for part in parts]),
        np.concatenate([part.trial + np.int32(k) for part, k in zip(parts, first, strict=True)]),
        np.concatenate([part.frame for part in parts]),
        parts[0].settings,
    )


def _digest(library: PoseLibrary) -> str:
    """What a corpus names its poses by: it hangs on the poses, not on how the file keeps them."""
    header = {
        "kind": FORMAT.name,
        "version": 1,
        "source": library.source,
        "dofs": [dof.name for dof in DOFS],
        "trials": [asdict(trial) for trial in library.trials],
        "settings": library.settings,
    }
    total = hashlib.sha256(json.dumps(header, sort_keys=True).encode())
    for name in _ARRAYS:
        total.update(np.ascontiguousarray(getattr(library, name)).tobytes())
    return total.hexdigest()


def write_library(path: Path, library: PoseLibrary) -> None:
    """Writes a library: beside, synced and renamed, so that the file is whole or absent.

    Args:
        path: The file; an old one is replaced.
        library: The poses.
    """
    metadata = {
        "dofs": [dof.name for dof in DOFS],
        "trials": [asdict(trial) for trial in library.trials],
        "settings": library.settings,
    }
    write_digested(path, FORMAT, library.source, {name: getattr(library, name) for name in _ARRAYS}, metadata)


def read_library(path: Path) -> PoseLibrary:
    """Reads a library and checks it to the last byte.

    Raises:
        PoseLibraryError: There is none, it is damaged, of another version or for another skeleton.
    """
    source, arrays, metadata = read_digested(path, FORMAT)
    if metadata.get("dofs") != [dof.name for dof in DOFS]:
        raise PoseLibraryError(f"{path} was made for another skeleton; import the recordings again")
    with FORMAT.naming_file(path):
        trials = tuple(map(_trial, metadata["trials"]))
        return PoseLibrary(source, trials, **arrays, settings=_settings(metadata["settings"]))


def _trial(values: object) -> Trial:
    if not isinstance(values, dict) or not all(isinstance(value, str) for value in values.values()):
        raise PoseLibraryError(f"a recording is {values!r:.60}, must have {', '.join(Trial.__annotations__)}")
    return Trial(**values)


def _settings(values: object) -> dict[str, object]:
    if not isinstance(values, dict):
        raise PoseLibraryError(f"settings are {values!r:.60}, must be values by name")
    return values
