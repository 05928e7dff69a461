"""Layouts: how a folder of recorded depth reads, as TOML files."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from pipelines.foreign import reading
from pipelines.settings import from_table, read_toml
from synth.camera import Camera
from synth.vocabulary import JOINT_NAMES

LAYOUT_FOLDER = Path(__file__).parent / "layouts"
Format = Literal["png", "pgm", "tiff", "exr", "npy", "raw", "pcd", "itop"]
Blend = dict[str, float]
"""A place as a weighted mean of annotated joints."""
MAX_SIDE = 8192
"""Of an image [px]."""
_FARTHEST_M = 65.535
"""Farthest depth that is stored [m]."""


@dataclass(frozen=True)
class CameraLayout:
    """Intrinsics, pixel centres at integers [px], and the pose above a flat floor.

    Attributes:
        fx: Focal length along u.
        fy: Focal length along v.
        cx: Principal point u.
        cy: Principal point v.
        height_m: Above the floor [m].
        tilt_deg: Downwards [deg].
    """

    fx: float
    fy: float
    cx: float
    cy: float
    height_m: float = 0.0
    tilt_deg: float = 0.0

    def __post_init__(self) -> None:
        _within(self, "fx fy", (1e-3, 1e6))
        _within(self, "cx cy", (-1e6, 1e6))
        _within(self, "height_m", (-1000.0, 1000.0))
        _within(self, "tilt_deg", (-180.0, 180.0))


@dataclass(frozen=True)
class Box:
    """What of an image is one person.

    Attributes:
        pixels: Left, top, right, bottom [px], the last two not included; empty for the whole image.
        near: Nearest depth [m].
        far: Farthest depth [m]; 0 = without end.
    """

    pixels: tuple[int, ...] = ()
    near: float = 0.0
    far: float = 0.0

    def __post_init__(self) -> None:
        _within(self, "near far", (0.0, _FARTHEST_M))
        if len(self.pixels) not in (0, 4):
            raise ValueError(f"pixels={list(self.pixels)} must be empty or left, top, right, bottom")
        if self.pixels and not (
            0 <= self.pixels[0] < self.pixels[2] <= MAX_SIDE and 0 <= self.pixels[1] < self.pixels[3] <= MAX_SIDE
        ):
            raise ValueError(
                f"pixels={list(self.pixels)} must be left, top, right, bottom in 0..{MAX_SIDE}, left before right and "
                "top before bottom"
            )
        if not (self.near >= 0.0 and (self.far == 0.0 or self.far > self.near)):
            raise ValueError(
                f"near={self.near}, far={self.far} must satisfy 0 <= near < far; far=0 means no limit"
            )


@dataclass(frozen=True)
class Foreground:
    """What of a file's image is a person.

    Attributes:
        near: Nearest depth [m].
        far: Farthest depth [m]; 0 = without end.
        boxes: One frame each; none = one frame of near..far.
    """

    near: float = 0.0
    far: float = 0.0
    boxes: tuple[Box, ...] = ()

    def __post_init__(self) -> None:
        Box((), self.near, self.far)

    @property
    def people(self) -> tuple[Box, ...]:
        """A box for every frame that a file gives."""
        return self.boxes or (Box((), self.near, self.far),)


@dataclass(frozen=True)
class Annotation:
    """Joints of the recordings.

    Attributes:
        files: Name of the file of joints: {} stands for what * matched in the depth file's name.
        names: The file's joints in its order.
        joints: Ours as theirs; ours that are not there are unknown.
        guides: Places of ours that are unknown, as weighted means of theirs: they label pixels, and are no truth.
        y_up: Their y axis points up.
        shift_px: Moves the joints in the image (right, down), where the recordings misplace them [px].
    """

    files: str
    names: tuple[str, ...]
    joints: dict[str, str]
    guides: dict[str, Blend] = field(default_factory=dict)
    y_up: bool = False
    shift_px: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if not _is_file_name(self.files.replace("{}", "")):
            raise ValueError(
                f"files={self.files!r} must be the name of a file in the folder; {{}} stands for what * matched"
            )
        if len(set(self.names)) < len(self.names) or not self.names:
            raise ValueError(f"names={list(self.names)} must be at least one name, each once")
        _within(self, "shift_px", (-1e4, 1e4))
        used = [*self.joints.values(), *(name for blend in self.guides.values() for name in blend)]
        _known("joint", [*self.joints, *self.guides], JOINT_NAMES)
        _known("name", used, self.names)
        for joint, blend in self.guides.items():
            if not all(abs(share) <= 10.0 for share in blend.values()):
                raise ValueError(f"the weights of guide {joint} are {list(blend.values())}, must be in -10..10")
            if abs(sum(blend.values()) - 1.0) > 1e-6:
                raise ValueError(f"the weights of guide {joint} sum to {sum(blend.values()):g}, must sum to 1")


def _within(values: object, names: str, limits: tuple[float, float]) -> None:
    """Refuses fields that are outside of limits, or no numbers."""
    for name in names.split():
        value = getattr(values, name)
        if not all(
            limits[0] <= number <= limits[1] for number in (value if isinstance(value, tuple) else (value,))
        ):
            raise ValueError(f"{name}={value} must be in {limits[0]:g}..{limits[1]:g}")


def _is_file_name(name: str) -> bool:
    """Whether a name, or a pattern, stays in its folder."""
    return "/" not in name and "\0" not in name and name not in ("", ".", "..")


def _known(what: str, given: list[str], known: tuple[str, ...]) -> None:
    for name in given:
        if name not in known:
            raise ValueError(f"{what} {name!r} is unknown; known are {', '.join(known)}")


@dataclass(frozen=True)
class Layout:
    """How a folder reads.

    Attributes:
        files: Which files hold depth; one * in it. They are taken in order of the numbers in their names.
        format: Of these files.
        width: Image width [px].
        height: Image height [px].
        camera: Intrinsics.
        recognised_by: Patterns that a folder of this layout matches, every one; none = chosen by name only.
        foreground: What is a person.
        annotation: Joints, if there are any.
        mm_per_unit: What 1 stands for [mm]; None = 1 of integers, 1000 of floats and clouds.
        big_endian: Of raw files: the higher byte comes first.
        swap_bytes: Of other files: the bytes of each value are in the wrong order for their format.
    """

    files: str
    format: Format
    width: int
    height: int
    camera: CameraLayout
    recognised_by: tuple[str, ...] = ()
    foreground: Foreground = field(default_factory=Foreground)
    annotation: Annotation | None = None
    mm_per_unit: float | None = None
    big_endian: bool = False
    swap_bytes: bool = False

    def __post_init__(self) -> None:
        if self.files.count("*") > 1:
            raise ValueError(f"files={self.files!r} must contain at most one *")
        for pattern in (self.files, *self.recognised_by):
            if not _is_file_name(pattern):
                raise ValueError(f"{pattern!r} must be a pattern of names in the folder, without /")
        if self.annotation is not None and any(mark in self.files for mark in "?[]"):
            raise ValueError(
                f"files={self.files!r} must contain no ? or [], where [annotation] names files after it"
            )
        if self.mm_per_unit is not None:
            _within(self, "mm_per_unit", (1e-3, 1e5))
        if self.format == "itop" and self.annotation is None:
            raise ValueError("format='itop' needs [annotation]")
        if self.swap_bytes and self.format in ("raw", "itop"):
            raise ValueError(f"swap_bytes is not for format={self.format!r}; for raw files there is big_endian")
        if self.big_endian and self.format != "raw":
            raise ValueError(f"big_endian is for format='raw' only, not {self.format!r}; use swap_bytes")
        for box in self.foreground.people:
            if box.pixels and not (box.pixels[0] < self.width and box.pixels[1] < self.height):
                raise ValueError(
                    f"the box pixels={list(box.pixels)} is outside of the image of {self.width}x{self.height}"
                )
        self.pinhole("")

    def pinhole(self, name: str) -> Camera:
        """The camera under a name.

        Raises:
            ValueError: Its size or focal lengths are out of range.
        """
        camera = self.camera
        return Camera(self.width, self.height, camera.fx, camera.fy, camera.cx, camera.cy, name)

    def unit_of(self, dtype: np.dtype) -> float:
        """What 1 stands for in values of a type [mm]."""
        return self.mm_per_unit or (1000.0 if dtype.kind == "f" else 1.0)

    def matches(self, folder: Path) -> bool:
        """Whether a folder's contents are told to be of this layout."""
        return bool(self.recognised_by) and all(any(folder.glob(pattern)) for pattern in self.recognised_by)


def known_layouts() -> dict[str, Layout]:
    """The layouts that come with the project, by name."""
    return {path.stem: read_layout(path) for path in sorted(LAYOUT_FOLDER.glob("*.toml"))}


def read_layout(path: Path) -> Layout:
    """A layout out of a TOML file.

    Raises:
        UserError: No such file, no TOML, an unknown key or a value that is not allowed.
    """
    with reading(path, "a layout in TOML"):
        return from_table(Layout, read_toml(path), str(path))
