"""Depth files that no layout describes: what they are by their names, their camera as the user gives it."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

from pipelines.errors import UserError
from pipelines.recordings.entries import in_order, is_picture
from pipelines.recordings.layout import CameraLayout, Format, Layout, known_layouts
from pipelines.recordings.readers import SUFFIXES, read_values
from synth.render.presets import camera_named as preset


@dataclass(frozen=True)
class GivenCamera:
    """A camera preset, or intrinsics for images of any size.

    Attributes:
        name: Of the preset; empty for none.
        intrinsics: fx, fy, cx, cy [px], if there is no preset.
    """

    name: str = ""
    intrinsics: tuple[float, float, float, float] | None = None

    def __post_init__(self) -> None:
        if bool(self.name) == (self.intrinsics is not None):
            raise UserError("the camera is needed: give either --camera NAME or --intrinsics FX FY CX CY")
        if self.intrinsics is not None:
            if not (all(map(math.isfinite, self.intrinsics)) and min(self.intrinsics[:2]) > 0):
                raise UserError(f"intrinsics={self.intrinsics} must be finite, fx and fy above 0")
            return
        try:
            preset(self.name)
        except ValueError as error:
            raise UserError(str(error)) from None

    @property
    def values(self) -> CameraLayout:
        """The intrinsics."""
        if self.intrinsics is not None:
            return CameraLayout(*self.intrinsics)
        camera = preset(self.name)
        return CameraLayout(camera.fx, camera.fy, camera.cx, camera.cy)

    @property
    def size(self) -> tuple[int, int] | None:
        """Width and height of its images [px]; None for any."""
        camera = preset(self.name) if self.name else None
        return None if camera is None else (camera.width, camera.height)


def file_layout(path: Path, camera: GivenCamera) -> Layout:
    """How a file reads that holds one image, or ITOP's many: by its name, its size that of the camera, or its own.

    Raises:
        UserError: It cannot be read, is of another size than the camera's images, or does not tell its size.
    """
    kind = SUFFIXES.get(path.suffix.lower())
    if kind is None:
        raise UserError(f"{path} is no depth file by its name: known endings are {', '.join(SUFFIXES)}")
    if kind in ("raw", "itop"):
        return _sized_layout(path, kind, camera)
    layout = Layout(path.name, kind, 1, 1, camera.values)
    height, width = read_values(path, layout).shape
    if camera.size is not None and camera.size != (width, height):
        raise UserError(
            f"{path} is {width}x{height}, but the camera {camera.name} has {camera.size[0]}x{camera.size[1]}; "
            "give --intrinsics for cropped or scaled images"
        )
    return replace(layout, width=width, height=height)


def _sized_layout(path: Path, kind: Format, camera: GivenCamera) -> Layout:
    """Of a file that does not tell the size of its images."""
    if camera.size is None:
        raise UserError(f"{path} does not contain the size of its images; give --camera NAME or --layout")
    width, height = camera.size
    if kind == "itop":
        return replace(known_layouts()["itop"], width=width, height=height, camera=camera.values)
    return Layout(path.name, kind, width, height, camera.values)


def folder_layout(folder: Path, camera: GivenCamera) -> Layout:
    """How a folder of depth files of one kind reads, all of one size.

    Raises:
        UserError: It holds none, several kinds, or none that can be read.
    """
    paths = [path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES and path.is_file()]
    paths = in_order(path for path in paths if not is_picture(path))
    suffixes = sorted({path.suffix for path in paths})
    if not suffixes:
        raise UserError(f"{folder} has no depth files: none ends in {', '.join(SUFFIXES)}")
    if len(suffixes) > 1:
        raise UserError(
            f"{folder} has files of several kinds ({' and '.join(suffixes)}); give the depth files by name"
        )
    reasons = []
    for path in paths:
        try:
            layout = file_layout(path, camera)
            return layout if layout.format == "itop" else replace(layout, files=f"*{suffixes[0]}")
        except UserError as error:
            reasons.append(str(error))
    raise UserError(f"{folder} has no file that can be read; the first one failed: {reasons[0]}")
