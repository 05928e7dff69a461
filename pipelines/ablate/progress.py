"""One progress bar over all the work of an ablation, in seconds that the work would take on two cores."""

import contextlib
from collections.abc import Callable, Iterator

from forests.oarf.config import OARFConfig
from pipelines.ablate.jobs import CorpusJob, ScoringJob, TrainingJob
from pipelines.progress import Progress

Job = CorpusJob | TrainingJob | ScoringJob
SetShare = Callable[[float], object]
"""Told the share of a piece of work that is done, 0..1."""

_FRAME_S = 0.015
"""To make a frame."""
_SAMPLE_S = 11e-6
"""To train a tree of a regression forest, by sample."""
_POINT_S = 7e-6
"""To train a tree of a random walk forest, by point."""
_OARF_VAL_FRAME_S, _RWF_VAL_FRAME_S = 0.04, 0.12
"""To tune on a frame; random walk forests do so in one thread."""
_TEST_FRAME_S = 0.01
"""To score a frame."""


def cost(job: Job) -> float:
    """About how long a piece of work takes [s]."""
    if isinstance(job, CorpusJob):
        return _FRAME_S * job.n_frames
    if isinstance(job, ScoringJob):
        return _TEST_FRAME_S * job.test.n
    forest = job.forest
    if isinstance(forest, OARFConfig):
        n_pixels = forest.n_pixels + (forest.mode != "baseline") * forest.n_occluder_pixels
        return _OARF_VAL_FRAME_S * job.val.n + _SAMPLE_S * forest.n_trees * n_pixels * job.train.n
    n_joints = len(forest.joints) or len(forest.skeleton)
    return _RWF_VAL_FRAME_S * job.val.n + _POINT_S * n_joints * forest.n_trees * forest.n_points * job.train.n


class WorkProgress:
    """How far all the work is.

    Args:
        total: Seconds of all work that is not yet done.
    """

    def __init__(self, total: float) -> None:
        self._total = total
        self._progress = Progress()

    def __enter__(self) -> "WorkProgress":
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.__exit__()

    @contextlib.contextmanager
    def step(self, name: str, seconds: float) -> Iterator[SetShare]:
        """One piece of work."""
        begun = self._progress.done
        self._progress.rename(name)

        def set_share(share: float) -> None:
            self._progress.set_done(begun + seconds / self._total * min(share, 1.0))

        yield set_share
        set_share(1.0)
