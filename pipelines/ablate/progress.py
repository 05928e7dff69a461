"""One progress bar over all the work of an ablation, in seconds that the work would take on two cores."""

import contextlib
from collections.abc import Callable, Iterator

from pipelines.ablate.jobs import CorpusJob, ScoringJob, TrainingJob
from pipelines.progress import Progress

Job = CorpusJob | TrainingJob | ScoringJob
SetShare = Callable[[float], object]
"""Told the share of a piece of work that is done, 0..1."""

_FRAME_S = 0.015
"""To make a frame."""
_TEST_FRAME_S = 0.01
"""To score a frame."""


def cost(job: Job) -> float:
    """About how long a piece of work takes [s]."""
    if isinstance(job, CorpusJob):
        return _FRAME_S * job.n_frames
    if isinstance(job, ScoringJob):
        return _TEST_FRAME_S * job.test.n
    return job.kind.training_s(job.config, job.train.n, job.val.n)


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
