"""What forests eat: depth images with pixel labels and joints, as arrays."""

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

_Result = TypeVar("_Result")

FACT_LIMIT = 2000
"""Greatest value of a fact in `Hints`."""
MOST_FACTS = 256
OMITTED_IF_DEFAULT = {"is_omitted_if_default": True}
"""Of a dataclass' field: JSON of the dataclass lacks it where it has its default, as in files of earlier versions."""


class Pinhole(Protocol):
    """Intrinsics of a camera in OpenCV axes, pixel centres at integers: u = fx * X / Z + cx."""

    @property
    def fx(self) -> float:
        """Focal length along u [px]."""
        ...

    @property
    def fy(self) -> float:
        """Focal length along v [px]."""
        ...

    @property
    def cx(self) -> float:
        """Principal point u [px]."""
        ...

    @property
    def cy(self) -> float:
        """Principal point v [px]."""
        ...


@dataclass(frozen=True)
class Intrinsics:
    """A pinhole camera by its four numbers [px]."""

    fx: float
    fy: float
    cx: float
    cy: float


@dataclass(frozen=True)
class LabelTable:
    """What the numbers in a label image mean: 0 background, the body parts, the occluder classes, the surroundings.

    Attributes:
        parts: Names of the labels 1..n_parts.
        occluders: Names of the labels n_parts+1..n_parts+n_occluders.
        joints: Names of the joints, in the order of every joint array.
        surroundings: Names of the labels after these: floor, walls, other people. They tell nothing of the person, and
            vote for no joint.
    """

    parts: tuple[str, ...]
    occluders: tuple[str, ...]
    joints: tuple[str, ...]
    surroundings: tuple[str, ...] = field(default=(), metadata=OMITTED_IF_DEFAULT)

    def __post_init__(self) -> None:
        if not self.parts or not self.joints:
            raise ValueError("a label table needs at least one body part and one joint")
        n_others = len(self.occluders) + len(self.surroundings)
        if len(self.parts) + n_others > 254:
            raise ValueError(f"{len(self.parts)} parts and {n_others} occluders exceed 254 labels")

    @property
    def n_parts(self) -> int:
        """Number of body parts."""
        return len(self.parts)

    @property
    def n_labels(self) -> int:
        """Number of labels, the background not counted."""
        return len(self.parts) + len(self.occluders) + len(self.surroundings)

    @property
    def n_joints(self) -> int:
        """Number of joints."""
        return len(self.joints)


@dataclass(frozen=True)
class Hints:
    """What trees may ask of a frame beside its depth, in experiments.

    These are truths, to bound what knowing them is worth, or what another forest has predicted.

    Attributes:
        classes: (height, width) uint8, a class by pixel of the composite, 0 = none; None = none is told.
        facts: (n_facts,) int16 of the whole frame, within +-FACT_LIMIT; something that holds or not is FACT_LIMIT
            or 0.
    """

    classes: NDArray[np.uint8] | None = None
    facts: NDArray[np.int16] = field(default_factory=lambda: np.zeros(0, np.int16))

    def __post_init__(self) -> None:
        if self.classes is not None and (self.classes.ndim != 2 or self.classes.dtype != np.uint8):
            raise ValueError(
                f"classes are {self.classes.dtype} {self.classes.shape}, must be uint8 (height, width)"
            )
        if self.facts.ndim != 1 or self.facts.dtype != np.int16:
            raise ValueError(f"facts are {self.facts.dtype} {self.facts.shape}, must be int16 (n_facts,)")
        if len(self.facts) > MOST_FACTS or np.abs(self.facts.astype(np.int32)).max(initial=0) > FACT_LIMIT:
            raise ValueError(f"there may be {MOST_FACTS} facts at most, each within +-{FACT_LIMIT}")


@dataclass(frozen=True)
class DepthFrame:
    """One training or test image: what the sensor sees, and the person alone.

    Attributes:
        depth: (height, width) uint16 along the optical axis [mm], 0 = nothing.
        label: (height, width) uint8 by the label table, 0 where there is nothing.
        body_depth: (height, width) uint16, the person without the objects [mm].
        body_label: (height, width) uint8, parts of the person alone.
        joints: (n_joints, 3) float32, camera frame [m]; NaN = unknown.
        is_occluded: (n_joints,) bool, an object hides the joint.
        camera: Intrinsics.
        hints: What trees are told of it beside depth; None but in experiments.
        box: Upper-body box of a detector: left, top, right, bottom [px]; None = that of the true joints is used.
        is_self_occluded: (n_joints,) bool, another part of the person hides the joint; None = not told.
    """

    depth: NDArray[np.uint16]
    label: NDArray[np.uint8]
    body_depth: NDArray[np.uint16]
    body_label: NDArray[np.uint8]
    joints: NDArray[np.float32]
    is_occluded: NDArray[np.bool_]
    camera: Pinhole
    hints: Hints | None = None
    box: tuple[float, float, float, float] | None = None
    is_self_occluded: NDArray[np.bool_] | None = None


class FrameSequence(Protocol):
    """Frames by number, read one at a time, so that a corpus larger than memory can be learned from."""

    @property
    def labels(self) -> LabelTable:
        """What the label images mean."""
        ...

    def __len__(self) -> int:
        """Number of frames."""
        ...

    def __getitem__(self, index: int, /) -> DepthFrame:
        """Frame `index`, 0..len-1."""
        ...


@dataclass(frozen=True)
class FrameBatch:
    """A sequence of frames of one camera that lie in memory as arrays.

    Attributes:
        depth: (n, height, width) uint16 [mm], 0 = nothing.
        label: (n, height, width) uint8 by the label table.
        joints: (n, n_joints, 3) float32, camera frame [m]; NaN = unknown.
        camera: Intrinsics of all frames.
        labels: What the label images and joints mean.
        body_depth: (n, height, width) uint16, the person without the objects; None where nothing hides anyone:
            then the occluders' pixels of `depth` are cut out.
        body_label: (n, height, width) uint8, given with `body_depth`.
        is_occluded: (n, n_joints) bool, an object hides the joint; None = none is hidden.
    """

    depth: NDArray[np.uint16]
    label: NDArray[np.uint8]
    joints: NDArray[np.float32]
    camera: Pinhole
    labels: LabelTable
    body_depth: NDArray[np.uint16] | None = None
    body_label: NDArray[np.uint8] | None = None
    is_occluded: NDArray[np.bool_] | None = None

    def __post_init__(self) -> None:
        shape = self.depth.shape
        if len(shape) != 3:
            raise ValueError(f"depth has shape {shape}, must be (n, height, width)")
        n_joints = self.labels.n_joints
        _check("depth", self.depth, shape, np.uint16)
        _check("label", self.label, shape, np.uint8)
        _check("joints", self.joints, (shape[0], n_joints, 3), np.float32)
        if (self.body_depth is None) != (self.body_label is None):
            raise ValueError("body_depth and body_label must be given together")
        if self.body_depth is not None:
            _check("body_depth", self.body_depth, shape, np.uint16)
            _check("body_label", self.body_label, shape, np.uint8)
        if self.is_occluded is not None:
            _check("is_occluded", self.is_occluded, (shape[0], n_joints), np.bool_)
        if not (np.isfinite(self.joints).all(axis=2) | np.isnan(self.joints).all(axis=2)).all():
            raise ValueError("joints must be finite, or NaN in all coordinates where unknown")
        if self.label.size and int(self.label.max()) > self.labels.n_labels:
            raise ValueError(f"label {int(self.label.max())} is not in 0..{self.labels.n_labels}")

    def __len__(self) -> int:
        return len(self.depth)

    def __getitem__(self, index: int) -> DepthFrame:
        if not 0 <= index < len(self):
            raise IndexError(f"frame {index} is not in 0..{len(self) - 1}")
        depth, label = self.depth[index], self.label[index]
        if self.body_depth is None or self.body_label is None:
            is_body = label <= self.labels.n_parts
            body_depth, body_label = depth * is_body, label * is_body
        else:
            body_depth, body_label = self.body_depth[index], self.body_label[index]
        is_occluded = np.zeros(self.labels.n_joints, bool) if self.is_occluded is None else self.is_occluded[index]
        return DepthFrame(depth, label, body_depth, body_label, self.joints[index], is_occluded, self.camera)

    def __iter__(self) -> Iterator[DepthFrame]:
        return (self[i] for i in range(len(self)))


@dataclass(frozen=True)
class FrameSubset:
    """Some frames of a sequence, in the order given.

    Attributes:
        frames: The sequence.
        indices: Numbers in it.
    """

    frames: FrameSequence
    indices: tuple[int, ...]

    @property
    def labels(self) -> LabelTable:
        """What the label images mean."""
        return self.frames.labels

    def __len__(self) -> int:
        return len(self.indices)

    def __getitem__(self, index: int) -> DepthFrame:
        return self.frames[self.indices[index]]


def in_order(work: Callable[[int], _Result], n: int, n_threads: int) -> Iterator[_Result]:
    """Results of work on the numbers 0..n-1, in their order; it runs in threads, a little ahead of the reader."""
    if n_threads == 1:
        yield from map(work, range(n))
        return
    with ThreadPoolExecutor(n_threads) as pool:
        begun: deque[Future[_Result]] = deque()
        try:
            for number in range(n):
                begun.append(pool.submit(work, number))
                if len(begun) > 4 * n_threads:
                    yield begun.popleft().result()
            while begun:
                yield begun.popleft().result()
        finally:
            pool.shutdown(cancel_futures=True)


def is_known(joints: NDArray[np.float32]) -> NDArray[np.bool_]:
    """(...) bool, which of the joints (..., 3) are known."""
    return np.asarray(np.isfinite(joints).all(axis=-1))


def check_depth(depth: np.ndarray) -> NDArray[np.uint16]:
    """A depth image as the forests read it.

    Args:
        depth: (height, width) integers [mm], 0 = nothing.

    Returns:
        (height, width) uint16, contiguous.

    Raises:
        ValueError: Another shape, or values that are no integer millimetres up to 65,535.
    """
    image = np.asarray(depth)
    if image.ndim != 2 or 0 in image.shape:
        raise ValueError(f"depth has shape {image.shape}, must be (height, width)")
    if image.dtype == np.uint16:
        return np.ascontiguousarray(image)
    if not np.issubdtype(image.dtype, np.integer):
        raise ValueError(f"depth is {image.dtype}, must be integer millimetres (0 = nothing); metres times 1000?")
    if image.min() < 0 or image.max() > 65535:
        raise ValueError(f"depth spans {image.min()}..{image.max()}, must be in 0..65535 millimetres")
    return image.astype(np.uint16)


def _check(name: str, values: np.ndarray | None, shape: tuple[int, ...], dtype: type) -> None:
    if values is None or values.shape != shape or values.dtype != dtype:
        given = "None" if values is None else f"{values.dtype} {values.shape}"
        raise ValueError(f"{name} is {given}, must be {np.dtype(dtype).name} {shape}")
