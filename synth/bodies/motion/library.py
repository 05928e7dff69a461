"""MotionLibrary: recorded motions of our skeleton, frame after frame, in one file that needs no recordings."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from storage.digested import DigestedFormat, read_digested, write_digested
from synth.bodies.mocap.capture import RecordedMotion
from synth.bodies.poses.library import Trial
from synth.bodies.skeleton import DOFS, LOWER, N_DOFS, UPPER
from synth.vocabulary import SPLITS

_ARRAYS = {
    "angles": ("float32", (N_DOFS,)), "root": ("float32", (3, 3)), "hips": ("float32", (3,)),
    "contacts": ("bool", (2, 2)), "motion": ("int32", ()), "frame": ("int32", ()),
}  # fmt: skip


class MotionLibraryError(ValueError):
    """A file that is no motion library, is damaged, or was made for another skeleton."""


FORMAT = DigestedFormat(
    "undergrowth motion library", 1, "motion library", MotionLibraryError, "import the recordings again"
)


@dataclass(frozen=True)
class Stretch:
    """Frames of a recording that follow each other.

    Attributes:
        trial: Index of the recording.
        fps: Frames a second.
    """

    trial: int
    fps: float


@dataclass(frozen=True)
class MotionLibrary:
    """Motions that fit a body of any size; where in a room they take place is up to who places them.

    Attributes:
        source: What kind of recordings, first part of a motion's identifier.
        trials: The recordings.
        stretches: The motions.
        angles: (n, n_dofs) float32, see `RecordedMotion`; frames of one motion follow each other.
        root: (n, 3, 3) float32.
        hips: (n, 3) float32.
        contacts: (n, 2, 2) bool.
        motion: (n,) int32 index in `stretches`, rising.
        frame: (n,) int32 number of the frame in its recording.
        settings: What it was made with, as JSON values.
    """

    source: str
    trials: tuple[Trial, ...]
    stretches: tuple[Stretch, ...]
    angles: NDArray[np.float32]
    root: NDArray[np.float32]
    hips: NDArray[np.float32]
    contacts: NDArray[np.bool_]
    motion: NDArray[np.int32]
    frame: NDArray[np.int32]
    settings: dict[str, object]

    def __post_init__(self) -> None:
        n = len(self.angles)
        for name, (dtype, shape) in _ARRAYS.items():
            array = getattr(self, name)
            if array.dtype != dtype or array.shape != (n, *shape):
                raise MotionLibraryError(f"{name} is {array.dtype} {array.shape}, must be {dtype} {(n, *shape)}")
        if not (np.isfinite(self.root).all() and np.isfinite(self.hips).all()):
            raise MotionLibraryError("a motion is not finite")
        if not ((self.angles >= LOWER - 1e-4) & (self.angles <= UPPER + 1e-4)).all():
            raise MotionLibraryError("a motion exceeds the joint limits")
        if (
            not np.array_equal(np.unique(self.motion), np.arange(len(self.stretches)))
            or (np.diff(self.motion) < 0).any()
        ):
            raise MotionLibraryError("the frames of the motions are not in order")
        split_of: dict[str, str] = {}
        for trial in self.trials:
            if trial.split not in SPLITS:
                raise MotionLibraryError(f"split {trial.split!r} is unknown; known are {', '.join(SPLITS)}")
            if split_of.setdefault(trial.subject, trial.split) != trial.split:
                raise MotionLibraryError(f"subject {trial.subject} stands in two splits")
        for stretch in self.stretches:
            if not (0 <= stretch.trial < len(self.trials) and stretch.fps > 0.0):
                raise MotionLibraryError(f"a motion has trial {stretch.trial} and fps={stretch.fps}")

    def __len__(self) -> int:
        """Number of motions."""
        return len(self.stretches)

    def __getitem__(self, k: int) -> RecordedMotion:
        if not 0 <= k < len(self):
            raise IndexError(f"motion {k} is not in 0..{len(self) - 1}")
        first, last = np.searchsorted(self.motion, [k, k + 1])
        own = slice(int(first), int(last))
        trial = self.trials[self.stretches[k].trial]
        return RecordedMotion(
            f"{self.source}/{trial.split}/{trial.name}/{int(self.frame[first]):04d}",
            self.stretches[k].fps,
            self.angles[own],
            self.root[own],
            self.hips[own],
            self.contacts[own],
        )

    @cached_property
    def digest(self) -> str:
        """SHA-256 of everything in it."""
        total = hashlib.sha256(json.dumps(self._metadata(), sort_keys=True).encode())
        total.update(self.source.encode())
        for name in _ARRAYS:
            total.update(np.ascontiguousarray(getattr(self, name)).tobytes())
        return total.hexdigest()

    @cached_property
    def seconds(self) -> NDArray[np.float64]:
        """(n_motions,) how long each lasts."""
        counts = np.bincount(self.motion, minlength=len(self.stretches))
        return (counts - 1) / np.array([stretch.fps for stretch in self.stretches])

    def of_split(self, split: str, least_seconds: float = 0.0) -> NDArray[np.int64]:
        """(m,) motions of a split that last at least so long [s]."""
        is_own = np.array([self.trials[stretch.trial].split == split for stretch in self.stretches], np.bool_)
        return np.flatnonzero(is_own & (self.seconds >= least_seconds))

    def _metadata(self) -> dict[str, object]:
        return {
            "dofs": [dof.name for dof in DOFS],
            "trials": [asdict(trial) for trial in self.trials],
            "stretches": [asdict(stretch) for stretch in self.stretches],
            "settings": self.settings,
        }


def joined_motions(
    source: str,
    parts: Sequence[tuple[Trial, Sequence[RecordedMotion], Sequence[int]]],
    settings: dict[str, object],
) -> MotionLibrary:
    """A library out of the motions of recordings.

    Args:
        source: What kind of recordings.
        parts: Of each recording, its motions and the number of each one's first frame.
        settings: What it was made with, as JSON values.
    """
    motions = [motion for _, own, _ in parts for motion in own]
    firsts = [first for _, _, own in parts for first in own]
    counts = [len(motion.angles) for motion in motions]
    stretches = tuple(Stretch(k, motion.fps) for k, (_, own, _) in enumerate(parts) for motion in own)

    def joined(name: str) -> np.ndarray:
        dtype, shape = _ARRAYS[name]
        return np.concatenate([np.zeros((0, *shape), dtype), *(getattr(motion, name) for motion in motions)])

    numbers = [first + np.arange(n, dtype=np.int32) for first, n in zip(firsts, counts, strict=True)]
    return MotionLibrary(
        source,
        tuple(trial for trial, _, _ in parts),
        stretches,
        joined("angles"),
        joined("root"),
        joined("hips"),
        joined("contacts"),
        np.repeat(np.arange(len(motions), dtype=np.int32), counts),
        np.concatenate([np.zeros(0, np.int32), *numbers]),
        settings,
    )


def write_motions(path: Path, library: MotionLibrary) -> None:
    """Writes a library: beside, synced and renamed, so that the file is whole or absent.

    Args:
        path: The file; an old one is replaced.
        library: The motions.
    """
    arrays = {name: getattr(library, name) for name in _ARRAYS}
    write_digested(path, FORMAT, library.source, arrays, library._metadata())


def read_motions(path: Path) -> MotionLibrary:
    """Reads a library and checks it to the last byte.

    Raises:
        MotionLibraryError: There is none, it is damaged, of another version or for another skeleton.
    """
    source, arrays, metadata = read_digested(path, FORMAT)
    if metadata.get("dofs") != [dof.name for dof in DOFS]:
        raise MotionLibraryError(f"{path} was made for another skeleton; import the recordings again")
    with FORMAT.naming_file(path):
        trials = tuple(Trial(**values) for values in metadata["trials"])
        stretches = tuple(Stretch(int(v["trial"]), float(v["fps"])) for v in metadata["stretches"])
        return MotionLibrary(source, trials, stretches, **arrays, settings=dict(metadata["settings"]))
