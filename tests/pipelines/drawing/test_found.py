"""Found people are drawn where they were found."""

import numpy as np

from forests.finder.find import FoundPerson
from pipelines.drawing import palette
from pipelines.drawing.found import found_picture


def person(upper, box):
    point = np.array([0.0, -0.5, 2.0])
    return FoundPerson(0.9, 2.2, upper, box, point, point, 2.1, np.zeros(3), 1.7)


def test_boxes_lie_over_the_depth_and_wrong_ones_have_a_colour_of_their_own():
    depth = np.zeros((60, 80), np.uint16)
    depth[:, 40:] = 3000
    people = [
        person((5.0, 5.0, 30.0, 30.0), (3.0, 4.0, 34.0, 55.0)),
        person((50.0, 9.0, 70.0, 40.0), (48.0, 8.0, 79.0, 58.0)),
    ]
    picture = found_picture(depth, people, np.array([False, True]))
    assert picture.shape == (60, 80, 3)
    assert picture[54, 20].tolist() == palette.PERSON_COLOURS[1].tolist()
    assert tuple(picture[57, 60].tolist()) == palette.VERMILION
    assert (picture[2, 42:] > 0).all()
    assert not picture[58:, :40].any()


def test_an_image_without_people_is_grey():
    picture = found_picture(np.full((20, 30), 2500, np.uint16), [])
    assert (picture == picture[:1, :1]).all()
