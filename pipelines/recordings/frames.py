"""Recorded depth as frames of ours: one of a folder's images a frame, labelled by its joints."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import UserError
from pipelines.foreign import ForeignFileError
from pipelines.recordings.bones import bones_of
from pipelines.recordings.entries import Entry, judge_entry, list_entries, list_files, partner, read_person
from pipelines.recordings.geodesic import label_parts
from pipelines.recordings.itop import read_joint_row
from pipelines.recordings.joints import NOBODY, Skeleton, as_ours, checked_joints, read_joint_file
from pipelines.recordings.layout import Layout
from pipelines.recordings.poses import camera_pose, person_pose
from pipelines.recordings.readers import DepthImage
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


class RecordedFrames:
    """Frames of a folder of recordings; each depends on its own files alone.

    Attributes:
        layout: How the folder reads.
        options: How recordings become frames.
        entries: One a frame; as given, or every frame of the folder that is wanted.
    """

    def __init__(
        self, folder: Path, layout: Layout, options: Options, entries: Sequence[Entry] | None = None
    ) -> None:
        self.layout = layout
        self.options = options
        self._camera = layout.pinhole(options.name)
        if entries is None:
            entries = list_entries(list_files(folder, layout.files), layout)[:: options.every]
        self.entries = tuple(entries)
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
        image, skeleton, _ = self.read(self.entries[index])
        bones = bones_of(skeleton.places)
        part = label_parts(image, bones, self._camera) if len(bones.start) else np.zeros_like(image, np.uint8)
        return self._framed(index, image, part, skeleton)

    def read(self, entry: Entry) -> tuple[DepthImage, Skeleton, str]:
        """The person's depth and joints out of an entry's files, and a sentence about what is unlikely of them.

        Raises:
            UserError: The files are missing, damaged, or other than the layout says; or they show no person.
        """
        image = read_person(entry, self.layout, self.options.smallest_share)
        return image, self._skeleton(entry), judge_entry(entry, self.layout, image)

    def _skeleton(self, entry: Entry) -> Skeleton:
        annotation = self.layout.annotation
        if annotation is None:
            return NOBODY
        if entry.itop is not None:
            table = read_joint_row(entry.itop, entry.tick)
            what = f"frame {entry.tick} of {entry.itop.labels}"
            checked_joints(table, annotation, what, entry.itop.has_unknown)
        else:
            path = partner(entry.path, self.layout)
            if path is None or not path.exists():
                raise ForeignFileError(f"{entry.path} has no joints: there is no file {path}")
            table = read_joint_file(path, annotation)
        return as_ours(table, annotation, self._camera, self.options.is_shifted)

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
