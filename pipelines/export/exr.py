"""OpenEXR: one multi-channel file a frame, label names in its ID manifest.

Only contiguous float32 and uint32 arrays are handed to the binding: it writes others wrong without an error.
"""

import errno
import os
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pipelines.errors import UserError
from pipelines.export.records import ExportJob
from synth.frame import Frame

ID_CHANNELS = {"part.id": "parts", "body.part.id": "parts", "occluder.id": "occluders"}
"""Channels of codes and the label table that names them; instance.id counts the objects of one frame."""


Told = tuple[dict[str, NDArray], dict[str, object], dict[str, list[str]]]
"""What a file holds: its channels, the project's own attributes, and names by code for the channels of codes."""


def export_exr(job: ExportJob) -> None:
    """Writes SPLIT/NUMBER.exr."""
    labels = job.corpus.header.labels

    def told(index: int) -> Told:
        frame = job.frame(index)
        names = {channel: labels[table] for channel, table in ID_CHANNELS.items()}
        names["instance.id"] = ["none", *(item.spec_id for item in frame.info.objects)]
        return channels(frame), _attributes(frame), names

    write_exr(job, told)


def write_exr(job: ExportJob, told: Callable[[int], Told]) -> None:
    """Writes SPLIT/NUMBER.exr.

    Args:
        job: What to export.
        told: What a frame's file holds, by the frame's number.

    Raises:
        UserError: The folder's name is one that the binding cannot write.
        OSError: A file cannot be written.
    """
    import OpenEXR

    folder = job.folder / job.split
    try:
        str(folder).encode()
    except UnicodeEncodeError:
        raise UserError(f"OpenEXR cannot write into {folder}: the name is not UTF-8") from None
    folder.mkdir()
    for index in job.indices:
        images, own, names = told(int(index))
        attributes = {
            "compression": OpenEXR.ZIP_COMPRESSION,
            "type": OpenEXR.scanlineimage,
            "idManifest": id_manifest(OpenEXR, names),
            **own,
        }
        path = folder / f"{index:07d}.exr"
        try:
            with OpenEXR.File(attributes, images) as file:
                file.write(str(path))
        except RuntimeError as error:  # of the binding, which knows no OSError
            code = errno.ENOSPC if os.strerror(errno.ENOSPC) in str(error) else errno.EIO
            raise OSError(code, os.strerror(code), str(path)) from error
        job.on_frame()


def channels(frame: Frame) -> dict[str, NDArray]:
    """The frame's maps by channel name: float32 metres and uint32 codes."""
    depths = {"Z": frame.depth, "body.Z": frame.body_depth}
    codes = {
        "part.id": frame.part,
        "body.part.id": frame.body_part,
        "occluder.id": frame.occluder,
        "instance.id": frame.instance,
    }
    out: dict[str, NDArray] = {
        name: np.ascontiguousarray(mm * np.float32(0.001), dtype=np.float32) for name, mm in depths.items()
    }
    return out | {name: np.ascontiguousarray(code, dtype=np.uint32) for name, code in codes.items()}


def _attributes(frame: Frame) -> dict[str, object]:
    """Header attributes of the project's own, numbers as text separated by spaces."""
    camera = frame.camera
    values = {
        "frame": str(frame.info.index),
        "subject": frame.info.subject_id,
        "intrinsics": words([camera.fx, camera.fy, camera.cx, camera.cy]),
        "joints": words(frame.joints),
        "joint_state": words(frame.joint_state),
        "T_world_camera": words(frame.T_world_camera),
        "depth": "along the optical axis, metres, 0 = nothing",
    }
    return {f"undergrowth:{name}": value for name, value in values.items()}


def words(values: object) -> str:
    """Numbers as text, row by row, separated by spaces."""
    return " ".join(repr(value) for value in np.asarray(values).ravel().tolist())


def id_manifest(exr, names: dict[str, list[str]]):  # type: ignore[no-untyped-def] # the binding has no types
    """The standard attribute that names codes.

    Args:
        exr: The binding.
        names: Names in order of code by channel; those of instances and people hold for one frame.
    """
    manifest = exr.IDManifest()
    for channel, listed in names.items():
        group = exr.ChannelGroupManifest()
        group.setChannel(channel)
        group.setComponent("name")
        is_stable = channel not in ("instance.id", "person.id")
        group.setLifetime(exr.LIFETIME_STABLE if is_stable else exr.LIFETIME_FRAME)
        group.setHashScheme(exr.ID_MANIFEST_NOTHASHED)
        group.setEncodingScheme(exr.ID_MANIFEST_ID_SCHEME)
        for code, name in enumerate(listed):
            group.insert(code, name)
        manifest.add(group)
    return manifest
