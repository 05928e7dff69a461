"""Headings: what geometry says of them, and what becomes of probabilities."""

import math

import numpy as np
import pytest

from forests.skeleton.heading import N_SECTORS, facing_towards, facings_of, hypotheses_of, sectors_of
from forests.skeleton.proposal import turned, turned_facings

NAMES = ("neck", "r_shoulder", "l_shoulder", "r_hip", "l_hip")
T_POSE = np.array([[0.0, -0.5, 0.0], [-0.2, -0.4, 0.0], [0.2, -0.4, 0.0], [-0.1, 0.1, 0.0], [0.1, 0.1, 0.0]])
"""Somebody who faces the camera: the right side at the image's left."""


def person(heading: float, azimuth: float = 0.0) -> np.ndarray:
    """(1, 5, 3): 3 m from the camera, away from its axis by an azimuth, turned from facing the camera by a heading."""
    turn = heading + azimuth
    cos, sin = math.cos(turn), math.sin(turn)
    about_y = np.array([[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]])
    away = 3.0 * np.array([-math.sin(azimuth), 0.0, math.cos(azimuth)])
    return (T_POSE @ about_y.T + away)[None].astype(np.float32)


@pytest.mark.parametrize("azimuth", [0.0, 0.5, -0.5])
@pytest.mark.parametrize("heading", [0.0, 0.3, -1.5, 3.0])
def test_a_heading_is_the_turn_from_facing_the_camera_wherever_one_stands(heading, azimuth):
    ((cos, sin),) = facings_of(person(heading, azimuth), NAMES)
    assert math.atan2(sin, cos) == pytest.approx(heading, abs=1e-5)
    assert math.hypot(cos, sin) == pytest.approx(1.0, abs=1e-5)


def test_people_who_face_the_images_right_have_a_heading_of_plus_90_degrees():
    joints = person(math.pi / 2)[0]
    forward = np.cross([0.0, -1.0, 0.0], joints[1] - joints[2])
    assert forward[0] > 0.3


def test_the_mirror_image_has_the_opposite_heading():
    joints = person(0.7, 0.2)
    mirrored = joints[:, [0, 2, 1, 4, 3]] * np.float32([-1, 1, 1])
    np.testing.assert_allclose(facings_of(mirrored, NAMES), facings_of(joints, NAMES) * [1, -1], atol=1e-6)


def test_shoulders_alone_are_enough_and_nothing_tells_nothing():
    joints = person(0.7)
    shoulders = joints.copy()
    shoulders[:, 3:] = np.nan
    np.testing.assert_allclose(facings_of(shoulders, NAMES), facings_of(joints, NAMES), atol=1e-6)
    shoulders[:, 1] = np.nan
    assert (facings_of(shoulders, NAMES) == 0).all()
    assert (facings_of(joints[:, :1], NAMES[:1]) == 0).all()
    lying = joints.copy()
    lying[:, 1:] = lying[:, :1] + np.float32([[0, -0.2, 0], [0, 0.2, 0], [0, -0.1, 0], [0, 0.1, 0]])
    assert (facings_of(lying, NAMES) == 0).all()


def test_sectors_share_a_heading_between_neighbours():
    angles = np.linspace(-3.1, 3.1, 41)
    facings = np.stack([facing_towards(angle) for angle in angles])
    shares = sectors_of(facings)
    np.testing.assert_allclose(shares.sum(axis=1), 1.0, atol=1e-6)
    assert ((shares > 0).sum(axis=1) <= 2).all()
    middles = 2 * np.pi * np.arange(N_SECTORS) / N_SECTORS
    back = np.arctan2(shares @ np.sin(middles), shares @ np.cos(middles))
    assert np.abs(back - angles).max() < np.radians(1)
    assert (sectors_of(np.zeros((2, 2), np.float32)) == 0).all()
    assert (facing_towards(math.nan) == 0).all()


def test_the_second_hypothesis_lies_apart_from_the_first():
    sectors = np.zeros(N_SECTORS, np.float32)
    sectors[[0, 1, 11, 6, 7]] = 0.4, 0.2, 0.1, 0.2, 0.1
    angle, probability = np.empty(2, np.float32), np.empty(2, np.float32)
    hypotheses_of(sectors, angle, probability)
    np.testing.assert_allclose(probability, [0.7, 0.3], atol=1e-6)
    assert 0 < angle[0] < np.radians(10)
    assert np.radians(-180) < angle[1] < np.radians(-160)


def test_people_who_are_turned_have_turned_headings():
    joints = np.concatenate([person(0.3, 0.2), person(-2.0, -0.4)])
    middle = joints[:, 1:].mean(axis=1)
    turn = np.array([0.4, -0.7])
    there = turned(joints, middle, turn, np.ones(2, np.float32))
    np.testing.assert_allclose(
        facings_of(there, NAMES), turned_facings(facings_of(joints, NAMES), turn), atol=1e-5
    )
