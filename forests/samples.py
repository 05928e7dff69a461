"""Training pixels: which are drawn from a frame, and what is kept of them."""

from collections.abc import Callable
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from forests.crops import Crops, CropWriter
from forests.frames import DepthFrame, FrameSequence, in_order
from forests.hashing import hash4

Layer = Literal["composite", "body"]
"""Which image is learned from: what the sensor sees, or the person without the objects."""

_PIXEL_STREAM = 0x51A3


class Samples(NamedTuple):
    """Pixels of many frames, in order of frame and, in a frame, of row and column.

    Attributes:
        frame: (n,) int32, rising.
        x: (n,) int16, column in the frame's crop.
        y: (n,) int16, row in the frame's crop.
        z_mm: (n,) uint16, depth that scales the features' offsets [mm], above 0.
        label: (n,) uint8, by the label table, above 0.
    """

    frame: NDArray[np.int32]
    x: NDArray[np.int16]
    y: NDArray[np.int16]
    z_mm: NDArray[np.uint16]
    label: NDArray[np.uint8]

    def points(self, crops: Crops) -> NDArray[np.float32]:
        """(n, 3) float32, the pixels lifted into the camera frame [m]."""
        fx, fy, cx, cy = crops.intrinsics[self.frame].T
        z = self.z_mm * np.float32(1e-3)
        u = self.x + crops.origin[self.frame, 0].astype(np.float32)
        v = self.y + crops.origin[self.frame, 1].astype(np.float32)
        return np.stack([(u - cx) * z / fx, (v - cy) * z / fy, z], axis=1).astype(np.float32)


_NO_SAMPLES = Samples(
    np.empty(0, np.int32),
    np.empty(0, np.int16),
    np.empty(0, np.int16),
    np.empty(0, np.uint16),
    np.empty(0, np.uint8),
)


class TrainingSet(NamedTuple):
    """What is learned from.

    Attributes:
        crops: The depth images.
        samples: Pixels of them.
        joints: (n_frames, n_joints, 3) float32, camera frame [m]; NaN = unknown.
    """

    crops: Crops
    samples: Samples
    joints: NDArray[np.float32]


def gather(
    frames: FrameSequence,
    layer: Layer,
    n_body_pixels: int,
    n_occluder_pixels: int,
    seed: int,
    max_bytes_in_memory: int = 2**31,
    folder: Path | None = None,
    n_threads: int = 1,
    on_frame: Callable[[], object] = lambda: None,
) -> TrainingSet:
    """Reads every frame once, keeps its crop, and draws pixels from it.

    `gather_some` does it for a part of the frames.

    A pixel's chance depends on (seed, frame, row, column) alone: the body's pixels that both layers show are
    drawn or left out in both. Hints tell of the composite; the body layer is learned without them.

    Args:
        frames: The frames.
        layer: Which image is learned from.
        n_body_pixels: Pixels drawn from the person in a frame (all, if there are fewer).
        n_occluder_pixels: Pixels drawn from the objects in a frame; the body layer has none.
        seed: Of the drawing.
        max_bytes_in_memory: Crops larger than this are mapped from a temporary file.
        folder: Where that file lies; the system's temporary folder if None.
        n_threads: Threads that read frames; what is gathered does not depend on it.
        on_frame: Called after each frame.

    Raises:
        ValueError: No frame shows anything, or hints of some frames alone.
    """
    training = gather_some(
        frames, layer, n_body_pixels, n_occluder_pixels, seed, 0, max_bytes_in_memory, folder, n_threads, on_frame
    )
    refuse_nothing(training.samples, len(frames), layer)
    return training


def refuse_nothing(samples: Samples, n_frames: int, layer: Layer) -> None:
    """Makes sure that there is a pixel to learn from.

    Raises:
        ValueError: There is none.
    """
    if len(samples.frame) == 0:
        raise ValueError(f"none of the {n_frames} frames shows a labelled pixel in the {layer} layer")


def gather_some(
    frames: FrameSequence,
    layer: Layer,
    n_body_pixels: int,
    n_occluder_pixels: int,
    seed: int,
    first: int,
    max_bytes_in_memory: int = 2**31,
    folder: Path | None = None,
    n_threads: int = 1,
    on_frame: Callable[[], object] = lambda: None,
) -> TrainingSet:
    """As `gather`, for the frames of a longer sequence from number `first` on; frames that show nothing are allowed.

    Frames are numbered from 0 in what is given back; which pixels are drawn depends on their number in the sequence.
    """
    parts: list[Samples] = [_NO_SAMPLES]
    joints = np.empty((len(frames), frames.labels.n_joints, 3), np.float32)
    with CropWriter(max_bytes_in_memory, folder) as writer:
        for index, frame in enumerate(in_order(frames.__getitem__, len(frames), n_threads)):
            depth, label = image_of(frame, layer)
            origin = writer.add(depth, frame.camera, frame.hints if layer == "composite" else None)
            joints[index] = frame.joints
            drawn = draw_pixels(
                label, frames.labels.n_parts, n_body_pixels, n_occluder_pixels, seed, first + index
            )
            parts.append(_samples_of(index, depth, label, origin, drawn))
            on_frame()
        samples = Samples(*(np.concatenate(column) for column in zip(*parts, strict=True)))
        return TrainingSet(writer.finish(), samples, joints)


def image_of(frame: DepthFrame, layer: Layer) -> tuple[NDArray[np.uint16], NDArray[np.uint8]]:
    """(depth, label) of a frame's layer; a pixel that a noisy sensor left without depth has no label."""
    if layer == "body":
        return frame.body_depth, frame.body_label
    return frame.depth, frame.label * (frame.depth > 0)


def draw_pixels(
    label: NDArray[np.uint8], n_parts: int, n_body_pixels: int, n_occluder_pixels: int, seed: int, frame: int
) -> NDArray[np.int32]:
    """Draws pixels of one label image without replacement.

    Returns:
        (n, 2) int32, rows and columns, in order of row, then column.
    """
    rows, columns, keys, is_body = _labelled_pixels(label, n_parts, seed, frame)
    kept = np.sort(
        np.concatenate([_lowest(keys, is_body, n_body_pixels), _lowest(keys, ~is_body, n_occluder_pixels)])
    )
    return np.stack([rows[kept], columns[kept]], axis=1)


def _lowest(keys: NDArray[np.uint64], is_of_kind: NDArray[np.bool_], n: int) -> NDArray[np.int64]:
    places = np.flatnonzero(is_of_kind)
    if len(places) <= n:
        return places
    return places[np.argpartition(keys[places], n)[:n]]


@njit(cache=True, nogil=True)
def _labelled_pixels(
    label: np.ndarray, n_parts: int, seed: int, frame: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    height, width = label.shape
    n = 0
    for y in range(height):
        for x in range(width):
            n += label[y, x] != 0
    rows, columns = np.empty(n, np.int32), np.empty(n, np.int32)
    keys, is_body = np.empty(n, np.uint64), np.empty(n, np.bool_)
    k = 0
    for y in range(height):
        for x in range(width):
            if label[y, x] != 0:
                rows[k] = y
                columns[k] = x
                keys[k] = hash4(seed, _PIXEL_STREAM, frame, y * width + x)
                is_body[k] = label[y, x] <= n_parts
                k += 1
    return rows, columns, keys, is_body


def _samples_of(
    index: int,
    depth: NDArray[np.uint16],
    label: NDArray[np.uint8],
    origin: tuple[int, int],
    drawn: NDArray[np.int32],
) -> Samples:
    row, column = drawn.T
    return Samples(
        np.full(len(drawn), index, np.int32),
        (column - origin[0]).astype(np.int16),
        (row - origin[1]).astype(np.int16),
        depth[row, column],
        label[row, column],
    )
