"""What the frames of one scene must have in common: who is there, and where their joints are in the world."""

from collections.abc import Iterator

import numpy as np

from pipelines.corpus.read import Corpus
from pipelines.corpus.rooms.clips import Clip, clips_of
from synth.frame import RoomInfo
from synth.geometry import transform_points

AGREE = 1e-4
"""Joints of all views agree in the world to this [m]."""
FASTEST = 40.0
"""Nothing of a person is faster [m/s]: a thrown ball leaves the hand with that."""


def scene_faults(corpus: Corpus) -> Iterator[str]:
    """Everything that does not belong together in the clips of a corpus, one sentence each."""
    if "clip" not in corpus.header.fields:
        return
    for clip in clips_of(corpus):
        where = f"{'clip' if corpus.header.clip_steps else 'scene'} {clip.number} of {clip.split}"
        yield from (f"{where}: {sentence}" for sentence in _order(clip))
        yield from (f"{where}: {sentence}" for sentence in _identities(clip))
        yield from (f"{where}: {sentence}" for sentence in _joints(clip))


def _order(clip: Clip) -> Iterator[str]:
    for view in range(clip.n_views):
        is_wrong = (clip.array("time", view) != np.arange(clip.n_steps)) | (clip.array("view", view) != view)
        if is_wrong.any():
            yield f"frame {clip.numbers[int(np.argmax(is_wrong)), view]} is out of the order of time and camera"


def _identities(clip: Clip) -> Iterator[str]:
    first = _people(clip, int(clip.numbers[0, 0]))
    for number in clip.numbers.ravel().tolist():
        if _people(clip, number) != first:
            yield f"frame {number} shows other people than frame {clip.numbers[0, 0]}"
            return


def _people(clip: Clip, number: int) -> list[str]:
    info = clip.corpus.record(number)
    return [one.subject_id for one in info.people] if isinstance(info, RoomInfo) else [info.subject_id]


def _joints(clip: Clip) -> Iterator[str]:
    """Whether all cameras, and the joints in the world where they are stored, say the same."""
    has_motion = "joints_world" in clip.corpus.header.fields
    expected = clip.array("joints_world") if has_motion else _world_joints(clip, 0)
    if has_motion:
        yield from _motions(clip)
    for view in range(clip.n_views):
        gap = np.linalg.norm(_world_joints(clip, view) - expected, axis=-1)
        if not np.array_equal(np.isfinite(gap), np.isfinite(expected[..., 0])):
            yield f"camera {view} knows other joints than the world"
        elif np.nanmax(gap, initial=0.0) > AGREE:
            step = int(np.argmax(np.nanmax(gap.reshape(clip.n_steps, -1), axis=1)))
            yield (
                f"joints seen by camera {view} in frame {clip.numbers[step, view]} are "
                f"{1000 * np.nanmax(gap):.2f} mm off where they are in the world"
            )


def _motions(clip: Clip) -> Iterator[str]:
    """Whether what is said of how people move is possible, and the same for all cameras."""
    for view in range(clip.n_views):
        speed = np.linalg.norm(clip.array("joint_velocity", view), axis=-1)
        if not (speed <= FASTEST).all():
            yield f"a joint moves with {float(speed.max()):.0f} m/s"
        if (clip.array("contacts", view) > 1).any():
            yield "a contact is neither 0 nor 1"
        for name in ("joints_world", "joint_velocity", "contacts"):
            if view and clip.array(name, view).tobytes() != clip.array(name).tobytes():
                yield f"{name} of camera {view} differs from that of camera 0"


def _world_joints(clip: Clip, view: int) -> np.ndarray:
    """(n_steps, ..., 15, 3) joints as a camera has them, world frame [m]."""
    joints = clip.array("joints", view).astype(np.float64)
    poses = clip.array("T_world_camera", view)
    return np.stack([transform_points(T, points) for T, points in zip(poses, joints, strict=True)])
