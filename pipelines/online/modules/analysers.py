"""The kinds of modules: models opened and asked, their answers as messages with stamp, track and probabilities."""

import importlib
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forests.boxes import Box
from forests.estimate import JointEstimate, JointPredictor
from forests.frames import Intrinsics
from pipelines.online.messages import OrientationResult, Request, Result, SkeletonResult
from pipelines.online.modules.jobs import Analyser, Job, ModuleSettings

HEAD_M = 0.17
"""The box of a head reaches so far to both sides of the middle of the upper body's [m], and twice as far down."""
SAME_M = 0.3
"""Axes nearer than this are one person's [m]."""
UPPER_WIDTH_M = 0.6
"""Width of a box around head and shoulders [m]."""


class Joints:
    """Joints by a forest or net, in the person cut out of the image.

    Random walks start in the middle of the box around head and shoulders.
    """

    def __init__(self, settings: ModuleSettings) -> None:
        from forests.kinds import load_model

        self._predictor = load_model(settings.model)
        self._is_walking = settings.kind == "walks"
        if self._is_walking and not self._predictor.box_joints:
            raise ValueError(f"{settings.model} holds no random walk forest, which module {settings.name} needs")
        self._predictor.predict(*_example(), (20.0, 8.0, 44.0, 30.0) if self._is_walking else None)

    def analyse(self, depth: NDArray[np.uint16], job: Job) -> list[Result]:
        """Answers a job."""
        return [answer for request in job.requests for answer in self._answer(depth, job, request)]

    def _answer(self, depth: NDArray[np.uint16], job: Job, request: Request) -> list[Result]:
        begun = time.perf_counter()
        person = cut_out(depth, job, request)
        if not person.any():
            return []
        estimate = self._predictor.predict(person, job.camera, request.upper_body if self._is_walking else None)
        if not np.isfinite(estimate.joints).any():
            return []
        result = skeleton_result(request, job.frame_id, self._predictor, estimate)
        return [replace(result, seconds=time.perf_counter() - begun)]


def cut_out(depth: NDArray[np.uint16], job: Job, request: Request) -> NDArray[np.uint16]:
    """(height, width) uint16 the image without what is not near a person [mm]."""
    from forests.finder.cutting import cut_axis

    # The person's own axis is among those of everybody found, unless another tracker has told of the person.
    off = np.linalg.norm(job.axes - request.axis, axis=1)
    is_own = off.size > 0 and off.min() < SAME_M
    axes = job.axes if is_own else np.vstack([job.axes, request.axis])
    return cut_axis(depth, job.camera, axes, int(off.argmin()) if is_own else len(axes) - 1, job.floor)


class Orientation:
    """Which way people's bodies or heads face, by an exported net; all people of an image at once."""

    def __init__(self, settings: ModuleSettings) -> None:
        from nets.deployed import DeployedOrientation

        self._net = DeployedOrientation(settings.model)
        self._net.ask(self._net.patch(*_example(), (20.0, 8.0, 44.0, 30.0))[None])

    def analyse(self, depth: NDArray[np.uint16], job: Job) -> list[Result]:
        """Answers a job."""
        begun = time.perf_counter()
        asked, patches = [], []
        for request in job.requests:
            box = head_box(request.upper_body) if self._net.region == "head" else request.box
            try:
                patches.append(self._net.patch(depth, job.camera, box))
            except ValueError:
                continue  # The image shows nothing there.
            asked.append(request)
        if not asked:
            return []
        facing = self._net.ask(np.stack(patches))
        seconds = (time.perf_counter() - begun) / len(asked)
        return [
            OrientationResult(r.stamp, job.frame_id, r.track_id, r.module, seconds, self._net.region, *found)
            for r, found in zip(asked, facing, strict=True)
        ]


def _example() -> tuple[NDArray[np.uint16], Intrinsics]:
    """An image that shows something, and its camera: whoever is asked about it once has everything loaded."""
    depth = np.zeros((48, 64), np.uint16)
    depth[8:40, 20:44] = 2000
    return depth, Intrinsics(40.0, 40.0, 32.0, 24.0)


def head_box(upper_body: Box) -> Box:
    """The box of the head that a box around head and shoulders has [px]."""
    left, top, right, _ = upper_body
    middle, half = (left + right) / 2.0, HEAD_M * (right - left) / UPPER_WIDTH_M
    return middle - half, top, middle + half, top + 2.0 * half


def skeleton_result(
    request: Request, frame_id: str, predictor: JointPredictor, estimate: JointEstimate
) -> SkeletonResult:
    """What a forest has found, as a message whose `seconds` is still 0."""
    is_found = np.isfinite(estimate.joints).all(axis=1)
    return SkeletonResult(
        request.stamp,
        frame_id,
        request.track_id,
        request.module,
        0.0,
        predictor.joints,
        estimate.joints.copy(),
        np.where(is_found, estimate.probability, np.float32(0)),
        np.where(is_found, estimate.spread, np.float32(np.inf)),
        estimate.hidden_probability,
    )


OPENERS: Mapping[str, Callable[[ModuleSettings], Analyser]] = {
    "walks": Joints,
    "skeleton": Joints,
    "orientation": Orientation,
}
"""By kind."""


def open_analyser(settings: ModuleSettings) -> Analyser:
    """Opens the model of a module.

    Args:
        settings: Their kind is a name that `OPENERS` has, or `package.module:function`, which is called with them.

    Raises:
        ValueError: An unknown kind, or a model that cannot be used.
    """
    if ":" in settings.kind:
        module, _, name = settings.kind.partition(":")
        opener: Callable[[ModuleSettings], Analyser] = getattr(importlib.import_module(module), name)
        return opener(settings)
    if settings.kind not in OPENERS:
        raise ValueError(f"module {settings.name} is of kind {settings.kind!r}; known are {', '.join(OPENERS)}")
    if not Path(settings.model).is_file():
        raise ValueError(f"there is no file {settings.model}, which module {settings.name} needs")
    return OPENERS[settings.kind](settings)
