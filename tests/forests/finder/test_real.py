"""Five people walk away from a real Kinect v1; nobody said where they are."""

import cv2
import numpy as np
import pytest

from forests.finder.find import PeopleFinder
from forests.frames import Intrinsics
from tests.shared_data import SHARED

IMAGE = SHARED / "data/real/five_people/five_people_depth_mm.png"
MIDDLES = {88: 2.4, 195: 2.6, 335: 3.0, 415: 2.8, 535: 2.1}
"""Column of each person's middle in the image, read off it, and the distance of the chest [m]."""


@pytest.mark.skipif(not IMAGE.exists(), reason="the recorded frame with five people is not here")
def test_five_people_are_found_and_nobody_else():
    depth = cv2.imread(str(IMAGE), cv2.IMREAD_UNCHANGED)
    found = PeopleFinder().find(depth, Intrinsics(525.0, 525.0, 319.5, 239.5))
    assert len(found) == 5
    for column, distance in MIDDLES.items():
        person = min(found, key=lambda one: abs((one.box[0] + one.box[2]) / 2 - column))
        assert person.box[0] < column < person.box[2]
        assert person.distance == pytest.approx(distance, abs=0.2)
    assert np.ptp([one.place[2] for one in found]) == 0
