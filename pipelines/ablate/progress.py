"""One progress bar over all the work of an ablation, in seconds that the work would take on two cores."""

import contextlib
from collections.abc import Callable, Iterator

from tqdm import tqdm

from forests.oarf.config import OARFConfig
from pipelines.ablate.jobs import CorpusJob, ScoringJob, TrainingJob

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
