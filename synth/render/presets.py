"""Named depth cameras (published calibrations), free cameras, and the ways a camera is mounted."""

import math
from dataclasses import dataclass

from synth.camera import Camera

CAMERAS: dict[str, Camera] = {
    camera.name: camera
    for camera in (
        # Kinect v1: f = 575.816 px is the factory value, the zero plane's distance over its pixel size
        # (1200 mm / 1.042 mm at 1280 px; libfreenect registration.c, freenect_zero_plane_info). The sensor crops
        # nothing, so that the centre of the image stands for the principal point.
        Camera(640, 480, 575.816, 575.816, 319.5, 239.5, "kinect_v1"),
        # The stream at half size; 285.63 px is OpenNI's focal length, the one public 320x240 recordings use.
        Camera(320, 240, 285.63, 285.63, 160.0, 120.0, "kinect_v1_qvga"),
        # Kinect v2: factory calibration that libfreenect2 reads from the device (IrCameraParams); other devices
        # lie within 1 % (libfreenect2 issue 670: 362.3, 362.5, 260.1, 206.0).
        Camera(512, 424, 365.456, 365.456, 254.878, 205.395, "kinect_v2"),
        # Azure Kinect, NFOV unbinned: factory calibration as k4a_calibration_get_from_raw gives it
        # (503.93, 503.98 on one device); nominal field 75 x 65 degrees. The principal point lies low in the image.
        Camera(640, 576, 503.93, 503.98, 320.0, 328.0, "azure_kinect"),
        # RealSense D435, rectified depth: `rs-enumerate-devices -c` gives 424.23 px at 848 px wide and 384.21 px
        # at 640x480, another scaling of the imager, not a crop of 848 (realsense-ros issue 2788).
        Camera(848, 480, 424.23, 424.23, 423.43, 236.05, "realsense_d435"),
        Camera(640, 480, 384.21, 384.21, 319.48, 236.35, "realsense_d435_vga"),
    )
}
"""Camera presets by name. Lens distortion is left out: drivers hand out rectified depth, or nearly so."""


def camera_named(name: str) -> Camera:
    """Looks a preset up.

    Args:
        name: Key of `CAMERAS`.

    Returns:
        The camera.

    Raises:
        ValueError: The name is unknown; the message lists the known ones.
    """
    if name not in CAMERAS:
        raise ValueError(f"camera {name!r} is unknown; known cameras: {', '.join(sorted(CAMERAS))}")
    return CAMERAS[name]


def free_camera(width: int, height: int, hfov: float) -> Camera:
    """Makes a camera with square pixels, its axis through the middle of the image.

    Args:
        width: Image width in pixels.
        height: Image height in pixels.
        hfov: Horizontal field of view [rad], between the outer borders of the outer pixels.

    Returns:
        The camera, named "custom".

    Raises:
        ValueError: The field of view is not in (0, pi), or the size is not one a `Camera` may have.
    """
    if not 0.0 < hfov < math.pi:
        raise ValueError(f"hfov={hfov} must be in (0, pi) radians")
    focal = 0.5 * width / math.tan(0.5 * hfov)
    return Camera(width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1))


@dataclass(frozen=True)
class Mounting:
    """Where a camera may stand; scenes draw uniformly from the ranges.

    Attributes:
        height: Range of the optical centre's height above the floor [m].
        pitch: Range of the optical axis's angle below the horizon [rad]; negative looks up.
        distance: Range of the horizontal distance to the person [m].
    """

    height: tuple[float, float]
    pitch: tuple[float, float]
    distance: tuple[float, float]

    def __post_init__(self) -> None:
        """Refuses ranges that are reversed or absurd."""
        for field, low, high in (("height", 0.0, 5.0), ("pitch", -1.5, 1.5), ("distance", 0.1, 20.0)):
            a, b = getattr(self, field)
            if not low <= a <= b <= high:
                raise ValueError(f"mounting {field}=({a}, {b}) must be an ascending range within [{low}, {high}]")


MOUNTINGS: dict[str, Mounting] = {
    # A tripod or shelf in a room: seated to standing eye height, 1 to 5 m off.
    "any": Mounting((0.5, 2.2), (math.radians(-10.0), math.radians(30.0)), (1.0, 5.0)),
    "tripod": Mounting((0.8, 1.8), (math.radians(-5.0), math.radians(15.0)), (1.5, 4.5)),
    # The head camera of service robots: TurtleBot's upper deck to Pepper and PR2 (about 1.0 to 1.6 m).
    "robot": Mounting((1.0, 1.6), (math.radians(-5.0), math.radians(20.0)), (1.0, 4.0)),
    # On a desk or monitor (desks are 0.70 to 0.75 m high), the person before it.
    "desk": Mounting((0.7, 1.2), (math.radians(-15.0), math.radians(15.0)), (0.6, 2.0)),
}
"""Mountings by name."""


def mounting_named(name: str) -> Mounting:
    """Looks a mounting up.

    Args:
        name: Key of `MOUNTINGS`.

    Returns:
        The mounting.

    Raises:
        ValueError: The name is unknown; the message lists the known ones.
    """
    if name not in MOUNTINGS:
        raise ValueError(f"mounting {name!r} is unknown; known mountings: {', '.join(sorted(MOUNTINGS))}")
    return MOUNTINGS[name]
