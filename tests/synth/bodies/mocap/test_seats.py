"""Only who rests on a seat sits; who lies, kneels or crawls is on the floor, who jumps, kicks or climbs is neither."""

import numpy as np
import pytest

from synth.bodies.mocap.bvh import parse_bvh
from synth.bodies.mocap.ground import Support, find_support
from synth.bodies.mocap.source import read_source
from synth.geometry import axis_angle
from tests.mocap_files import SIT, STAND, bvh_text, degrees, resting_root, standing_root

pytestmark = pytest.mark.filterwarnings("ignore:Gimbal lock")
SECOND = 1.0 / 30.0
N_STANDING = 12


def leaning(degrees_forward: float, heading: float = 0.0) -> np.ndarray:
    """(3, 3) rotation of a root that leans forward, so -90 is on the back."""
    return axis_angle((0.0, 0.0, 1.0), heading) @ axis_angle((0.0, 1.0, 0.0), np.radians(degrees_forward))


def raised(angles: np.ndarray, height: float, lean: float = 0.0) -> np.ndarray:
    """(4, 4) root so high above where the feet would stand [m]."""
    T = standing_root(angles, leaning(lean))
    T[2, 3] += height
    return T


def support_of(frames: list[tuple[np.ndarray, np.ndarray]]) -> Support:
    """Of the frames alone, recorded between standing ones."""
    upright = [(STAND, standing_root(STAND))] * N_STANDING
    support = find_support(read_source(parse_bvh(bvh_text(upright + frames + upright))), SECOND)
    rows = slice(1 + N_STANDING, 1 + N_STANDING + len(frames))
    return Support(*(getattr(support, name)[rows] for name in Support.__dataclass_fields__))


FLOOR = {
    "on the back": (degrees(), -90.0),
    "on the back, knees bent": (degrees(hip_flexion=45.0, knee_flexion=90.0), -90.0),
    "on the back, legs up": (degrees(hip_flexion=90.0, knee_flexion=90.0), -90.0),
    "on the belly": (degrees(shoulder_flexion=170.0), 90.0),
    "half sitting up": (degrees(hip_flexion=90.0, knee_flexion=90.0), -45.0),
    "kneeling upright": (degrees(knee_flexion=92.0, ankle_flexion=-40.0), 0.0),
    "on one knee": (degrees(l_hip_flexion=88.0, l_knee_flexion=88.0, r_knee_flexion=88.0), 0.0),
    "on the heels": (degrees(hip_flexion=60.0, knee_flexion=150.0, ankle_flexion=-50.0), 0.0),
    "legs crossed": (degrees(hip_flexion=110.0, hip_abduction=50.0, hip_rotation=-50.0, knee_flexion=145.0), 0.0),
    "legs straight": (degrees(hip_flexion=90.0), 0.0),
    "knees to the chest": (degrees(hip_flexion=120.0, knee_flexion=110.0), -20.0),
    "crawling": (degrees(hip_flexion=85.0, knee_flexion=90.0, shoulder_flexion=85.0), 85.0),
    "push-up": (degrees(shoulder_flexion=75.0), 72.0),
}  # fmt: skip


@pytest.mark.parametrize("name", FLOOR)
def test_who_is_on_the_floor_neither_sits_nor_stands(name):
    angles, lean = FLOOR[name]
    support = support_of([(angles, resting_root(angles, leaning(lean)))] * 30)
    assert support.is_on_floor.all()
    assert not support.is_sitting.any()
    assert not support.is_standing.any()


def test_a_recording_of_somebody_on_the_floor_alone_has_no_seat():
    for angles, lean in FLOOR.values():
        text = bvh_text([(angles, resting_root(angles, leaning(lean)))] * 30)
        support = find_support(read_source(parse_bvh(text)), SECOND)
        assert not support.is_sitting[1:].any()


SEATS = {
    "chair": (SIT, 0.0, 0.0),
    "leaning on a table": (SIT + degrees(hip_flexion=20.0), 30.0, 0.0),
    "leaning back": (SIT - degrees(hip_flexion=20.0), -25.0, 0.0),
    "step stool": (SIT + degrees(hip_flexion=15.0, knee_flexion=15.0), 0.0, 0.0),
    "bar stool, feet on the rung": (SIT, 0.0, 0.3),
    "bar stool, feet down": (degrees(hip_flexion=55.0, knee_flexion=40.0), 0.0, 0.0),
    "feet apart": (SIT + degrees(hip_abduction=25.0), 0.0, 0.0),
}  # fmt: skip


@pytest.mark.parametrize("name", SEATS)
def test_who_rests_on_a_seat_sits(name):
    angles, lean, height = SEATS[name]
    support = support_of([(angles, raised(angles, height, lean))] * 20)
    assert support.is_sitting.all()
    assert not support.is_on_floor.any()


def test_who_is_on_a_seat_for_a_moment_does_not_sit():
    for n, sits in ((12, False), (20, True)):
        assert support_of([(SIT, standing_root(SIT))] * n).is_sitting.any() == sits


def test_who_slides_down_a_slope_does_not_sit():
    frames = [(SIT, raised(SIT, 0.4 - 0.4 * k / 40)) for k in range(40)]
    assert not support_of(frames).is_sitting.any()


@pytest.mark.parametrize("seconds", [0.3, 0.4, 0.6])
@pytest.mark.parametrize("tuck", [20.0, 60.0, 100.0])
def test_who_jumps_is_in_the_air(seconds, tuck):
    n = round(seconds / SECOND)
    angles = STAND + degrees(hip_flexion=tuck, knee_flexion=tuck)
    frames = []
    for k in range(1, n):
        t = k * SECOND
        T = standing_root(STAND)
        T[2, 3] += 4.905 * t * (seconds - t)
        frames.append((angles, T))
    support = support_of(frames)
    assert not support.is_sitting.any()
    assert not support.is_on_floor.any()


@pytest.mark.parametrize("height", [60.0, 90.0, 120.0])
def test_who_kicks_or_raises_a_knee_stands_at_most(height):
    for knee in (0.0, 100.0):
        angles = STAND + degrees(l_hip_flexion=height, l_knee_flexion=knee)
        for lean in (0.0, -20.0):
            support = support_of([(angles, standing_root(angles, leaning(lean)))] * 30)
            assert not support.is_sitting.any()
            assert not support.is_on_floor.any()


def test_who_squats_does_not_sit():
    angles = degrees(hip_flexion=120.0, knee_flexion=125.0, ankle_flexion=25.0, shoulder_flexion=80.0)
    support = support_of([(angles, standing_root(angles, leaning(40.0)))] * 30)
    assert not support.is_sitting.any()
    assert not support.is_on_floor.any()


@pytest.mark.parametrize("step", [0.18, 0.3])
def test_who_climbs_does_not_sit(step):
    frames = []
    for k in range(90):
        stride = k // 15
        side = "lr"[stride % 2]
        angles = STAND + degrees(**{f"{side}_hip_flexion": 75.0, f"{side}_knee_flexion": 80.0})
        T = standing_root(angles)
        T[2, 3] += step * stride + step * (k % 15) / 15
        frames.append((angles, T))
    support = support_of(frames)
    assert not support.is_sitting.any()
    assert not support.is_on_floor.any()


def test_who_hangs_on_a_ladder_with_both_thighs_raised_does_not_sit():
    angles = degrees(hip_flexion=70.0, knee_flexion=80.0, shoulder_flexion=150.0)
    frames = [(angles, raised(angles, 0.6 + 0.3 * (k // 25))) for k in range(75)]
    assert not support_of(frames).is_sitting.any()


def test_who_picks_something_up_stands():
    angles = STAND + degrees(hip_flexion=75.0, shoulder_flexion=80.0, lumbar_flexion=30.0, thorax_flexion=20.0)
    T = standing_root(angles, leaning(60.0))
    T[0, 3] -= 0.1
    support = support_of([(angles, T)] * 20)
    assert not support.is_sitting.any()
    assert not support.is_on_floor.any()
