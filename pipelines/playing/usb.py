"""USB depth cameras, by the driver that is installed: pyrealsense2, or OpenCV with OpenNI."""

import importlib
import time
from collections.abc import Callable, Iterator
from typing import Any, ClassVar

import numpy as np

from forests.frames import Intrinsics
from pipelines.errors import UserError
from pipelines.online.messages import CameraFrame, Notice

CAMERA = "camera"
SILENT_MS = 5000
"""A camera that gives no image for so long has been lost [ms]."""
DRIVERS = ("realsense", "openni")
Loader = Callable[[str], Any]


def open_camera(driver: str, camera: Intrinsics | None, load: Loader = importlib.import_module) -> "UsbSource":
    """The first USB depth camera.

    Args:
        driver: realsense, openni, or empty: the first whose software is installed.
        camera: Intrinsics, instead of those that the camera tells; OpenNI tells the focal length alone.
        load: Imports a module by name.

    Raises:
        UserError: No such driver, its software is not installed, or no camera answers.
    """
    if driver and driver not in DRIVERS:
        raise UserError(f"usb:{driver} is no driver; known are {', '.join(f'usb:{name}' for name in DRIVERS)}")
    reasons = []
    for name in (driver,) if driver else DRIVERS:
        try:
            return RealSense(load, camera) if name == "realsense" else OpenNI(load, camera)
        except UserError as error:
            reasons.append(str(error))
    raise UserError("; ".join(reasons))


class UsbSource:
    """The images of a camera as they come, until it is lost; subclasses open it."""

    is_live: ClassVar[bool] = True

    def __init__(self, camera: Intrinsics) -> None:
        self._camera = camera

    def frames(self) -> Iterator[CameraFrame | Notice]:
        """The images; a camera that is lost ends them."""
        while True:
            depth = self._grab()
            if depth is None:
                yield Notice("cameras that were lost", f"the camera gave no image for {SILENT_MS / 1000:g} s")
                return
            yield CameraFrame(time.time_ns(), CAMERA, depth, self._camera)

    def _grab(self) -> np.ndarray | None:
        """(height, width) uint16 [mm]; None if no image comes any more."""
        raise NotImplementedError

    def close(self) -> None:
        """Lets go of the camera."""


class RealSense(UsbSource):
    """A camera of Intel, by pyrealsense2."""

    def __init__(self, load: Loader, camera: Intrinsics | None) -> None:
        """Opens the first one.

        Raises:
            UserError: pyrealsense2 is not installed, or no camera answers.
        """
        try:
            rs = load("pyrealsense2")
        except ImportError:
            raise UserError(
                "usb:realsense needs pyrealsense2; install it with: pip install pyrealsense2"
            ) from None
        self._pipeline, config = rs.pipeline(), rs.config()
        config.enable_stream(rs.stream.depth, rs.format.z16, 30)
        try:
            profile = self._pipeline.start(config)
        except RuntimeError as error:
            raise UserError(f"no RealSense camera can be opened: {error}") from None
        self._mm = 1000.0 * float(profile.get_device().first_depth_sensor().get_depth_scale())
        told = profile.get_stream(rs.stream.depth).as_video_stream_profile().get_intrinsics()
        super().__init__(camera or Intrinsics(told.fx, told.fy, told.ppx, told.ppy))

    def _grab(self) -> np.ndarray | None:
        try:
            frames = self._pipeline.wait_for_frames(SILENT_MS)
        except RuntimeError:
            return None
        raw = np.asanyarray(frames.get_depth_frame().get_data())
        if self._mm == 1.0:
            return np.array(raw, np.uint16)
        return np.asarray(np.rint(np.minimum(raw * self._mm, 65535.0)), np.uint16)

    def close(self) -> None:
        """Lets go of the camera."""
        self._pipeline.stop()


class OpenNI(UsbSource):
    """A Kinect v1, Xtion or Astra, by an OpenCV that was built with OpenNI; the one from PyPI was not."""

    def __init__(self, load: Loader, camera: Intrinsics | None) -> None:
        """Opens the first one.

        Raises:
            UserError: OpenCV has no OpenNI, or no camera answers.
        """
        self._cv2 = cv2 = load("cv2")
        names = {cv2.videoio_registry.getBackendName(code) for code in cv2.videoio_registry.getCameraBackends()}
        if not names & {"OPENNI", "OPENNI2"}:
            raise UserError("usb:openni needs an OpenCV that was built with OpenNI2, and this one was not")
        self._capture = cv2.VideoCapture(cv2.CAP_OPENNI2)
        if not self._capture.isOpened():
            raise UserError("no OpenNI camera can be opened")
        focal = float(self._capture.get(cv2.CAP_OPENNI_DEPTH_GENERATOR_FOCAL_LENGTH))
        width = float(self._capture.get(cv2.CAP_PROP_FRAME_WIDTH))
        height = float(self._capture.get(cv2.CAP_PROP_FRAME_HEIGHT))
        if camera is None and not focal > 0:
            self._capture.release()
            raise UserError("the OpenNI camera does not tell its focal length; give --intrinsics")
        super().__init__(camera or Intrinsics(focal, focal, (width - 1) / 2, (height - 1) / 2))

    def _grab(self) -> np.ndarray | None:
        end = time.monotonic() + SILENT_MS / 1000
        while time.monotonic() < end:
            if self._capture.grab():
                is_there, depth = self._capture.retrieve(flag=self._cv2.CAP_OPENNI_DEPTH_MAP)
                if is_there:
                    return np.asarray(depth, np.uint16)
            time.sleep(0.01)
        return None

    def close(self) -> None:
        """Lets go of the camera."""
        self._capture.release()
