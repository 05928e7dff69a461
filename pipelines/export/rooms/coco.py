"""COCO keypoints of whole scenes: an annotation a person, ignore regions for who is hardly seen."""

import numpy as np
from numpy.typing import NDArray

from pipelines.export.coco import (
    bounding_box,
    image_facts,
    keypoint_visibility,
    keypoints_of,
    make_folders,
    rounded,
    run_lengths,
    write_annotations,
    write_maps,
)
from pipelines.export.records import ExportJob
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
    make_folders(job, MAPS)
    images, annotations = [], []
    for index in job.indices:
        frame = job.scene(index)
        write_maps(job, frame, index, MAPS)
        images.append(_image_entry(frame, job.split))
        annotations += [entry for k in range(len(frame.people)) if (entry := person_entry(frame, k)) is not None]
        job.on_frame()
    write_annotations(job, images, annotations)


def _image_entry(frame: RoomFrame, split: str) -> dict:
    return image_facts(frame, split) | {"room_id": frame.info.room_id}


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
    keypoints = keypoints_of(frame.joints_2d(k), visibility)
    mask = alone if is_ignored else seen
    entry = {
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
    if frame.moment is not None:
        entry["track_id"] = frame.moment.clip * MAX_PEOPLE + record.number
    if view.motion is not None:
        entry["joints_world_m"] = [rounded(joint) for joint in view.motion.joints_world.tolist()]
        entry["velocities_m_s"] = [rounded(way) for way in view.motion.velocity.tolist()]
        entry["contacts"] = view.motion.contacts.tolist()
    return entry


def _in_image(frame: RoomFrame, window: tuple[slice, slice], crop: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """A crop's mask as one of the whole image."""
    mask = np.zeros(frame.depth.shape, np.bool_)
    mask[window] = crop
    return mask
