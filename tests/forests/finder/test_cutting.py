"""A found person is cut out: their pixels stay, floor, walls and others go; the kernel equals its slow twin."""

import numpy as np
import pytest

from forests.finder.cutting import ABOVE_M, BEHIND_M, DEPTH_M, REACH_M, cut_axis, cut_person
from forests.finder.find import PeopleFinder
from forests.finder.floor import NOISE_M, NOISE_PER_M2
from tests.reference_finder import CAMERA, SIZE, cast, figure, rays, standing

PLACES = ((2.4, -0.6), (3.2, 0.5))
FLOOR = standing()


@pytest.fixture(scope="module")
def room():
    return cast(FLOOR, [part for place in PLACES for part in figure(*place)], wall=3.7)


def axes_of(*places, height=1.75):
    """Points on the axes of people who stand at places of the floor frame, camera frame."""
    T = np.linalg.inv(FLOOR.T_floor_camera)
    return np.array([(T @ (x, y, height, 1.0))[:3] for x, y in places])


def alone(place):
    """(height, width) bool: the pixels of a person who stands there with nobody else."""
    return cast(FLOOR, figure(*place), wall=3.7) != cast(FLOOR, wall=3.7)


def slow_cut(depth, axes, number, floor):
    points = rays()[..., :] * (depth * 1e-3)[..., None]
    up = np.array([0.0, -1.0, 0.0]) if floor is None else floor.normal
    rise = points @ up

    def gap(axis):
        off = points - axis
        return np.linalg.norm(off - (off @ up)[..., None] * up, axis=-1)

    axis = axes[number]
    level = axis - (axis @ up) * up
    lift = rise - axis @ up
    is_kept = (depth > 0) & (gap(axis) <= REACH_M) & (lift <= ABOVE_M) & (lift >= -DEPTH_M)
    is_kept &= points @ (level / np.linalg.norm(level)) <= np.linalg.norm(level) + BEHIND_M
    for other in np.delete(axes, number, axis=0):
        is_kept &= gap(other) >= gap(axis)
    if floor is not None:
        is_kept &= rise + floor.height >= NOISE_M + NOISE_PER_M2 * points[..., 2] ** 2
    return np.where(is_kept, depth, 0)


@pytest.mark.parametrize("floor", [FLOOR, None])
def test_the_kernel_equals_its_slow_twin(room, floor):
    axes = axes_of(*PLACES, (2.7, -0.4))
    for number in range(3):
        kept = cut_axis(room, CAMERA, axes, number, floor)
        np.testing.assert_array_equal(kept, slow_cut(room, axes, number, floor))
        assert kept.any() or number == 2


def test_a_person_stays_and_floor_wall_and_others_go(room):
    found = PeopleFinder().find(room, CAMERA)
    assert len(found) == 2
    for place in PLACES:
        nearest = min(found, key=lambda one: np.hypot(one.place[0] - place[0], one.place[1] - place[1]))
        kept = cut_person(room, CAMERA, found, found.people.index(nearest))
        own = alone(place) & (room == cast(FLOOR, figure(*place), wall=3.7))
        assert (kept[own] > 0).mean() > 0.97
        assert (kept[~own] > 0).sum() < 0.03 * own.sum()
        assert set(np.unique(kept)) <= {0, *np.unique(room)}


def test_nothing_belongs_to_two_people(room):
    found = PeopleFinder().find(room, CAMERA)
    kept = [cut_person(room, CAMERA, found, k) > 0 for k in range(len(found))]
    assert not (kept[0] & kept[1]).any()


def test_an_object_before_a_person_stays():
    box = ((1.9, -0.6, 0.45), (0.15, 0.3, 0.2))
    depth = cast(FLOOR, [*figure(2.4, -0.6), box], wall=3.7)
    kept = cut_axis(depth, CAMERA, axes_of((2.4, -0.6)), 0, FLOOR)
    is_box = depth != cast(FLOOR, figure(2.4, -0.6), wall=3.7)
    assert (kept[is_box] > 0).mean() > 0.9


@pytest.mark.parametrize("what", ["empty", "one pixel", "all near"])
def test_poor_images_give_poor_cuttings(what):
    depth = np.zeros(SIZE, np.uint16)
    if what == "one pixel":
        depth[100, 100] = 2000
    if what == "all near":
        depth[:] = 1
    kept = cut_axis(depth, CAMERA, axes_of((2.4, 0.0)), 0, FLOOR)
    assert kept.dtype == np.uint16
    assert (kept > 0).sum() <= 1


def test_a_number_that_nobody_has_is_refused(room):
    found = PeopleFinder().find(room, CAMERA)
    with pytest.raises(IndexError, match=r"person 2 is not in 0\.\.1"):
        cut_person(room, CAMERA, found, 2)
