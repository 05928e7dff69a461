"""A browser shows what it should, where it should: a screenshot of headless Chromium is looked at."""

import cv2
import numpy as np
import pytest

pytest.importorskip("viser", reason="viser is not installed")

from pipelines.viewer.drawing import MODE_COLOUR, VOTE_COLOUR, colour_of
from pipelines.viewer.page import Page
from pipelines.viewer.votes import VoteView
from tests.pipelines.viewer.browser import CHROMIUM, Browser, wait_for
from tests.pipelines.viewer.test_page import Teller
from tests.pipelines.viewer.toy_show import T_FLOOR_CAMERA, ToyShow

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium: apt-get install chromium")
FOV = np.radians(60.0)


@pytest.fixture
def shown(tmp_path):
    """The page, and a browser that looks at the toy from where its camera is."""
    page = Page(ToyShow(), 0, VoteView(Teller(), is_cut_out=True))
    page._server.initial_camera.position = (0.0, 0.0, 1.2)
    page._server.initial_camera.look_at = (2.0, 0.0, 1.2)
    page._server.initial_camera.fov = FOV
    page._is_aimed = True
    page._is_shown["cloud"].value = page._is_shown["floor"].value = False
    page.draw()
    browser = Browser(tmp_path)
    browser.open(page.address)
    yield page, browser
    browser.close()
    page.close()


def pixel_of(picture, place):
    """Where a place of the floor's frame is in the picture (row, column)."""
    height, width, _ = picture.shape
    x, y, z = T_FLOOR_CAMERA[:3, :3].T @ (np.asarray(place) - T_FLOOR_CAMERA[:3, 3])
    f = height / 2 / np.tan(FOV / 2)
    return round(height / 2 + f * y / z), round(width / 2 + f * x / z)


def share_near(picture, place, colour, radius=9):
    """Share of the pixels about a place whose hue is that of a colour."""
    row, column = pixel_of(picture, place)
    about = picture[row - radius : row + radius + 1, column - radius : column + radius + 1].reshape(-1, 3)
    return alike(about, colour).mean()


def share_below(picture, place, colour):
    """The same of pixels in the lower half of a joint's disc."""
    row, column = pixel_of(picture, place)
    return alike(picture[row + 2 : row + 7, column - 5 : column + 6].reshape(-1, 3), colour).mean()


def has_colour(pixels, colour):
    """Whether a pixel has about a colour, light as it is."""
    return bool((np.abs(pixels.astype(int) - colour).max(axis=-1) < 60).any())


def alike(pixels, colour):
    """Which pixels have a colour's hue, light or dark, and are no greys."""
    hue, saturation, value = _hsv(pixels).T
    wanted = _hsv(np.asarray(colour)[None])[0]
    off = np.abs((hue - wanted[0] + 90) % 180 - 90)
    return (off < 8) & (saturation > 60) & (value > 50)


def _hsv(pixels):
    values = np.ascontiguousarray(np.asarray(pixels)[None], np.uint8)
    return cv2.cvtColor(values, cv2.COLOR_RGB2HSV)[0].astype(int)


def test_people_are_shown_where_they_are_in_colours_of_their_own(shown):
    page, browser = shown
    moment = page._show.moment(0)
    walking, standing = (one.positions for one in moment.skeletons)
    mine, other = colour_of(1), colour_of(3)
    # The page fades in.
    wait_for(lambda: share_near(browser.picture(), walking[2], mine) > 0.2, 60)
    picture = browser.picture()
    for places, colour, wrong in ((walking, mine, other), (standing, other, mine)):
        for place in places:
            assert share_near(picture, place, colour) > 0.05
            assert share_near(picture, place, wrong) == 0
    # Joints that are hidden are hollow: one sees through them where no bone begins.
    assert np.mean([share_below(picture, place, mine) for place in walking[3:]]) > 0.95
    assert np.mean([share_below(picture, place, other) for place in standing[3:]]) < 0.8
    words = browser.text()
    for wanted in (
        "the toy at 0",
        "asked about: walks 1",
        "1 skipped: too far away for the module",
        "moment",
        "play",
    ):
        assert wanted in words

    # Time passes: the one who walks has gone, the other has not.
    page.time.value = 4
    page.draw()
    later = page._show.moment(4).skeletons[0].positions
    wait_for(lambda: share_near(browser.picture(), later[2], mine) > 0.2, 60)
    picture = browser.picture()
    assert share_near(picture, walking[0], mine) == 0
    assert share_near(picture, standing[2], other) > 0.05

    # The cloud has the colours of the labels, and the votes are where the forest puts them.
    page._is_shown["cloud"].value = True
    page.colours.value, page.joint.value = "left side", "torso"
    page.draw()
    wait_for(lambda: share_near(browser.picture(), (4.0, 1.6, 1.0), (0, 200, 0), 20) > 0.02, 60)
    picture = browser.picture()
    assert share_near(picture, (4.0, -1.6, 1.0), (0, 200, 0), 20) == 0
    vote = (2.0, 0.0, 1.2)
    assert share_near(picture, vote, VOTE_COLOUR, 6) > 0.02
    row, column = pixel_of(picture, vote)
    about = (slice(row - 30, row + 30), slice(column - 30, column + 30))
    wait_for(lambda: has_colour(browser.picture()[about], MODE_COLOUR), 60)
    assert "8 votes; modes: 1" in browser.text()
