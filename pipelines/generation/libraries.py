"""Pose and object libraries as a corpus uses them: which share of the draws, in which splits, by which digest."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TypeVar

from pipelines.errors import UserError
from synth.bodies.motion.library import read_motions
from synth.bodies.poses.library import read_library as read_poses
from synth.occluders.meshlib import read_library as read_objects
from synth.scene import MotionMix, ObjectMix, PoseMix


class _Digested(Protocol):
    @property
    def digest(self) -> str: ...


_Library = TypeVar("_Library", bound=_Digested)


@dataclass(frozen=True)
class LibraryUse:
    """A library's file and how a corpus uses it.

    Attributes:
        path: The file.
        share: Share of the draws that take from it.
        splits: Splits that use it.
        digest: What the digest of its contents must be, once a corpus was begun with it; empty = not known yet.
    """

    path: Path
    share: float
    splits: tuple[str, ...]
    digest: str = ""

    def told(self) -> dict[str, object]:
        """What the header of a corpus says of it, as JSON values."""
        return {"digest": self.digest, "share": self.share, "splits": list(self.splits)}


def pose_mix(use: LibraryUse) -> PoseMix:
    """Reads a pose library as a corpus uses it.

    Raises:
        UserError: The file is not a library, has changed, or lacks poses for a split.
    """
    return _checked(use, lambda: PoseMix(_unchanged(use, read_poses(use.path)), use.share, use.splits))


def motion_mix(use: LibraryUse) -> MotionMix:
    """Reads a motion library as a corpus of clips uses it; errors as of `pose_mix`."""
    return _checked(use, lambda: MotionMix(_unchanged(use, read_motions(use.path)), use.share, use.splits))


def object_mix(use: LibraryUse) -> ObjectMix:
    """Reads an object library as a corpus uses it; errors as of `pose_mix`."""
    return _checked(use, lambda: ObjectMix(_unchanged(use, read_objects(use.path)), use.share, use.splits))


_Mix = TypeVar("_Mix", PoseMix, MotionMix, ObjectMix)


def _checked(use: LibraryUse, make: Callable[[], _Mix]) -> _Mix:
    try:
        return make()
    except ValueError as error:
        raise UserError(str(error)) from None


def _unchanged(use: LibraryUse, library: _Library) -> _Library:
    if use.digest and library.digest != use.digest:
        raise UserError(f"{use.path} has changed since the corpus was begun")
    return library
