"""WebDataset of whole scenes: maps, a crop of the body layer for each person, joints of all, and the record."""

import io
import json

import numpy as np

from pipelines.corpus.frameinfo import info_line
from pipelines.export.records import ExportJob, png_bytes
from pipelines.export.tar_shards import write_tars
from synth.frame import PersonView, RoomFrame
from synth.vocabulary import N_JOINTS

MAPS = ("depth", "part", "person", "occluder", "instance")


def export_room_webdataset(job: ExportJob) -> None:
    """Writes SPLIT-NUMBER.tar; the same corpus gives the same bytes."""
    write_tars(job, lambda index: room_members(job.scene(index)))


def _motion(view: PersonView) -> dict[str, object]:
    """How a person of a clip moves; nothing of single moments."""
    if view.motion is None:
        return {}
    return {
        "joints_world": view.motion.joints_world.tolist(),
        "joint_velocity": view.motion.velocity.tolist(),
        "contacts": view.motion.contacts.tolist(),
    }


def room_members(frame: RoomFrame) -> dict[str, bytes]:
    """A sample's files by extension: PNG maps and crops, joints of all people as NPY, the rest as JSON."""
    out = {f"{name}.png": png_bytes(getattr(frame, name)) for name in MAPS}
    people = []
    for k, view in enumerate(frame.people, start=1):
        if view.box[2]:
            out[f"body{k}_depth.png"] = png_bytes(view.body_depth)
            out[f"body{k}_part.png"] = png_bytes(view.body_part)
        people.append(
            {
                "box": list(view.box),
                "joint_state": view.joint_state.tolist(),
                "joint_visible_fraction": view.joint_visible_fraction.tolist(),
                "angles": view.angles.tolist(),
                "T_world_root": view.T_world_root.tolist(),
            }
            | _motion(view)
        )
    buffer = io.BytesIO()
    joints = [view.joints for view in frame.people]
    np.save(buffer, np.array(joints, dtype=np.float32).reshape(-1, N_JOINTS, 3))
    out["joints.npy"] = buffer.getvalue()
    camera = frame.camera
    record = json.loads(info_line(frame)) | {
        "intrinsics": [camera.fx, camera.fy, camera.cx, camera.cy],
        "T_world_camera": frame.T_world_camera.tolist(),
        "views": people,
    }
    if (moment := frame.moment) is not None:
        record |= {"clip": moment.clip, "time": moment.time, "view": moment.view}
    out["json"] = json.dumps(record).encode()
    return out
