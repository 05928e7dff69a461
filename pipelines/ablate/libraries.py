"""Libraries of recorded poses and imported objects that the question `imported` tests on."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from pipelines.ablate.config import AblationConfig
from pipelines.errors import UserError
from synth.bodies.poses.library import read_library as read_poses
from synth.occluders.meshlib import read_library as read_objects

SPLIT: Literal["test"] = "test"
"""Only frames of this split take from a library; the others stay what they are without it."""


@dataclass(frozen=True)
class Library:
    """A library's file.

    Attributes:
        path: Where it lies; nothing depends on it.
        digest: Of its contents.
    """

    path: Path = field(compare=False)
    digest: str


@dataclass(frozen=True)
class Libraries:
    """What test frames take instead of what the generator draws.

    Attributes:
        poses: Recorded poses, made by `undergrowth import mocap`; None = drawn ones.
        objects: Other people's objects, made by `undergrowth import meshes`; None = drawn ones.
    """

    poses: Library | None = None
    objects: Library | None = None

    def __bool__(self) -> bool:
        return self.poses is not None or self.objects is not None

    @property
    def digests(self) -> dict[str, str | None]:
        """Digest of each, None where there is none."""
        return {
            "poses": None if self.poses is None else self.poses.digest,
            "objects": None if self.objects is None else self.objects.digest,
        }


def read_libraries(config: AblationConfig) -> Libraries:
    """The libraries that a configuration names.

    Raises:
        UserError: There are none though the question is asked, or some though it is not; a file is missing,
            damaged, or has nothing of the test split.
    """
    is_asked = "imported" in config.questions
    given = [name for name in ("test_poses", "test_objects") if getattr(config, name) is not None]
    if is_asked and not given:
        raise UserError("the question imported needs a library to test on: give --poses or --objects")
    if given and not is_asked:
        path = getattr(config, given[0])
        raise UserError(f"{given[0]}={path} is used only by the question imported; ask that question too")
    return Libraries(
        _read(config.test_poses, "poses", _of_poses),
        _read(config.test_objects, "objects", _of_objects),
    )


def _of_poses(path: Path) -> tuple[str, int]:
    library = read_poses(path)
    return library.digest, sum(len(library.rows(SPLIT, is_sitting)) for is_sitting in (False, True))


def _of_objects(path: Path) -> tuple[str, int]:
    library = read_objects(path)
    return library.digest, len(library.of(SPLIT))


def _read(path: Path | None, what: str, read: Callable[[Path], tuple[str, int]]) -> Library | None:
    if path is None:
        return None
    try:
        digest, n = read(path)
    except (ValueError, OSError) as error:
        raise UserError(str(error)) from None
    if not n:
        raise UserError(f"{path} has no {what} in the split {SPLIT}; import some with --{SPLIT}")
    return Library(path, digest)
