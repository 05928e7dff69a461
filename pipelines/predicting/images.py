"""Depth images that a model is asked about, listed before they are read, so that a damaged file loses no other."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.frames import Pinhole
from pipelines.errors import UserError
from pipelines.recordings.choosing import choose_layout, recognised
from pipelines.recordings.entries import (
    SMALLEST_BLOB,
    Entry,
    judge_entry,
    list_entries,
    list_files,
    read_person,
    readable,
)
from pipelines.recordings.layout import Foreground, Layout
from pipelines.recordings.plain import GivenCamera, file_layout, folder_layout
from pipelines.recordings.plausible import judge_person
from pipelines.recordings.readers import SUFFIXES, read_image, stored_unit

CAMERA_NEEDED = "the camera is needed: give either --camera NAME or --intrinsics FX FY CX CY, or --layout"


class DepthImage(NamedTuple):
    """What is asked about.

    Attributes:
        depth: (height, width) uint16 [mm], 0 = nothing.
        camera: Intrinsics.
    """

    depth: NDArray[np.uint16]
    camera: Pinhole


@dataclass(frozen=True)
class Request:
    """An image that is not read yet.

    Attributes:
        name: Of the files that are written.
        source: Where it comes from, for messages.
        track: Whose it is: images of one track show one person, in order of time.
        tick: Its place in time, in frames.
        read: Reads it; a UserError if it cannot be read.
        judge: Of measured depth: says in a sentence what is unlikely of what was kept of it, else nothing; a
            UserError if that can be no person.
        is_cut_out: Something besides the depth itself says what of the image is the person.
    """

    name: str
    source: str
    track: str
    tick: int
    read: Callable[[], DepthImage]
    judge: Callable[[NDArray[np.uint16]], str] = field(default=lambda depth: "")
    is_cut_out: bool = False


def corpus_requests(folder: Path, numbers: Sequence[int], sensor: str | None) -> list[Request]:
    """Frames of a corpus, each a track of its own; in a corpus of single people these are cut out.

    Raises:
        UserError: No such corpus or frame, or no sensor for it.
    """
    from pipelines.corpus import Corpus

    corpus = Corpus.open(folder)
    corpus.check_sensor(sensor)
    for number in numbers:
        if number not in corpus.indices:
            raise UserError(f"frame {number} is not in {folder}, which has 0..{len(corpus) - 1}")

    def request(number: int) -> Request:
        def read() -> DepthImage:
            return DepthImage(corpus.arrays("depth", [number], sensor)[0], corpus.camera(number))

        is_cut_out = not corpus.header.has_rooms
        return Request(f"frame_{number:06d}", f"frame {number}", "", number, read, is_cut_out=is_cut_out)

    return [request(number) for number in numbers]


def recorded_requests(
    paths: Sequence[Path], layout: str | None, camera: GivenCamera | None, is_whole: bool = False
) -> list[Request]:
    """The people in the files of a folder, or in files by name; or the whole images.

    Args:
        paths: One folder, or files.
        layout: Name of a known layout or a .toml file; None = found from what lies in the folder, or beside the
            files.
        camera: Of depth that no layout describes.
        is_whole: Leave everything in the images, whatever the layout calls the person.

    Raises:
        UserError: The folder is not there or empty, no layout is found, or it and a camera are given.
    """
    if layout is not None and camera is not None:
        raise UserError("a layout defines its camera: give either --layout, or --camera or --intrinsics")
    if not any(path.is_dir() for path in paths):
        return _of_files(paths, layout, camera, is_whole)
    if len(paths) > 1:
        raise UserError(
            f"give one folder, or files only; {len(paths)} paths were given, and at least one is a folder"
        )
    name, chosen = recording_layout(paths[0], layout, camera)
    return layout_requests(list_files(paths[0], chosen.files), name, chosen, is_whole)


def recording_layout(folder: Path, layout: str | None, camera: GivenCamera | None) -> tuple[str, Layout]:
    """How a folder reads, with the layout's name: as told, as found, or as plain files of a camera.

    Raises:
        UserError: There is no such folder, or nothing says how it reads.
    """
    if not folder.is_dir():
        raise UserError(f"{folder} is not a folder")
    if camera is not None:
        return folder.resolve().name, folder_layout(folder, camera)
    try:
        return choose_layout(folder, layout)
    except UserError as error:
        if layout is not None or recognised(folder):
            raise
        raise UserError(f"{error}; plain depth files need --camera NAME or --intrinsics FX FY CX CY") from None


def _of_files(
    paths: Sequence[Path], layout: str | None, camera: GivenCamera | None, is_whole: bool
) -> list[Request]:
    folders = {path.parent for path in paths}
    if camera is not None:
        return _plain(paths, camera)
    if layout is None and not (len(folders) == 1 and len(recognised(next(iter(folders)))) == 1):
        raise UserError(CAMERA_NEEDED)
    name, chosen = choose_layout(paths[0].parent, layout)
    if layout is None and not all(path.match(chosen.files) for path in paths):
        raise UserError(CAMERA_NEEDED)
    return layout_requests(paths, name, chosen, is_whole)


def layout_requests(paths: Sequence[Path], name: str, layout: Layout, is_whole: bool = False) -> list[Request]:
    """The people in files of a layout, or the whole images."""
    camera = layout.pinhole(name)
    layout = replace(layout, foreground=Foreground()) if is_whole else layout
    smallest_share = 0.0 if is_whole else SMALLEST_BLOB

    def request(entry: Entry) -> Request:
        return Request(
            entry.key.replace("/", "_"),
            entry.source,
            entry.subject,
            entry.tick,
            lambda: DepthImage(read_person(entry, layout, smallest_share), camera),
            lambda depth: judge_entry(entry, layout, depth),
            layout.foreground != Foreground(),
        )

    return [request(entry) for entry in list_entries(paths, layout)]


def _plain(paths: Sequence[Path], camera: GivenCamera) -> list[Request]:
    """Images of files, whole and each of its own size."""

    def request(tick: int, path: Path) -> Request:
        source = readable(str(path))

        def read() -> DepthImage:
            layout = file_layout(path, camera)
            return DepthImage(read_image(path, layout), layout.pinhole(""))

        def judge(depth: NDArray[np.uint16]) -> str:
            layout = file_layout(path, camera)
            return judge_person(source, depth, layout.camera, lambda: stored_unit(path, layout))

        return Request(readable(path.stem), source, "", tick, read, judge)

    requests = []
    for tick, path in enumerate(paths):
        if SUFFIXES.get(path.suffix.lower()) == "itop":
            requests += layout_requests([path], path.stem, file_layout(path, camera))
        else:
            requests.append(request(tick, path))
    return requests
