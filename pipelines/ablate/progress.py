"""One progress bar over all the work of an ablation, in seconds that the work would take on two cores."""

import contextlib
from collections.abc import Callable, Iterator

from tqdm import tqdm

from pipelines.ablate.jobs import CorpusJob, ScoringJob, TrainingJob

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


class Progress:
    """The bar.

    Args:
        total: Seconds of all work that is not yet done.
    """

    def __init__(self, total: float) -> None:
        layout = "{desc} {percentage:3.0f}%|{bar}| {elapsed}<{remaining}"
        self._bar = tqdm(total=total, bar_format=layout, delay=2.0, smoothing=0.0, dynamic_ncols=True)

    def __enter__(self) -> "Progress":
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.close()

    @contextlib.contextmanager
    def step(self, name: str, seconds: float) -> Iterator[SetShare]:
        """One piece of work."""
        begun = self._bar.n
        self._bar.set_description_str(name)

        def set_share(share: float) -> None:
            self._bar.update(max(0.0, begun + seconds * min(share, 1.0) - self._bar.n))

        yield set_share
        set_share(1.0)
