"""Recorded motions on other bodies: they go as far as their legs say, feet that are down stay, errors are clear."""

from dataclasses import replace

import numpy as np
import pytest

from storage.digested import is_of_format
from synth.bodies.mocap.bvh import parse_bvh
from synth.bodies.mocap.capture import runs, stretches_of
from synth.bodies.mocap.retarget import retarget
from synth.bodies.mocap.source import read_source
from synth.bodies.motion.captured import captured
from synth.bodies.motion.foot import foot_shapes
from synth.bodies.motion.library import FORMAT, MotionLibraryError, joined_motions, read_motions, write_motions
from synth.bodies.poses.landmarks import landmarks_of
from synth.bodies.poses.library import Trial
from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.rig.skinning import pose_vertices
from synth.bodies.shape.make import make_body
from synth.bodies.skeleton import DOF_IDX, LINK_IDX, LOWER, UPPER
from synth.bodies.spec import BodySpec
from tests.walking import WAY, walked, walking_text

RATE = 60.0
BODIES = (BodySpec(1.70, 68.0, 0.5, 35.0), BodySpec(1.92, 100.0, 0.0, 50.0), BodySpec(1.25, 27.0, 1.0, 8.0))


def stretch(scale=1.0):
    """The one motion of a recording, and the row where it begins."""
    source = read_source(parse_bvh(walking_text(scale)))
    is_usable = ~source.is_t_pose
    ((first, motion),) = stretches_of(source, retarget(source), is_usable, 30.0, "walk")
    return first, motion


@pytest.fixture(scope="module", params=BODIES, ids=["same", "tall", "child"])
def made(request):
    body = make_body(request.param)
    return body, captured(stretch()[1], body, RATE)


def soles(body, motion):
    """(n, 2, 2, 3) where heels and toes' hinges are, by side [m]."""
    out = np.empty((len(motion), 2, 2, 3))
    for k, (angles, T) in enumerate(zip(motion.angles, motion.T_world_root, strict=True)):
        links = link_transforms(body.skeleton, angles, T)
        for s, side in enumerate("lr"):
            shape = foot_shapes(body)[side]
            points = (
                (shape.heel, 0.0, -shape.ankle, 1.0),
                (shape.ball, 0.0, shape.ball_height - shape.ankle, 1.0),
            )
            out[k, s] = [(links[LINK_IDX[f"{side}_ankle_inversion"]] @ point)[:3] for point in np.array(points)]
    return out


def test_contacts_are_found_where_the_recorded_person_stood():
    first, motion = stretch()
    true = walked().contacts[:, :4].reshape(-1, 2, 2)[first - 1 :]
    either = true.any(axis=2)[: len(motion.contacts)]
    found = motion.contacts.any(axis=2)
    assert (found == either).mean() > 0.9


def test_what_is_down_does_not_slide(made):
    body, motion = made
    place = soles(body, motion)[..., :2]
    n_down = 0
    for s in range(2):
        for part in range(2):
            for first, last in runs(motion.contacts[:, 2 * s + part]):
                way = np.linalg.norm(np.diff(place[first:last, s, part], axis=0), axis=1).sum()
                assert way < 0.01
                n_down += last - first > 5
    assert n_down >= 8


def test_nobody_sinks_or_floats(made):
    body, motion = made
    low = [float(pose_vertices(body, motion.pose(k))[:, 2].min()) for k in range(0, len(motion), 6)]
    assert min(low) > -0.02
    assert max(low) < 0.03


def test_the_way_is_as_long_as_the_legs_are(made):
    body, motion = made
    way = np.hypot(*(motion.T_world_root[-1, :2, 3] - motion.T_world_root[0, :2, 3]))
    own = make_body(BODIES[0])
    expected = WAY * landmarks_of(body).leg / landmarks_of(own).leg
    assert way == pytest.approx(expected, rel=0.06)


def test_it_begins_at_the_origin_facing_x(made):
    _, motion = made
    assert np.hypot(*motion.T_world_root[0, :2, 3]) < 0.1
    assert abs(np.arctan2(motion.T_world_root[0, 1, 0], motion.T_world_root[0, 0, 0])) < 0.05


def test_angles_stay_within_limits_and_move_smoothly(made):
    _, motion = made
    assert ((motion.angles >= LOWER) & (motion.angles <= UPPER)).all()
    assert np.abs(np.diff(motion.angles, axis=0)).max() < 0.35


def test_the_recorded_angles_are_found_again_on_the_body_that_was_recorded():
    first, motion = stretch()
    back = captured(motion, make_body(BODIES[0]), 30.0)
    true = walked().angles[first - 1 :][: len(back)]
    names = ["l_knee_flexion", "r_hip_flexion", "l_shoulder_flexion", "r_elbow_flexion"]
    dofs = [DOF_IDX[name] for name in names]
    off = np.degrees(np.abs(back.angles[:, dofs] - true[: len(back), dofs]))
    assert np.median(off) < 4.0
    assert np.percentile(off, 95) < 16.0


def test_the_size_of_the_recorded_person_does_not_matter():
    body = make_body(BODIES[0])
    small, large = (captured(stretch(scale)[1], body, RATE) for scale in (0.8, 1.1))
    gap = np.linalg.norm(small.T_world_root[:, :3, 3] - large.T_world_root[:, :3, 3], axis=1)
    assert np.median(gap) < 0.03


def test_a_part_is_the_same_frames():
    _, motion = stretch()
    part = motion.part(10, 20)
    assert part.seconds == pytest.approx(19 / motion.fps)
    assert np.array_equal(part.angles, motion.angles[10:30])


def library():
    _, motion = stretch()
    trials = [Trial(f"0{k}_01", f"0{k}", split, f"0{k}_01.bvh") for k, split in enumerate(("train", "test"))]
    return joined_motions(
        "mocap", [(trials[0], [motion, motion.part(5, 50)], [1, 6]), (trials[1], [], [])], {"seed": 0}
    )


def test_a_library_is_read_as_it_was_written(tmp_path):
    made = library()
    write_motions(tmp_path / "a.lib", made)
    read = read_motions(tmp_path / "a.lib")
    assert read.digest == made.digest
    assert len(read) == 2
    assert read[1].motion_id == "mocap/train/00_01/0006"
    assert np.array_equal(read[1].angles, made[0].angles[5:55])
    assert read.of_split("train").tolist() == [0, 1]
    assert read.of_split("train", read.seconds[1] + 0.1).tolist() == [0]
    assert read.of_split("test").tolist() == []
    assert is_of_format(tmp_path / "a.lib", FORMAT)
    assert not is_of_format(tmp_path / "b.lib", FORMAT)
    with pytest.raises(IndexError, match="motion 2"):
        read[2]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda lib: {"angles": lib.angles + 9.0}, "joint limits"),
        (lambda lib: {"hips": lib.hips * np.float32(np.nan)}, "not finite"),
        (lambda lib: {"motion": lib.motion[::-1].copy()}, "not in order"),
        (lambda lib: {"contacts": lib.contacts[:3]}, "contacts"),
        (lambda lib: {"trials": (replace(lib.trials[0], split="all"), lib.trials[1])}, "split 'all'"),
    ],
)
def test_a_library_that_cannot_be_is_refused(change, sentence):
    with pytest.raises(MotionLibraryError, match=sentence):
        replace(library(), **change(library()))
