"""Recorded depth as frames of ours: one of a folder's images a frame, labelled by its joints."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import UserError
from pipelines.importing.bones import bones_of
from pipelines.importing.foreground import cut_out, drop_blobs
from pipelines.importing.geodesic import label_parts
from pipelines.importing.itop import ItopIndex, read_index, read_row
from pipelines.importing.joints import NOBODY, Skeleton, as_ours, checked_joints, read_joint_file
from pipelines.importing.layout import Box, Layout
from pipelines.importing.poses import camera_pose, person_pose
from pipelines.importing.readers import DepthImage, read_image
from synth.frame import Frame, FrameInfo
from synth.render.labels import measure_visibility
from synth.render.records import RenderedPair
from synth.vocabulary import JointState

SCENE_FAMILY = "recorded"


@dataclass(frozen=True)
class Options:
    """How recordings become frames.

    Attributes:
        name: Of the recordings; subjects and poses are named after it.
        smallest_share: Blobs of fewer of the person's pixels are dropped.
        is_shifted: Apply the layout's registration of the joints.
        every: One frame of so many.
        shares: Of train, val and test, by the order of frames; they sum to 1.
    """

    name: str
    smallest_share: float
    is_shifted: bool
    every: int
    shares: tuple[float, float, float]


@dataclass(frozen=True)
class Entry:
    """Where one frame comes from.

    Attributes:
        path: File of its depth.
        row: Frame in the file, where one holds many.
        box: What of the image is the person.
        subject: Who, if it is known.
        key: Name of the image, and of the person in it.
    """

    path: Path
    row: int
    box: Box
    subject: str
    key: str


class RecordedFrames:
    """Frames of a folder of recordings; each depends on its own files alone.

    Attributes:
        layout: How the folder reads.
        options: How recordings become frames.
        entries: One a frame.
    """

    def __init__(self, folder: Path, layout: Layout, options: Options) -> None:
        self.layout = layout
        self.options = options
        self._camera = layout.pinhole(options.name)
        self._indices: dict[Path, ItopIndex] = {}
        paths = list_files(folder, layout.files)
        listed = self._itop_entries(paths) if layout.format == "itop" else self._image_entries(paths)
        self.entries = listed[:: options.every]
        if not self.entries:
            raise UserError(f"{folder} has no frame with valid joints")

    def __len__(self) -> int:
        """Number of frames."""
        return len(self.entries)

    def split_of(self, index: int) -> str:
        """The split of a frame: the first frames train, the last test."""
        train, val, _ = self.options.shares
        place = index + 0.5
        n = len(self.entries)
        return "train" if place < train * n else "val" if place < (train + val) * n else "test"

    def frame(self, index: int) -> Frame:
        """Frame of that number.

        Raises:
            UserError: Its files are missing, damaged, or other than the layout says.
        """
        entry = self.entries[index]
        depth, skeleton = self._read(entry)
        image = drop_blobs(cut_out(depth, entry.box), self.options.smallest_share)
        if not image.any():
            raise UserError(f"{entry.path} shows no person within the layout's foreground")
        bones = bones_of(skeleton.places)
        part = label_parts(image, bones, self._camera) if len(bones.start) else np.zeros_like(image, np.uint8)
        return self._framed(index, image, part, skeleton)

    def _read(self, entry: Entry) -> tuple[DepthImage, Skeleton]:
        annotation = self.layout.annotation
        if self.layout.format == "itop":
            assert annotation is not None
            index = self._indices[entry.path]
            depth, table = read_row(index, entry.row, self.layout)
            checked_joints(table, annotation, f"frame {entry.row} of {index.labels}")
        else:
            depth = read_image(entry.path, self.layout)
            if annotation is None:
                return depth, NOBODY
            table = read_joint_file(_partner(entry.path, self.layout), annotation)
        return depth, as_ours(table, annotation, self._camera, self.options.is_shifted)

    def _framed(self, index: int, image: DepthImage, part: NDArray[np.uint8], skeleton: Skeleton) -> Frame:
        nothing = np.zeros_like(part)
        body = image if part.any() else np.zeros_like(image)
        pair = RenderedPair(image, part, nothing, nothing, body, part, np.zeros(1, np.int64))
        seen = measure_visibility(pair, skeleton.joints, self._camera)
        is_known = skeleton.is_known
        T_world_camera = camera_pose(self.layout.camera.height_m, self.layout.camera.tilt_deg)
        entry, split = self.entries[index], self.split_of(index)
        subject = "/".join(filter(None, (self.options.name, entry.subject, split)))
        return Frame(
            depth=image,
            part=part,
            occluder=nothing,
            instance=nothing,
            body_depth=body,
            body_part=part,
            joints=skeleton.joints.astype(np.float32),
            joint_state=np.where(is_known, seen.joint_state, JointState.UNKNOWN).astype(np.uint8),
            joint_visible_fraction=np.where(is_known, seen.joint_visible_fraction, 0).astype(np.float32),
            part_visible_fraction=seen.part_visible_fraction,
            angles=np.zeros(1, np.float32),
            T_world_root=person_pose(image, skeleton.places, self._camera, T_world_camera),
            T_world_camera=T_world_camera,
            camera=self._camera,
            info=FrameInfo(
                seed=0,
                index=index,
                split=split,
                subject_id=subject,
                subject={"kind": "recorded"},
                scene_family=SCENE_FAMILY,
                pose_family=SCENE_FAMILY,
                pose_id=f"{self.options.name}/{entry.key}",
                visible_fraction=1.0,
            ),
        )

    def _image_entries(self, paths: list[Path]) -> list[Entry]:
        people = self.layout.foreground.people
        names = [f"/{k}" if len(people) > 1 else "" for k in range(len(people))]
        entries = [
            Entry(path, 0, box, name.strip("/"), path.stem + name)
            for path in paths
            for box, name in zip(people, names, strict=True)
        ]
        if self.layout.annotation is not None:
            for path in paths:
                if not _partner(path, self.layout).exists():
                    raise UserError(f"{path} has no joints: there is no file {_partner(path, self.layout)}")
        return entries

    def _itop_entries(self, paths: list[Path]) -> list[Entry]:
        box = self.layout.foreground.people[0]
        entries = []
        for path in paths:
            index = self._indices[path] = read_index(path, _partner(path, self.layout), self.layout)
            entries += [
                Entry(path, row, box, subject, f"{path.stem}/{row}")
                for row, subject in zip(index.rows, index.subjects, strict=True)
            ]
        return entries


def list_files(folder: Path, pattern: str) -> list[Path]:
    """A folder's files of a pattern, in order of the numbers in their names.

    Raises:
        UserError: There are none.
    """
    paths = sorted(folder.glob(pattern), key=lambda path: (_numbers(path.name), path.name))
    if not paths:
        raise UserError(f"{folder} has no files {pattern}")
    return paths


def _numbers(name: str) -> list[int]:
    return [int(digits) for digits in re.findall(r"\d+", name)]


def _partner(path: Path, layout: Layout) -> Path:
    """The file of joints beside a file of depth."""
    assert layout.annotation is not None
    before, _, after = layout.files.partition("*")
    return path.with_name(
        layout.annotation.files.replace("{}", path.name[len(before) : len(path.name) - len(after)])
    )
