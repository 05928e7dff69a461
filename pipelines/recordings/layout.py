"""Layouts: how a folder of recorded depth reads, as TOML files."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from pipelines.errors import UserError
from pipelines.settings import from_table, read_toml
from synth.camera import Camera
from synth.vocabulary import JOINT_NAMES

LAYOUT_FOLDER = Path(__file__).parent / "layouts"
Format = Literal["png", "npy", "raw", "pcd", "itop"]
Blend = dict[str, float]
"""A place as a weighted mean of annotated joints."""


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
        if len(self.pixels) not in (0, 4):
            raise ValueError(f"pixels={list(self.pixels)} must be empty or left, top, right, bottom")
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
        used = [*self.joints.values(), *(name for blend in self.guides.values() for name in blend)]
        _known("joint", [*self.joints, *self.guides], JOINT_NAMES)
        _known("name", used, self.names)
        for joint, blend in self.guides.items():
            if abs(sum(blend.values()) - 1.0) > 1e-6:
                raise ValueError(f"the weights of guide {joint} sum to {sum(blend.values()):g}, must sum to 1")


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
        mm_per_unit: Of integers; clouds and floats are in metres.
        big_endian: Of raw files.
    """

    files: str
    format: Format
    width: int
    height: int
    camera: CameraLayout
    recognised_by: tuple[str, ...] = ()
    foreground: Foreground = field(default_factory=Foreground)
    annotation: Annotation | None = None
    mm_per_unit: float = 1.0
    big_endian: bool = False

    def __post_init__(self) -> None:
        if self.files.count("*") > 1:
            raise ValueError(f"files={self.files!r} must contain at most one *")
        if not self.mm_per_unit > 0.0:
            raise ValueError(f"mm_per_unit={self.mm_per_unit} must be positive")
        if self.format == "itop" and self.annotation is None:
            raise ValueError("format='itop' needs [annotation]")
        self.pinhole("")

    def pinhole(self, name: str) -> Camera:
        """The camera under a name.

        Raises:
            ValueError: Its size or focal lengths are out of range.
        """
        camera = self.camera
        return Camera(self.width, self.height, camera.fx, camera.fy, camera.cx, camera.cy, name)

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
    return from_table(Layout, read_toml(path), str(path))


def choose_layout(folder: Path, wanted: str | None) -> tuple[str, Layout]:
    """The layout named, read from a file, or found from the folder's contents, with its name.

    Raises:
        UserError: Unknown name, a file that is no layout, or none or several recognised.
    """
    known = known_layouts()
    if wanted in known:
        return wanted, known[wanted]
    if wanted is not None and wanted.endswith(".toml"):
        return Path(wanted).stem, read_layout(Path(wanted))
    listed = ", ".join(known)
    if wanted is not None:
        raise UserError(f"layout {wanted!r} is unknown; known are {listed}, or give a .toml file")
    found = recognised(folder)
    if len(found) == 1:
        return found[0], known[found[0]]
    if found:
        raise UserError(f"{folder} fits the layouts {' and '.join(found)}; choose one with --layout")
    raise UserError(f"{folder} fits no known layout ({listed}); describe it in a .toml file and give --layout")


def recognised(folder: Path) -> list[str]:
    """Names of the known layouts that a folder's contents are told to be of."""
    return [name for name, layout in known_layouts().items() if layout.matches(folder)]
