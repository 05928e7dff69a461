"""The same motion in files as different programs write them is read as the same motion."""

import re

import numpy as np
import pytest

from synth.bodies.mocap.bvh import parse_bvh
from synth.bodies.mocap.roles import Convention, joints_of
from synth.bodies.mocap.source import Source, read_source
from synth.geometry import axis_angle
from tests.mocap_files import SIT, STAND, T_POSE, bvh_text, degrees, random_angles, rewritten, standing_root

UP = np.array([0.0, 0.0, 1.0])
TO_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
XSENS = {
    "Spine1": "Chest4", "Neck1": "Neck", "Shoulder": "Collar", "Arm": "Shoulder", "ForeArm": "Elbow",
    "Hand": "Wrist", "UpLeg": "Hip", "Leg": "Knee", "Foot": "Ankle", "ToeBase": "Toe",
}  # fmt: skip


def motion(R: np.ndarray | None = None) -> str:
    rng = np.random.default_rng(5)
    angles = [STAND, SIT, *(random_angles(rng) for _ in range(6))]
    return bvh_text([(a, standing_root(a, R)) for a in angles])


def renamed(text: str, change: dict[str, str], prefix: str = "") -> str:
    def name(found: re.Match) -> str:
        side, rest = re.fullmatch("(Left|Right)?(.*)", found[2]).groups()
        return f"{found[1]} {prefix}{side or ''}{change.get(rest, rest)}"

    return re.sub(r"(ROOT|JOINT) (\w+)", name, text)


def assert_same(ours: Source, theirs: Source) -> None:
    assert ours.unit == pytest.approx(theirs.unit)
    assert np.allclose(ours.limb, theirs.limb, atol=1e-4)
    assert np.allclose(ours.pelvis, theirs.pelvis, atol=1e-4)
    assert np.allclose(ours.palm, theirs.palm, atol=1e-4)
    shifts = ours.at("head") - ours.at("hips"), theirs.at("head") - theirs.at("hips")
    assert np.allclose(*shifts, atol=1e-3)


@pytest.fixture(scope="module")
def text() -> str:
    return motion()


@pytest.fixture(scope="module")
def source(text: str) -> Source:
    return read_source(parse_bvh(text))


@pytest.mark.parametrize("order", ["XYZ", "ZYX", "YXZ", "YZX"])
@pytest.mark.parametrize("places", ["", "offsets", "zeros"])
def test_turns_in_any_order_and_places_of_every_joint(text: str, source: Source, order: str, places: str) -> None:
    assert_same(read_source(parse_bvh(rewritten(text, order, places))), source)


def test_a_file_with_z_up(text: str, source: Source) -> None:
    assert_same(read_source(parse_bvh(rewritten(text, A=TO_Z_UP))), source)


@pytest.mark.parametrize("unit", [1.0, 0.0254, 0.01, 0.001])
def test_any_usual_unit(unit: float) -> None:
    made = read_source(parse_bvh(bvh_text([(STAND, standing_root(STAND))], unit=unit)))
    assert made.unit == pytest.approx(unit)


def test_lower_case_tabs_carriage_returns_and_blank_lines(text: str, source: Source) -> None:
    for word in ("HIERARCHY", "ROOT", "JOINT", "End Site", "OFFSET", "CHANNELS", "MOTION", "Frames", "Frame Time"):
        text = text.replace(word, word.lower())
    head, found, tail = text.replace("rotation", "ROTATION").partition("motion\n")
    text = head.replace("{", "\t{\n\n") + found + tail.replace(" ", "\t").replace("frame\ttime:\t", "frame time: ")
    assert_same(read_source(parse_bvh(text.replace("\n", "\r\n"))), source)


@pytest.mark.parametrize("prefix", ["", "mixamorig:", "Character1_", "Bip 01 ", "a:b:"])
@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("motion_builder", {}), ("mixamo", {"Spine1": "Spine2", "Neck1": "Neck"}), ("mixamo", {"Neck1": "Neck"}),
        ("mixamo", {"Spine1": "Spine3", "Neck1": "Neck", "ToeBase": "Toe"}), ("xsens", XSENS),
    ],
)  # fmt: skip
def test_namings_with_any_prefix(text: str, source: Source, prefix: str, name: str, change: dict) -> None:
    bvh = parse_bvh(renamed(text, change, prefix))
    assert joints_of(bvh)[0].name == name
    assert_same(read_source(bvh), source)


def test_the_highest_spine_joint_carries_the_shoulders(text: str) -> None:
    bvh = parse_bvh(renamed(text, {"Spine": "Spine1", "Spine1": "Spine2", "Neck1": "Neck"}, "mixamorig:"))
    assert bvh.joints[joints_of(bvh)[1]["thorax"]].name == "mixamorig:Spine2"


def test_a_mapping_may_leave_the_prefix_out(text: str, source: Source) -> None:
    convention, _ = joints_of(parse_bvh(text))
    mine = Convention("mine", convention.joints)
    assert_same(read_source(parse_bvh(renamed(text, {}, "Character1_")), mine), source)


def test_files_without_end_sites(text: str, source: Source) -> None:
    assert_same(read_source(parse_bvh(text.replace("End Site\n{\nOFFSET 0 0 1\n}\n", ""))), source)


@pytest.mark.parametrize("heading", [40.0, 90.0, -130.0])
def test_a_t_pose_that_faces_anywhere(source: Source, heading: float) -> None:
    R = axis_angle(UP, np.radians(heading))
    first = bvh_text([(T_POSE, standing_root(T_POSE, R))])
    body = motion(R).splitlines()
    body[body.index("Frames: 9") + 2] = first.splitlines()[-1]
    assert_same(read_source(parse_bvh("\n".join(body) + "\n")), source)


def test_a_t_pose_in_the_pose_without_turns_is_enough_and_none_at_all_is_told(source: Source) -> None:
    text = motion()
    lines = text.splitlines()
    del lines[lines.index("Frames: 9") + 2]
    made = read_source(parse_bvh("\n".join(lines).replace("Frames: 9", "Frames: 8")))
    assert np.allclose(made.limb, source.limb[1:], atol=1e-4)
    bent = degrees(shoulder_flexion=60.0, knee_flexion=50.0)
    assert made.has_rest
    assert not read_source(parse_bvh(bvh_text([(STAND, standing_root(STAND))], rest=bent))).has_rest


def test_a_file_that_was_cut_has_the_frames_that_are_whole(text: str) -> None:
    lines = text.splitlines()
    for last, n in ((lines[-1][:50], 8), (lines[-1], 9)):
        bvh = parse_bvh("\n".join([*lines[:-1], last]).replace("Frames: 9", "Frames: 12"))
        assert bvh.n_promised == 12
        assert (bvh.values == parse_bvh(text).values[:n]).all()
        assert len(bvh.values) == n
