"""What a module is, what it is asked, and what it says: the contract of modules and of those who run them."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from forests.finder.floor import Floor
from forests.frames import Intrinsics
from pipelines.online.messages import CameraFrame, Notice, Request, Result


@dataclass(frozen=True)
class ModuleSettings:
    """A module, and how the planner treats it.

    Attributes:
        name: Of the module.
        kind: What it finds: walks, skeleton or orientation; or another name that `analysers.OPENERS` has.
        model: File of its model.
        interval_s: A younger answer is not renewed [s].
        reach_m: People farther away are not asked about [m].
        weight: Factor of the priority of its requests.
        cost_s: What an answer is taken to cost until it is known [s].
    """

    name: str
    kind: str
    model: str
    interval_s: float = 0.0
    reach_m: float = 8.0
    weight: float = 1.0
    cost_s: float = 0.003

    def __post_init__(self) -> None:
        for name in ("reach_m", "weight", "cost_s"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise ValueError(f"{name}={getattr(self, name)} of module {self.name} must be above 0")
        if not self.interval_s >= 0:
            raise ValueError(f"interval_s={self.interval_s} of module {self.name} must be at least 0")


@dataclass(frozen=True)
class Job:
    """What a module is asked about one image.

    Attributes:
        stamp: Of the image [ns].
        frame_id: The camera's frame of reference.
        camera: Intrinsics.
        floor: The floor; None = not known.
        axes: (n, 3) float64, a point on the axis of everybody found in the image, camera frame [m].
        requests: Whom to analyse.
    """

    stamp: int
    frame_id: str
    camera: Intrinsics
    floor: Floor | None
    axes: NDArray[np.float64]
    requests: tuple[Request, ...]


class Analyser(Protocol):
    """An opened model that answers requests."""

    def analyse(self, depth: NDArray[np.uint16], job: Job) -> list[Result]:
        """Answers all requests of a job; those about which nothing can be said are left out.

        Args:
            depth: (height, width) uint16 [mm], 0 = nothing; it must not be kept.
            job: What is asked.
        """
        ...


class Told(NamedTuple):
    """What came of modules since they were asked last.

    Attributes:
        results: In the order in which they came.
        notices: What went wrong.
    """

    results: tuple[Result, ...] = ()
    notices: tuple[Notice, ...] = ()


class Modules(Protocol):
    """Those who run modules."""

    @property
    def settings(self) -> tuple[ModuleSettings, ...]:
        """The modules."""
        ...

    def is_up(self, name: str) -> bool:
        """Whether a module can be asked now."""
        ...

    def submit(self, frame: CameraFrame, jobs: dict[str, Job]) -> None:
        """Asks modules about an image.

        Args:
            frame: The image.
            jobs: By name of the module.
        """
        ...

    def collect(self, timeout_s: float = 0.0) -> Told:
        """What modules have said; waits for the first word, but not longer than told."""
        ...

    def is_busy(self) -> bool:
        """Whether answers, or modules that are restarted, are still to come."""
        ...

    def close(self) -> None:
        """Ends all modules."""
        ...
