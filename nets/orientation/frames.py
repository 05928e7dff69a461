"""What orientation nets learn from: depth images with the person's box and angles, and patches cut out of them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from forests.boxes import Box
from forests.frames import Pinhole
from nets.orientation.config import Region
from nets.patches import Patch, body_window, cut_patch, head_window
from nets.views import View


class Truth(NamedTuple):
    """Which way somebody faces.

    Attributes:
        angle: Heading of the body or pan of the head: 0 = towards the camera, pi / 2 = towards the image's right
            [rad]; NaN = not known.
        tilt: Of the head, upwards [rad]; NaN = not known.
        roll: Of the head, towards the own right shoulder [rad]; NaN = not known.
        posture: Code in `POSTURES`; -1 = not known.
    """

    angle: float
    tilt: float
    roll: float
    posture: int


@dataclass(frozen=True)
class OrientedFrame:
    """A depth image of one person.

    Attributes:
        depth: (height, width) uint16 [mm], 0 = nothing.
        kind: (height, width) uint8: 0 nothing, 1 the person, 2 an object.
        camera: Intrinsics.
        box: Of the region in question [px].
        truth: Which way the person faces.
    """

    depth: NDArray[np.uint16]
    kind: NDArray[np.uint8]
    camera: Pinhole
    box: Box
    truth: Truth


class OrientedFrames(Protocol):
    """Frames by number, read one at a time."""

    def __len__(self) -> int:
        """Number of frames."""
        ...

    def __getitem__(self, index: int, /) -> OrientedFrame | None:
        """Frame `index`, 0..len-1; None if the region is not in the image or its angle is not known."""
        ...


class Patches(NamedTuple):
    """Patches of many frames, with their truth.

    Attributes:
        relative: (n, height, width) int16, see `nets.patches.Patch`.
        kind: (n, height, width) uint8.
        angle: (n,) float32 [rad].
        tilt: (n,) float32 [rad]; NaN = not known.
        roll: (n,) float32 [rad]; NaN = not known.
        posture: (n,) int64, code in `POSTURES`; -1 = not known.
    """

    relative: NDArray[np.int16]
    kind: NDArray[np.uint8]
    angle: NDArray[np.float32]
    tilt: NDArray[np.float32]
    roll: NDArray[np.float32]
    posture: NDArray[np.int64]


def patch_of(
    region: Region,
    view: View,
    depth: NDArray[np.uint16],
    camera: Pinhole,
    box: Box,
    kind: NDArray[np.uint8] | None = None,
) -> Patch:
    """The patch of a region, with its margin.

    Args:
        region: body or head.
        view: What is looked at.
        depth: (height, width) uint16 [mm], 0 = nothing.
        camera: Intrinsics.
        box: Of the region [px].
        kind: (height, width) uint8; None = not told.

    Raises:
        ValueError: An empty box, or one in which the image shows nothing.
    """
    if region == "body":
        window = body_window(depth, camera, box, view.height * view.pixel_m)
    else:
        window = head_window(depth, camera, box)
    return cut_patch(depth, camera, window, view.patch, view.pixel_m, kind)


def collect_patches(
    frames: OrientedFrames, region: Region, view: View, on_frame: Callable[[], object] = lambda: None
) -> Patches:
    """Cuts the patches of all frames whose angle is known.

    Args:
        frames: The frames.
        region: body or head.
        view: What is looked at.
        on_frame: Told of each frame that is done.
    """
    patches, truths = [], []
    for place in range(len(frames)):
        frame = frames[place]
        on_frame()
        if frame is not None:
            patches.append(patch_of(region, view, frame.depth, frame.camera, frame.box, frame.kind))
            truths.append(frame.truth)
    shape = (len(patches), *view.patch)
    return Patches(
        np.array([patch.relative for patch in patches], np.int16).reshape(shape),
        np.array([patch.kind for patch in patches], np.uint8).reshape(shape),
        np.array([truth.angle for truth in truths], np.float32),
        np.array([truth.tilt for truth in truths], np.float32),
        np.array([truth.roll for truth in truths], np.float32),
        np.array([truth.posture for truth in truths], np.int64),
    )
