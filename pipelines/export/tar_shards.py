"""WebDataset: tar shards whose members of one sample share their name up to the first dot."""

import io
import json
import tarfile
from collections.abc import Callable

import numpy as np

from pipelines.corpus.frameinfo import info_line
from pipelines.export.records import ExportJob, png_bytes
from synth.frame import Frame

FRAMES_PER_TAR = 512
MAPS = ("depth", "part", "occluder", "instance", "body_depth", "body_part")


def export_webdataset(job: ExportJob) -> None:
    """Writes SPLIT-NUMBER.tar; the same corpus gives the same bytes."""
    write_tars(job, lambda index: members(job.frame(index)))


def write_tars(job: ExportJob, members_of: Callable[[int], dict[str, bytes]]) -> None:
    """Writes SPLIT-NUMBER.tar.

    Args:
        job: What to export.
        members_of: A sample's files by extension, of a frame's number.
    """
    for number, first in enumerate(range(0, len(job.indices), FRAMES_PER_TAR)):
        with tarfile.open(job.folder / f"{job.split}-{number:06d}.tar", "w", format=tarfile.USTAR_FORMAT) as tar:
            for index in job.indices[first : first + FRAMES_PER_TAR]:
                for name, data in members_of(int(index)).items():
                    entry = tarfile.TarInfo(f"{index:07d}.{name}")
                    entry.size = len(data)
                    tar.addfile(entry, io.BytesIO(data))
                job.on_frame()


def members(frame: Frame) -> dict[str, bytes]:
    """A sample's files by extension: 16 or 8 bit PNG maps, joints as NPY, the rest as JSON."""
    out = {f"{name}.png": png_bytes(getattr(frame, name)) for name in MAPS}
    buffer = io.BytesIO()
    np.save(buffer, frame.joints)
    out["joints.npy"] = buffer.getvalue()
    camera = frame.camera
    record = json.loads(info_line(frame)) | {
        "intrinsics": [camera.fx, camera.fy, camera.cx, camera.cy],
        "joint_state": frame.joint_state.tolist(),
        "joint_visible_fraction": frame.joint_visible_fraction.tolist(),
        "angles": frame.angles.tolist(),
        "T_world_root": frame.T_world_root.tolist(),
        "T_world_camera": frame.T_world_camera.tolist(),
    }
    out["json"] = json.dumps(record).encode()
    return out
