"""HDF5 in the layout of ITOP, a row a person: ITOP knows one person an image, so images of several are repeated."""

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import UserError
from pipelines.export.hdf5file import writing_hdf5
from pipelines.export.itop import BACKGROUND, LIBVER, ROWS, SEGMENT_OF_PART, describe, image_array, person_rows
from pipelines.export.records import ExportJob
from synth.frame import RoomFrame


def export_room_itop(job: ExportJob) -> None:
    """Writes SPLIT_depth_map.h5 and SPLIT_labels.h5, a row for every person of whom the image would show anything.

    Raises:
        UserError: The split shows nobody.
    """
    boxes = job.corpus.arrays("box", job.indices)
    shown = [
        (int(index), int(k))
        for index, box in zip(job.indices, boxes, strict=True)
        for k in np.flatnonzero(box[:, 2])
    ]
    if not shown:
        raise UserError(f"nobody is in {job.corpus.path}, split {job.split}; ITOP's files need people")
    header = job.corpus.header
    n, image = len(shown), (header.height, header.width)
    subjects = sorted({one.subject_id for i in job.indices for one in job.corpus.scene_record(int(i)).people})
    with (
        writing_hdf5(job.folder / f"{job.prefix}{job.split}_depth_map.h5", LIBVER) as maps,
        writing_hdf5(job.folder / f"{job.prefix}{job.split}_labels.h5", LIBVER) as labels,
    ):
        for file in (maps, labels):
            describe(file, job, subjects, np.array([index for index, _ in shown]))
            file.attrs["rows"] = (
                "one for each person; `frame` and `person` say which, segmentation is theirs alone"
            )
        data = image_array(maps, "data", n, image, "float16")
        segmentation = image_array(labels, "segmentation", n, image, "int8")
        rows: dict[str, list] = {name: [] for name in ROWS}
        identifiers, frame = [], None
        for row, (index, k) in enumerate(shown):
            if frame is None or frame.info.index != index:
                frame = job.scene(index)
                job.on_frame()
            data[row] = frame.depth * np.float32(0.001)
            segmentation[row] = _segments(frame, k)
            view = frame.people[k]
            for name, value in person_rows(view.joints, frame.joints_2d(k), view.joint_state).items():
                rows[name].append(value)
            who = subjects.index(frame.info.people[k].subject_id)
            identifiers.append(f"{who:02d}_{row:05d}".encode())
        for name, (dtype, shape) in ROWS.items():
            labels.create_dataset(name, data=np.array(rows[name], dtype=dtype).reshape(n, *shape))
        for file in (maps, labels):
            file.create_dataset("id", data=np.array(identifiers, dtype="S16"))
            file.create_dataset("frame", data=np.array([index for index, _ in shown], dtype=np.int64))
            file.create_dataset("person", data=np.array([k + 1 for _, k in shown], dtype=np.uint8))


def _segments(frame: RoomFrame, k: int) -> NDArray[np.int8]:
    """(height, width) ITOP's segments of one person's pixels."""
    return np.where(frame.person == k + 1, SEGMENT_OF_PART[frame.part], np.int8(BACKGROUND)).astype(np.int8)
