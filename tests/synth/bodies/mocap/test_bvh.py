"""BVH files are read as they are meant, and refused with what is wrong."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from synth.bodies.mocap.bvh import MocapError, parse_bvh, place_joints, rest_values
from synth.bodies.mocap.roles import Convention, joints_of
from tests.mocap_files import STAND, bvh_text, standing_root

TINY = """HIERARCHY
ROOT a
{
 OFFSET 1 2 3
 CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
 JOINT b
 {
  OFFSET 0 1 0
  CHANNELS 3 Xrotation Yrotation Zrotation
  End Site
  {
   OFFSET 2 0 0
  }
 }
}
MOTION
Frames: 2
Frame Time: 0.04
0 0 0 0 0 0 0 0 0
5 6 7 10 20 30 40 50 60
"""


def test_joints_stand_where_their_channels_in_the_order_of_the_file_put_them():
    bvh = parse_bvh(TINY)
    assert [joint.name for joint in bvh.joints] == ["a", "b", "b_end"]
    assert bvh.frame_time == 0.04
    position, rotation = place_joints(bvh, bvh.values)
    a = Rotation.from_euler("ZYX", [10, 20, 30], degrees=True)
    b = a * Rotation.from_euler("XYZ", [40, 50, 60], degrees=True)
    assert np.allclose(rotation[1], [a.as_matrix(), b.as_matrix(), b.as_matrix()])
    there = np.array([5.0, 6.0, 7.0])
    assert np.allclose(
        position[1], [there, there + a.apply([0, 1, 0]), there + a.apply([0, 1, 0]) + b.apply([2, 0, 0])]
    )


def test_the_rest_pose_has_every_joint_at_its_offset():
    bvh = parse_bvh(TINY)
    position, _ = place_joints(bvh, rest_values(bvh))
    assert np.allclose(position[0], [[1, 2, 3], [1, 3, 3], [3, 3, 3]])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("HIERARCHY", "HIERARCHIE", "is not a BVH file"),
        ("MOTION", "", "is not a BVH file"),
        ("Frames: 2", "Frames: 0", "has 0 frames"),
        ("Frames: 2", "Fames: 2", "'Frames:' is expected"),
        ("Frame Time: 0.04", "Frame Time: -1", r"of -1\.0 s"),
        ("5 6 7 10", "5 6 7", "frame 1 has 8 values; the channels of the hierarchy are 9"),
        ("5 6 7 10", "5 6 7 x", "frame 1 holds a value that is not a number"),
        ("OFFSET 2 0 0", "OFFSET 2 0", "'}' where a number is expected"),
        ("OFFSET 0 1 0", "OFFSET 0 inf 0", "'inf' where a finite number"),
        ("Zrotation Yrotation", "Wrotation Yrotation", r"unknown channels \['Wrotation'\]; known are Xposition"),
        ("JOINT b", "JOINT a", "several joints the same name: a"),
        ("JOINT b", "BONE b", "'BONE' where ROOT, JOINT"),
        ("}\nMOTION", "MOTION", "without an end"),
        ("MOTION", "ROOT c\n{\n}\nMOTION", "a second root 'c'"),
    ],
)
def test_what_is_wrong_is_named(old, new, message):
    assert TINY.count(old) >= 1
    with pytest.raises(MocapError, match=message):
        parse_bvh(TINY.replace(old, new, 1))


@pytest.mark.parametrize("word", ["nan", "NaN", "-nan(ind)", "1.#QNAN", "-1.#IND00", "inf", "-Infinity"])
def test_frames_with_nan_or_infinity_are_left_out_and_counted(word):
    bvh = parse_bvh(TINY.replace("Frames: 2", "Frames: 3").replace("0 0 0 0 0", f"0 {word} 0 0 0", 1) + "1 " * 9)
    assert bvh.values[:, 0].tolist() == [5.0, 1.0]
    assert bvh.frame.tolist() == [1, 2]
    assert (bvh.n_broken, bvh.n_promised) == (1, 3)


def test_a_file_with_nan_in_every_frame_is_refused():
    with pytest.raises(MocapError, match="has no frame without NaN or infinity"):
        parse_bvh(TINY.replace("5 6 7", "nan 6 7").replace("0 0 0 0 0", "0 0 inf 0 0", 1))


@pytest.mark.parametrize("text", ["", "MOTION", "HIERARCHY MOTION", "HIERARCHY\nROOT a\n{\nMOTION\n"])
def test_scraps_are_no_bvh(text):
    with pytest.raises(MocapError):
        parse_bvh(text)


def test_missing_joints_are_listed_with_those_that_are_there():
    text = bvh_text([(STAND, standing_root(STAND))]).replace("LeftFoot", "Pied")
    with pytest.raises(
        MocapError, match=r"lacks joints of the 'motion_builder' naming: LeftFoot \(l_ankle\); it has Hips"
    ):
        joints_of(parse_bvh(text))


def test_a_mapping_with_a_wrong_role_lists_the_known_ones():
    with pytest.raises(MocapError, match=r"unknown roles pelvis; known are hips, thorax"):
        Convention("mine", {"pelvis": "Hips"})
    with pytest.raises(MocapError, match=r"lacks the roles thorax"):
        Convention("mine", {"hips": "Hips"})
