"""The truth of a corpus' frames as scoring needs it."""

import math

import numpy as np
from numpy.typing import NDArray

from pipelines.corpus import Corpus
from pipelines.corpus.rooms.views import PeopleFrames
from pipelines.corpus.sequence import CorpusFrames
from pipelines.metrics.results import Truths
from synth.render.labels import JOINT_RADIUS
from synth.vocabulary import JOINT_NAMES, MAX_PEOPLE, OCCLUDER_CLASSES, OCCLUDER_CODE, JointState

_NECK, _HIPS = JOINT_NAMES.index("neck"), [JOINT_NAMES.index("r_hip"), JOINT_NAMES.index("l_hip")]
_CHUNK = 64


def truths_of_frames(frames: CorpusFrames | PeopleFrames) -> Truths:
    """Reads what is true in frames of a corpus of either kind."""
    if isinstance(frames, PeopleFrames):
        return _truths_of_people(frames)
    return read_truths(frames.corpus, frames.indices)


def _truths_of_people(frames: PeopleFrames) -> Truths:
    """A row a person. Who is hidden by another person counts as occluded; classes of what hides are not told."""
    corpus, (numbers, k) = frames.corpus, frames.people.T
    records = [corpus.scene_record(int(number)) for number in numbers]
    people = [record.people[i] for record, i in zip(records, k.tolist(), strict=True)]
    families = tuple(sorted({person.activity for person in people}))
    row = np.arange(len(numbers))
    xyz, state = corpus.arrays("joints", numbers)[row, k], corpus.arrays("joint_state", numbers)[row, k]
    intrinsics = corpus.arrays("intrinsics", numbers)
    seen = [{item.class_name for item in record.objects if item.visible_fraction > 0} for record in records]
    classes = [sum(1 << OCCLUDER_CODE[name] for name in names if name in OCCLUDER_CODE) for names in seen]
    return Truths(
        joints=JOINT_NAMES,
        occluders=OCCLUDER_CLASSES,
        families=families,
        frame=numbers * MAX_PEOPLE + k,
        intrinsics=intrinsics,
        upper_body_px=upper_body_px(xyz, intrinsics),
        visible_fraction=np.array([person.visible_fraction for person in people], np.float32),
        family=np.array([families.index(person.activity) for person in people], np.uint8),
        object_classes=np.array(classes, np.uint16),
        xyz=xyz,
        state=np.where(state == JointState.OCCLUDED_BY_PERSON, JointState.OCCLUDED, state).astype(np.uint8),
        hiding_class=np.zeros(state.shape, np.uint8),
    )


def read_truths(corpus: Corpus, indices: NDArray[np.int64]) -> Truths:
    """Reads what is true in some frames.

    Args:
        corpus: An open corpus.
        indices: (n,) frame numbers.

    Raises:
        CorpusError: A frame is not there or damaged.
    """
    infos = [corpus.info(int(i)) for i in indices]
    families = tuple(sorted({info.scene_family for info in infos}))
    xyz = corpus.arrays("joints", indices)
    state = corpus.arrays("joint_state", indices)
    intrinsics = corpus.arrays("intrinsics", indices)
    seen = [{item.class_name for item in info.objects if item.visible_fraction > 0} for info in infos]
    return Truths(
        joints=JOINT_NAMES,
        occluders=OCCLUDER_CLASSES,
        families=families,
        frame=np.asarray(indices, np.int64),
        intrinsics=intrinsics,
        upper_body_px=upper_body_px(xyz, intrinsics),
        visible_fraction=np.array([info.visible_fraction for info in infos], np.float32),
        family=np.array([families.index(info.scene_family) for info in infos], np.uint8),
        object_classes=np.array([sum(1 << OCCLUDER_CODE[name] for name in names) for names in seen], np.uint16),
        xyz=xyz,
        state=state,
        hiding_class=_hiding_classes(corpus, indices, xyz, state, intrinsics),
    )


def upper_body_px(xyz: NDArray[np.float32], intrinsics: NDArray[np.float64]) -> NDArray[np.float32]:
    """Size of the upper body in the image: its length in space, as it would look seen from the front.

    The length from the neck to the middle of the hips, times fx, over the mean depth of the two ends: unlike the
    distance of their pixels it does not shrink as the person bends towards the camera.

    Args:
        xyz: (n, 15, 3) float32, camera frame [m].
        intrinsics: (n, 4) float64 [px].

    Returns:
        (n,) float32 [px]; NaN where the upper body is not before the camera.
    """
    neck, hips = xyz[:, _NECK].astype(np.float64), xyz[:, _HIPS].astype(np.float64).mean(axis=1)
    depth = (neck[:, 2] + hips[:, 2]) / 2.0
    length = np.linalg.norm(neck - hips, axis=1)
    is_before = depth > 0
    size = np.where(is_before, intrinsics[:, 0] * length / np.where(is_before, depth, 1.0), np.nan)
    return size.astype(np.float32)


def _hiding_classes(
    corpus: Corpus,
    indices: NDArray[np.int64],
    xyz: NDArray[np.float32],
    state: NDArray[np.uint8],
    intrinsics: NDArray[np.float64],
) -> NDArray[np.uint8]:
    hiding = np.zeros(state.shape, np.uint8)
    for first in range(0, len(indices), _CHUNK):
        images = corpus.arrays("occluder", indices[first : first + _CHUNK])
        for place, image in enumerate(images, first):
            for joint in np.flatnonzero(state[place] == JointState.OCCLUDED):
                hiding[place, joint] = _class_before(
                    image, xyz[place, joint], JOINT_RADIUS[joint], intrinsics[place]
                )
    return hiding


def _class_before(
    occluder: NDArray[np.uint8], xyz: NDArray[np.float32], radius: float, intrinsics: NDArray[np.float64]
) -> int:
    """The class at the joint's pixel, or, if none is there, the commonest in the square around the joint."""
    fx, fy, cx, cy = (float(value) for value in intrinsics)
    x, y, z = (float(value) for value in xyz)
    if z <= 0:
        return 0
    u, v = round(fx * x / z + cx), round(fy * y / z + cy)
    is_inside = 0 <= v < occluder.shape[0] and 0 <= u < occluder.shape[1]
    if is_inside and occluder[v, u]:
        return int(occluder[v, u])
    reach = max(1, math.ceil(fx * radius / z))
    around = occluder[max(0, v - reach) : max(0, v + reach + 1), max(0, u - reach) : max(0, u + reach + 1)]
    counts = np.bincount(around[around > 0].ravel(), minlength=1)
    return int(counts.argmax())
