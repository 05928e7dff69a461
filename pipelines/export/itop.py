"""HDF5 in the layout of ITOP (Haque et al. 2016): depth maps and labels of one split in two files.

ITOP's maps are 320x240 float16 metres, made with fx = fy = 285.7 px; the images here keep the corpus' own size
(generate with camera = "kinect_v1_qvga" for ITOP's). Its camera frame points y up: real_world_coordinates
are (X, -Y, Z) of ours. Public readers of ITOP disagree about left and right; here they are the person's own, and
the files say so in their attributes.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import UserError
from pipelines.export.hdf5file import writing_hdf5
from pipelines.export.records import ExportJob
from pipelines.recordings.itop import INTRINSICS_KEY, UNKNOWN_KEY, UNKNOWN_TEXT
from synth.frame import Frame
from synth.vocabulary import JOINT_NAMES, PART_NAMES, JointState

ITOP_JOINTS = (
    "head", "neck", "r_shoulder", "l_shoulder", "r_elbow", "l_elbow", "r_hand", "l_hand",
    "torso", "r_hip", "l_hip", "r_knee", "l_knee", "r_foot", "l_foot",
)  # fmt: skip
"""ITOP's order of the joints."""
FROM_OURS = np.array([JOINT_NAMES.index(name) for name in ITOP_JOINTS])
"""(15,) our index of each of ITOP's joints."""
BACKGROUND = -1
LIBVER = ("v108", "v108")
"""Attributes may be larger than 64 KiB since then, as those of many frames are."""
_Y_UP = np.array([1, -1, 1], dtype=np.float32)
_JOINT_OF_PART = {
    "head": "head", "neck": "neck", "torso": "torso",
    "shoulder": "shoulder", "arm_upper": "shoulder", "elbow": "elbow", "arm_lower": "elbow",
    "wrist": "hand", "hand": "hand", "leg_upper": "hip", "knee": "knee", "leg_lower": "knee",
    "ankle": "foot", "foot": "foot",
}  # fmt: skip


def _segment_of(part: str) -> int:
    """ITOP's segment of one of our parts: the joint that it moves with."""
    side, region = part[0], part.rsplit("_", maxsplit=1)[-1]
    if region in ("arm", "leg"):
        region += "_upper" if part[1] == "u" else "_lower"
    joint = _JOINT_OF_PART[region]
    return ITOP_JOINTS.index(joint if joint in ITOP_JOINTS else f"{side}_{joint}")


SEGMENT_OF_PART = np.array([BACKGROUND, *(_segment_of(part) for part in PART_NAMES[1:])], dtype=np.int8)
"""(32,) ITOP segment by our part label."""


def export_itop(job: ExportJob) -> None:
    """Writes SPLIT_depth_map.h5 and SPLIT_labels.h5.

    Raises:
        UserError: No joint is known in the split, as in recordings without joints.
    """
    if not np.isfinite(job.corpus.arrays("joints", job.indices)).any():
        raise UserError(f"no joint is known in {job.corpus.path}, split {job.split}; ITOP's files need joints")
    header = job.corpus.header
    n, image = len(job.indices), (header.height, header.width)
    subjects = sorted({job.corpus.info(int(i)).subject_id for i in job.indices})
    with (
        writing_hdf5(job.folder / f"{job.prefix}{job.split}_depth_map.h5", LIBVER) as maps,
        writing_hdf5(job.folder / f"{job.prefix}{job.split}_labels.h5", LIBVER) as labels,
    ):
        for file in (maps, labels):
            describe(file, job, subjects, job.indices)
        data = image_array(maps, "data", n, image, "float16")
        segmentation = image_array(labels, "segmentation", n, image, "int8")
        rows: dict[str, list] = {name: [] for name in ROWS}
        identifiers = []
        for row, index in enumerate(job.indices):
            frame = job.frame(index)
            data[row] = frame.depth * np.float32(0.001)
            segmentation[row] = SEGMENT_OF_PART[frame.part]
            for name, value in label_rows(frame).items():
                rows[name].append(value)
            identifiers.append(f"{subjects.index(frame.info.subject_id):02d}_{index:05d}".encode())
            job.on_frame()
        for name, (dtype, shape) in ROWS.items():
            labels.create_dataset(name, data=np.array(rows[name], dtype=dtype).reshape(n, *shape))
        for file in (maps, labels):
            file.create_dataset("id", data=np.array(identifiers, dtype="S16"))


ROWS: dict[str, tuple[str, tuple[int, ...]]] = {
    "real_world_coordinates": ("float32", (15, 3)),
    "image_coordinates": ("int16", (15, 2)),
    "visible_joints": ("int16", (15,)),
    "is_valid": ("uint8", ()),
}
"""The label arrays but for segmentation: dtype and shape of a frame's entry."""


def label_rows(frame: Frame) -> dict[str, NDArray]:
    """A frame's entries of the label arrays, joints in ITOP's order.

    An unknown joint has no coordinates (NaN, pixel 0) and makes the frame invalid, since ITOP tells that by frame.
    """
    return person_rows(frame.joints, frame.joints_2d, frame.joint_state)


def person_rows(
    joints: NDArray[np.float32], joints_2d: NDArray[np.float64], joint_state: NDArray[np.uint8]
) -> dict[str, NDArray]:
    """One person's entries of the label arrays.

    Args:
        joints: (15, 3) camera frame [m], in our order.
        joints_2d: (15, 2) [px].
        joint_state: (15,) `JointState`.
    """
    places = np.clip(np.nan_to_num(np.rint(joints_2d)), -32768, 32767)
    return {
        "real_world_coordinates": (joints * _Y_UP)[FROM_OURS],
        "image_coordinates": places.astype(np.int16)[FROM_OURS],
        "visible_joints": (joint_state == JointState.VISIBLE).astype(np.int16)[FROM_OURS],
        "is_valid": np.array(np.isfinite(joints).all(), dtype=np.uint8),
    }


def image_array(file: Any, name: str, n: int, image: tuple[int, int], dtype: str) -> Any:
    """A new compressed array of n images, one chunk each."""
    return file.create_dataset(
        name, (n, *image), dtype, chunks=(1, *image), compression="gzip", compression_opts=4
    )


def describe(file: Any, job: ExportJob, subjects: list[str], indices: NDArray[np.int64]) -> None:
    """Writes the attributes that say what is in a file.

    Args:
        file: An open HDF5 file.
        job: What is exported.
        subjects: Names of the bodies that `id` counts.
        indices: (n,) frame of each row.
    """
    file.attrs["joints"] = list(ITOP_JOINTS)
    file.attrs["left_and_right"] = "the person's own"
    file.attrs["real_world_coordinates"] = "camera frame, metres, x right, y up, z along the optical axis"
    file.attrs["segmentation"] = "-1 is background, else the joint's number"
    intrinsics = job.corpus.arrays("intrinsics", indices)
    is_one = bool((intrinsics == intrinsics[0]).all())
    file.attrs[INTRINSICS_KEY] = intrinsics[0] if is_one else intrinsics
    file.attrs[UNKNOWN_KEY] = UNKNOWN_TEXT
    file.attrs["corpus_digest"] = job.corpus.digest
    file.attrs["subjects"] = subjects
