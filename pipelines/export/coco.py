"""COCO keypoints: 16-bit depth PNGs, label PNGs, and one annotation file a split."""

import json
import math

import numpy as np
from numpy.typing import NDArray

from pipelines.export.records import ExportJob, png_bytes
from synth.frame import Frame, RoomFrame
from synth.scene.clips.config import MAX_CAMERAS
from synth.vocabulary import BONES, JOINT_NAMES, JointState

MAPS = ("depth", "part", "occluder", "instance", "body_depth", "body_part")
"""Maps written as PNG: depths 16 bit millimetres, codes 8 bit."""
_V_NOT_IN_IMAGE, _V_HIDDEN, _V_VISIBLE = 0, 1, 2


def export_coco(job: ExportJob) -> None:
    """Writes MAP/SPLIT/NUMBER.png and annotations/SPLIT.json."""
    make_folders(job, MAPS)
    has_labels = job.corpus.header.config.get("import", {}).get("parts") != "none"
    images, annotations = [], []
    for index in job.indices:
        frame = job.frame(index)
        write_maps(job, frame, index, MAPS)
        images.append(image_entry(frame, job.split))
        if (entry := annotation_entry(frame, has_labels)) is not None:
            annotations.append(entry)
        job.on_frame()
    write_annotations(job, images, annotations)


def make_folders(job: ExportJob, names: tuple[str, ...]) -> None:
    """Makes the folders MAP/SPLIT."""
    for name in names:
        (job.folder / name / job.split).mkdir(parents=True)


def write_maps(job: ExportJob, frame: Frame | RoomFrame, index: int, names: tuple[str, ...]) -> None:
    """Writes MAP/SPLIT/NUMBER.png of one frame."""
    for name in names:
        path = job.folder / name / job.split / f"{index:07d}.png"
        path.write_bytes(png_bytes(getattr(frame, name)))


def write_annotations(job: ExportJob, images: list[dict], annotations: list[dict]) -> None:
    """Writes annotations/SPLIT.json."""
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


def category_entry() -> dict:
    """The person category; skeleton pairs count from 1, as COCO does."""
    return {
        "id": 1,
        "name": "person",
        "supercategory": "person",
        "keypoints": list(JOINT_NAMES),
        "skeleton": [[a + 1, b + 1] for a, b in BONES],
    }


def image_entry(frame: Frame, split: str) -> dict:
    """One image of one person."""
    return image_facts(frame, split) | {
        "scene_family": frame.info.scene_family,
        "subject_id": frame.info.subject_id,
    }


def image_facts(frame: Frame | RoomFrame, split: str) -> dict:
    """What is told of every image; file_name is that of its depth map."""
    camera = frame.camera
    facts = {
        "id": frame.info.index,
        "file_name": f"depth/{split}/{frame.info.index:07d}.png",
        "width": camera.width,
        "height": camera.height,
        "intrinsics": [camera.fx, camera.fy, camera.cx, camera.cy],
        "depth_unit_m": 0.001,
    }
    if (moment := frame.moment) is None:
        return facts
    return facts | {
        "video_id": moment.clip * MAX_CAMERAS + moment.view,
        "frame_id": moment.time,
        "clip": moment.clip,
        "view": moment.view,
        "T_world_camera": frame.T_world_camera.tolist(),
    }


def annotation_entry(frame: Frame, has_labels: bool = True) -> dict | None:
    """The person: box, area and mask of the seen pixels, 15 keypoints; None if there is none.

    Args:
        frame: The frame.
        has_labels: Pixels are labelled; those of recordings without joints are not, and all their depth is the person.
    """
    seen, alone = (frame.part > 0, frame.body_part > 0) if has_labels else (frame.depth > 0, frame.depth > 0)
    if not alone.any():
        return None
    visibility = keypoint_visibility(frame.joint_state)
    keypoints = keypoints_of(frame.joints_2d, visibility)
    return {
        "id": frame.info.index + 1,
        "image_id": frame.info.index,
        "category_id": 1,
        "iscrowd": 0,
        "area": int(seen.sum()),
        "bbox": bounding_box(seen if seen.any() else alone),
        "segmentation": run_lengths(seen),
        "amodal_bbox": bounding_box(alone),
        "amodal_segmentation": run_lengths(alone),
        "num_keypoints": int((visibility > 0).sum()),
        "keypoints": keypoints,
        "joints_camera_m": [rounded(joint) for joint in frame.joints.tolist()],
        "joint_state": frame.joint_state.tolist(),
    }


def keypoints_of(joints_2d: NDArray[np.float64], visibility: NDArray[np.int64]) -> list[float]:
    """Places (15, 2) [px] and visibilities (15,) one after the other; zeros of what is not in the image."""
    keypoints: list[float] = []
    for (u, v), shown in zip(joints_2d.tolist(), visibility.tolist(), strict=True):
        keypoints += [round(u, 3), round(v, 3), shown] if shown else [0, 0, 0]
    return keypoints


def rounded(joint: list[float]) -> list[float] | None:
    """A joint's place to the micrometre; None if it is unknown, for which JSON has no number."""
    return None if any(map(math.isnan, joint)) else [round(x, 6) for x in joint]


def keypoint_visibility(joint_state: NDArray[np.uint8]) -> NDArray[np.int64]:
    """COCO's v of each joint: 2 visible, 1 in the image but hidden, 0 not in the image or unknown."""
    v = np.full(joint_state.shape, _V_HIDDEN)
    v[joint_state == JointState.VISIBLE] = _V_VISIBLE
    v[(joint_state == JointState.OUTSIDE) | (joint_state == JointState.UNKNOWN)] = _V_NOT_IN_IMAGE
    return v


def bounding_box(mask: NDArray[np.bool_]) -> list[int]:
    """[left, top, width, height] in pixels; zeros for an empty mask."""
    if not mask.any():
        return [0, 0, 0, 0]
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    left, top = int(columns[0]), int(rows[0])
    return [left, top, int(columns[-1]) - left + 1, int(rows[-1]) - top + 1]


def run_lengths(mask: NDArray[np.bool_]) -> dict:
    """COCO's uncompressed run-length code: counts of 0s and 1s in turn, down the columns, 0s first."""
    flat = mask.ravel(order="F")
    changes = np.flatnonzero(np.diff(flat)) + 1
    starts = np.concatenate([[0], changes, [flat.size]])
    counts = np.diff(starts).tolist()
    return {"size": list(mask.shape), "counts": [0, *counts] if flat[0] else counts}
