"""USB cameras by fakes of their drivers, and what is said where these are not installed."""

from types import SimpleNamespace

import numpy as np
import pytest

from forests.frames import Intrinsics
from pipelines.cli import main
from pipelines.errors import UserError
from pipelines.online.messages import CameraFrame, Notice
from pipelines.playing import usb


class FakePipeline:
    """Gives two images of half millimetres, then none."""

    def __init__(self):
        self.left, self.is_open = 2, False

    def start(self, config):
        self.is_open = True
        intrinsics = SimpleNamespace(fx=380.0, fy=381.0, ppx=320.0, ppy=240.0)
        sensor = SimpleNamespace(get_depth_scale=lambda: 0.0005)
        video = SimpleNamespace(get_intrinsics=lambda: intrinsics)
        return SimpleNamespace(
            get_device=lambda: SimpleNamespace(first_depth_sensor=lambda: sensor),
            get_stream=lambda stream: SimpleNamespace(as_video_stream_profile=lambda: video),
        )

    def wait_for_frames(self, timeout):
        if not self.left:
            raise RuntimeError("Frame didn't arrive within 5000")
        self.left -= 1
        data = np.full((4, 6), 3001, np.uint16)
        return SimpleNamespace(get_depth_frame=lambda: SimpleNamespace(get_data=lambda: data))

    def stop(self):
        self.is_open = False


def realsense(name):
    if name != "pyrealsense2":
        raise ImportError(name)
    config = SimpleNamespace(enable_stream=lambda *values: None)
    return SimpleNamespace(
        pipeline=FakePipeline,
        config=lambda: config,
        stream=SimpleNamespace(depth="depth"),
        format=SimpleNamespace(z16="z16"),
    )


def test_a_realsense_gives_millimetres_and_its_camera():
    source = usb.open_camera("", None, realsense)
    items = list(source.frames())
    assert [type(item) for item in items] == [CameraFrame, CameraFrame, Notice]
    assert items[0].camera == Intrinsics(380.0, 381.0, 320.0, 240.0)
    assert items[0].depth.dtype == np.uint16
    assert np.unique(items[0].depth).tolist() == [1500]  # 1500.5 mm, to the even number
    assert 0 < items[0].stamp <= items[1].stamp
    source.close()
    assert not source._pipeline.is_open
    own = Intrinsics(1.0, 2.0, 3.0, 4.0)
    assert next(usb.open_camera("realsense", own, realsense).frames()).camera == own


class FakeOpenCV:
    """OpenCV with OpenNI; its camera tells the focal length."""

    CAP_OPENNI2, CAP_OPENNI_DEPTH_MAP, CAP_OPENNI_DEPTH_GENERATOR_FOCAL_LENGTH = 1600, 0, 7
    CAP_PROP_FRAME_WIDTH, CAP_PROP_FRAME_HEIGHT = 3, 4

    def __init__(self, focal=570.0, is_open=True, backends=("OPENNI2",)):
        self.values, self.is_open, self.backends = {7: focal, 3: 640.0, 4: 480.0}, is_open, backends
        self.videoio_registry = SimpleNamespace(
            getCameraBackends=lambda: range(len(backends)), getBackendName=lambda code: backends[code]
        )

    def __call__(self, name):
        if name != "cv2":
            raise ImportError(name)
        return self

    def VideoCapture(self, code):
        return SimpleNamespace(
            isOpened=lambda: self.is_open,
            get=self.values.get,
            grab=lambda: True,
            retrieve=lambda flag: (True, np.full((480, 640), 2222, np.uint16)),
            release=lambda: None,
        )


def test_openni_gives_depth_and_its_focal_length():
    frame = next(usb.open_camera("openni", None, FakeOpenCV()).frames())
    assert frame.camera == Intrinsics(570.0, 570.0, 319.5, 239.5)
    assert np.unique(frame.depth).tolist() == [2222]


@pytest.mark.parametrize(
    ("driver", "load", "words"),
    [
        ("kinect", realsense, "usb:kinect is no driver; known are usb:realsense, usb:openni"),
        ("realsense", FakeOpenCV(), "usb:realsense needs pyrealsense2; install it with: pip install pyrealsense2"),
        ("openni", FakeOpenCV(backends=("V4L2",)), "built with OpenNI2, and this one was not"),
        ("openni", FakeOpenCV(is_open=False), "no OpenNI camera can be opened"),
        ("openni", FakeOpenCV(focal=0.0), "give --intrinsics"),
        ("", FakeOpenCV(backends=()), "needs pyrealsense2; .*; usb:openni needs"),
    ],
)
def test_what_is_missing_is_one_clear_error(driver, load, words):
    with pytest.raises(UserError, match=words):
        usb.open_camera(driver, None, load)


def test_live_says_what_a_camera_needs(capsys):
    assert main(["live", "usb:openni"]) == 1
    assert "usb:openni needs an OpenCV that was built with OpenNI2" in capsys.readouterr().err
