"""Depth images and cameras out of messages of ROS 1 and ROS 2."""

import struct
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from forests.frames import Intrinsics
from pipelines.online.messages import NS

ENCODINGS = {"16UC1": np.uint16, "mono16": np.uint16, "32FC1": np.float32}
"""Types of the pixels of depth images: millimetres, or metres if they are reals."""
_PNG = b"\x89PNG"
_COMPRESSED_DEPTH_HEADER = 12
"""Bytes before the picture in compressedDepth: a code and the two numbers of the quantisation."""


class DecodeError(ValueError):
    """An image that cannot be used.

    Attributes:
        kind: The same for the same cause.
    """

    def __init__(self, kind: str, sentence: str) -> None:
        super().__init__(sentence)
        self.kind = kind


def stamp_of(message: Any, otherwise: int) -> int:
    """When an image was taken [ns]; `otherwise` if its header does not say."""
    time = message.header.stamp
    fraction = time.nanosec if hasattr(time, "nanosec") else time.nsec
    stamp = int(time.sec if hasattr(time, "sec") else time.secs) * NS + int(fraction)
    return stamp or otherwise


def camera_of(info: Any) -> Intrinsics:
    """The intrinsics of a CameraInfo, those of the rectified image if they are told.

    Raises:
        DecodeError: They are not told.
    """
    rectified = np.asarray(info.p if hasattr(info, "p") else info.P, np.float64)
    raw = np.asarray(info.k if hasattr(info, "k") else info.K, np.float64)
    fx, cx, fy, cy = rectified[[0, 2, 5, 6]] if rectified[0] > 0 else raw[[0, 2, 4, 5]]
    if not (np.isfinite([fx, fy, cx, cy]).all() and fx > 0 and fy > 0):
        raise DecodeError("unusable camera infos", f"a CameraInfo has the focal lengths {fx:g} and {fy:g}")
    return Intrinsics(float(fx), float(fy), float(cx), float(cy))


def depth_of(message: Any) -> NDArray[np.uint16]:
    """(height, width) uint16 [mm] of an Image or a CompressedImage.

    Raises:
        DecodeError: Another encoding, or a damaged image.
    """
    return _compressed(message) if hasattr(message, "format") else _plain(message)


def millimetres(metres: NDArray[np.floating]) -> NDArray[np.uint16]:
    """Depth in millimetres; 0 where it is not finite, not above 0, or beyond 65 m."""
    values = np.nan_to_num(np.asarray(metres, np.float64) * 1e3, nan=0.0, posinf=0.0, neginf=0.0)
    return np.where((values > 0) & (values <= 65535), np.rint(values), 0).astype(np.uint16)


def _plain(message: Any) -> NDArray[np.uint16]:
    height, width, encoding = int(message.height), int(message.width), str(message.encoding)
    if encoding not in ENCODINGS:
        raise DecodeError(
            f"images of encoding {encoding}",
            f"an image of encoding {encoding!r} is left out; depth has one of {', '.join(ENCODINGS)}",
        )
    kind = np.dtype(ENCODINGS[encoding]).newbyteorder(">" if message.is_bigendian else "<")
    data, step = np.asarray(message.data, np.uint8), int(message.step)
    if 0 in (height, width) or step < width * kind.itemsize or len(data) < height * step:
        raise DecodeError(
            "damaged images",
            f"an image of {width} x {height} with {len(data)} bytes and {step} bytes a row is left out",
        )
    rows = data[: height * step].reshape(height, step)[:, : width * kind.itemsize]
    values = np.ascontiguousarray(rows).view(kind)
    return millimetres(values) if kind.kind == "f" else values.astype(np.uint16)


def _compressed(message: Any) -> NDArray[np.uint16]:
    data, said = np.asarray(message.data, np.uint8).tobytes(), str(message.format)
    is_depth = "compressedDepth" in said
    picture = data[_COMPRESSED_DEPTH_HEADER:] if is_depth and data[:4] != _PNG else data
    if picture[:4] != _PNG:
        raise DecodeError(
            f"images of format {said}", f"a compressed image of format {said!r} is left out: it is no PNG"
        )
    values = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_UNCHANGED)
    if values is None or values.ndim != 2 or values.dtype != np.uint16:
        what = "damaged" if values is None else f"{values.dtype} of shape {values.shape}, no 16-bit depth"
        raise DecodeError("damaged images", f"a compressed image is left out: it is {what}")
    if not (is_depth and "32FC1" in said):
        return np.asarray(values, np.uint16)
    a, b = struct.unpack_from("<ff", data, 4)
    with np.errstate(divide="ignore", invalid="ignore"):
        return millimetres(np.where(values > 0, a / (values.astype(np.float64) - b), 0.0))
