"""COCO keypoints of whole scenes: an annotation a person, ignore regions for who is hardly seen."""

import json

import numpy as np
from numpy.typing import NDArray

from pipelines.export.coco import bounding_box, category_entry, keypoint_visibility, rounded, run_lengths
from pipelines.export.records import ExportJob, png_bytes
from synth.frame import RoomFrame
from synth.vocabulary import MAX_PEOPLE

MAPS = ("depth", "part", "person", "occluder", "instance")
"""Maps written as PNG: depth 16 bit millimetres, codes 8 bit."""
IGNORED_BELOW = 0.1
"""Who is visible to a smaller share of their body than this is an ignore region ..."""
IGNORED_PIXELS = 100
"""... and so is who shows fewer pixels than this."""


def export_room_coco(job: ExportJob) -> None:
    """Writes MAP/SPLIT/NUMBER.png and annotations/SPLIT.json."""
    for name in MAPS:
        (job.folder / name / job.split).mkdir(parents=True)
    images, annotations = [], []
    for index in job.indices:
        frame = job.scene(index)
        for name in MAPS:
            path = job.folder / name / job.split / f"{index:07d}.png"
            path.write_bytes(png_bytes(getattr(frame, name)))
        images.append(_image_entry(frame, job.split))
        annotations += [entry for k in range(len(frame.people)) if (entry := person_entry(frame, k)) is not None]
        job.on_frame()
    document = {
        "info": {
            "description": f"undergrowth corpus, seed {job.corpus.header.seed}, split {job.split}",
            "version": job.corpus.digest,
        },
        "licenses": [],
        "categories": [category_entry()],
        "images": images,
        "annotations": annotations,
    }
    path = job.folder / "annotations" / f"{job.split}.json"
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps(document), encoding="utf-8")


def _image_entry(frame: RoomFrame, split: str) -> dict:
    camera = frame.camera
    return {
        "id": frame.info.index,
        "file_name": f"depth/{split}/{frame.info.index:07d}.png",
        "width": camera.width,
        "height": camera.height,
        "intrinsics": [camera.fx, camera.fy, camera.cx, camera.cy],
        "depth_unit_m": 0.001,
        "room_id": frame.info.room_id,
    }


def person_entry(frame: RoomFrame, k: int) -> dict | None:
    """A person: box, area and mask of the seen pixels, 15 keypoints; None if the image would show nothing of them.

    Someone of whom hardly anything is seen has iscrowd 1, which COCO's evaluation ignores, and the mask and box of
    the whole body, so that whatever is found there counts neither as right nor as wrong.

    Args:
        frame: The scene.
        k: The person's index, from 0.
    """
    view, record = frame.people[k], frame.info.people[k]
    if view.box[2] == 0:
        return None
    alone = _in_image(frame, view.window, view.body_part > 0)
    seen = frame.person == k + 1
    is_ignored = record.visible_fraction < IGNORED_BELOW or np.count_nonzero(seen) < IGNORED_PIXELS
    visibility = keypoint_visibility(view.joint_state)
    keypoints: list[float] = []
    for (u, v), shown in zip(frame.joints_2d(k).tolist(), visibility.tolist(), strict=True):
        keypoints += [round(u, 3), round(v, 3), shown] if shown else [0, 0, 0]
    mask = alone if is_ignored else seen
    return {
        "id": frame.info.index * MAX_PEOPLE + k + 1,
        "image_id": frame.info.index,
        "category_id": 1,
        "iscrowd": int(is_ignored),
        "area": int(mask.sum()),
        "bbox": bounding_box(mask),
        "segmentation": run_lengths(mask),
        "amodal_bbox": bounding_box(alone),
        "amodal_segmentation": run_lengths(alone),
        "num_keypoints": int((visibility > 0).sum()),
        "keypoints": keypoints,
        "joints_camera_m": [rounded(joint) for joint in view.joints.tolist()],
        "joint_state": view.joint_state.tolist(),
        "person": record.number,
        "subject_id": record.subject_id,
        "group": record.group,
        "visible_fraction": round(record.visible_fraction, 6),
    }


def _in_image(frame: RoomFrame, window: tuple[slice, slice], crop: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """A crop's mask as one of the whole image."""
    mask = np.zeros(frame.depth.shape, np.bool_)
    mask[window] = crop
    return mask
