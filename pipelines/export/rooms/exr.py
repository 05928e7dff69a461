"""OpenEXR of whole scenes: ids of people and objects, and every person alone in channels of their own."""

import numpy as np
from numpy.typing import NDArray

from pipelines.export.exr import words, write_exr
from pipelines.export.records import ExportJob
from synth.frame import RoomFrame


def export_room_exr(job: ExportJob) -> None:
    """Writes SPLIT/NUMBER.exr."""
    labels = job.corpus.header.labels

    def told(index: int) -> tuple[dict[str, NDArray], dict[str, object], dict[str, list[str]]]:
        frame = job.scene(index)
        names = {"part.id": labels["parts"], "occluder.id": labels["occluders"]}
        names |= {f"body{k}.part.id": labels["parts"] for k in range(1, len(frame.people) + 1)}
        names["instance.id"] = ["none", *(item.spec_id for item in frame.info.objects)]
        names["person.id"] = ["none", *(item.subject_id for item in frame.info.people)]
        return room_channels(frame), _attributes(frame), names

    write_exr(job, told)


def room_channels(frame: RoomFrame) -> dict[str, NDArray]:
    """The scene's maps by channel name: float32 metres and uint32 codes."""
    depths, codes = {"Z": frame.depth}, {}
    for name in ("part", "person", "occluder", "instance"):
        codes[f"{name}.id"] = getattr(frame, name)
    for k, view in enumerate(frame.people, start=1):
        depths[f"body{k}.Z"] = np.zeros(frame.depth.shape, np.uint16)
        codes[f"body{k}.part.id"] = np.zeros(frame.depth.shape, np.uint8)
        depths[f"body{k}.Z"][view.window] = view.body_depth
        codes[f"body{k}.part.id"][view.window] = view.body_part
    out: dict[str, NDArray] = {
        name: np.ascontiguousarray(mm * np.float32(0.001), dtype=np.float32) for name, mm in depths.items()
    }
    return out | {name: np.ascontiguousarray(code, dtype=np.uint32) for name, code in codes.items()}


def _attributes(frame: RoomFrame) -> dict[str, object]:
    camera = frame.camera
    values = {
        "frame": str(frame.info.index),
        "room": frame.info.room_id,
        "intrinsics": words([camera.fx, camera.fy, camera.cx, camera.cy]),
        "T_world_camera": words(frame.T_world_camera),
        "depth": "along the optical axis, metres, 0 = nothing",
    }
    for k, (view, record) in enumerate(zip(frame.people, frame.info.people, strict=True), start=1):
        values |= {
            f"subject{k}": record.subject_id,
            f"joints{k}": words(view.joints),
            f"joint_state{k}": words(view.joint_state),
        }
    return {f"undergrowth:{name}": value for name, value in values.items()}
