"""Pictures: files whole or absent, windows that put points where their pixels are, marks of joints."""

import cv2
import numpy as np
import pytest

from pipelines.drawing import palette
from pipelines.drawing.files import encoded, write_picture
from pipelines.drawing.skeletons import draw_errors, draw_truth
from pipelines.drawing.windows import Window, foreground_window
from pipelines.errors import UserError
from synth.camera import Camera
from synth.vocabulary import JointState

CAMERA = Camera(64, 48, 60.0, 60.0, 31.5, 23.5)


def test_a_written_picture_is_read_as_it_was(tmp_path):
    path = tmp_path / "Bild \N{GREEK SMALL LETTER OMEGA}.png"
    image = np.arange(48 * 64, dtype=np.uint16).reshape(48, 64)
    write_picture(path, image)
    read = cv2.imdecode(np.frombuffer(path.read_bytes(), np.uint8), cv2.IMREAD_UNCHANGED)
    assert np.array_equal(read, image)
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_a_picture_that_cannot_be_written_names_its_path(tmp_path):
    (tmp_path / "taken.png").mkdir()
    for path in (tmp_path / "nowhere" / "a.png", tmp_path / "taken.png"):
        with pytest.raises(OSError, match=path.name):
            write_picture(path, np.zeros((2, 2), np.uint8))
    assert [file.name for file in tmp_path.iterdir()] == ["taken.png"]


def test_an_image_that_no_file_holds_is_one_line():
    with pytest.raises(UserError, match=r"a complex128 image of shape \(2, 2\) cannot be written as PNG"):
        encoded(np.zeros((2, 2), np.complex128))


def test_points_lie_where_their_pixels_are_drawn():
    image = np.zeros((48, 64, 3), np.uint8)
    image[30, 20] = 255
    window = Window.fitted(slice(10, 40), slice(5, 50), 450)
    xyz = CAMERA.backproject([[20.0, 30.0]], [2.0])
    drawn = np.argwhere(window.cut(image)[..., 0] > 0).mean(axis=0)[::-1]
    assert window.places(xyz, CAMERA)[0] == pytest.approx(drawn + 0.5, abs=0.01)


def test_points_behind_the_camera_or_nowhere_have_no_place():
    window = Window.fitted(slice(0, 48), slice(0, 64), 64)
    places = window.places(np.array([[0.0, 0.0, -1.0], [np.nan] * 3, [1e9, 0.0, 1.0]]), CAMERA)
    assert np.isnan(places[:2]).all()
    assert np.isfinite(places[2]).all()


@pytest.mark.parametrize("depth", [np.zeros((48, 64), np.uint16), np.eye(48, 64, dtype=np.uint16)])
def test_windows_of_the_foreground_fit_and_hold_all_of_it(depth):
    window = foreground_window(depth, 300, 200)
    picture = window.cut(np.zeros((48, 64, 3), np.uint8))
    assert picture.shape[0] <= 200
    assert picture.shape[1] <= 300
    assert 200 in picture.shape or 300 in picture.shape
    assert depth[window.rows, window.columns].sum() == depth.sum()


@pytest.mark.parametrize("state", JointState)
def test_every_state_has_its_mark(state):
    picture = np.zeros((30, 30, 3), np.uint8)
    draw_truth(
        picture, np.array([[15.0, 15.0], [np.nan, np.nan]]), ("head", "neck"), np.array([state, 0], np.uint8)
    )
    assert (picture == palette.STATE_MARKS[state].colour).all(axis=2).any()


def test_wrong_joints_are_tied_to_the_truth():
    picture = np.zeros((40, 40, 3), np.uint8)
    places, truth = np.array([[5.0, 20.0], [20.0, 5.0]]), np.array([[35.0, 20.0], [20.0, 5.0]])
    draw_errors(picture, places, truth, ("head", "l_foot"), np.array([False, True]))
    assert (picture[20, 20] > 0).any()
    assert (picture == palette.RIGHT.colour).all(axis=2).any()
    assert (picture == palette.WRONG.colour).all(axis=2).any()
