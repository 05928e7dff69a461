"""How a tree is grown."""

from dataclasses import dataclass

from storage.ranges import check_fields


@dataclass(frozen=True)
class GrowthConfig:
    """How a tree is grown.

    A node's candidates are judged twice, so that many can be tried in every node: all of them on a few samples,
    the best of them on many.

    Attributes:
        max_depth: Decisions on the longest way down.
        n_candidates: Features drawn per node.
        candidates_per_sample: A small node draws no more features than so many a sample: few samples cannot tell
            many candidates apart.
        n_thresholds: Thresholds tried per feature.
        max_samples_per_split: Samples of a node that the finalists are judged on; a larger node is judged on so
            many, drawn by hash.
        n_racing_samples: Samples of a node that all candidates are judged on first.
        n_finalists: Candidates that are judged again.
        min_samples_leaf: Fewest samples of a child.
        max_offset_m: Longest offset of a probe [m].
    """

    max_depth: int = 20
    n_candidates: int = 2000
    candidates_per_sample: int = 2
    n_thresholds: int = 32
    max_samples_per_split: int = 5000
    n_racing_samples: int = 128
    n_finalists: int = 50
    min_samples_leaf: int = 20
    max_offset_m: float = 0.6

    def __post_init__(self) -> None:
        check_fields(self, _RANGES)
        if not self.max_offset_m > 0.0:
            raise ValueError(f"max_offset_m={self.max_offset_m} must be above 0")


_RANGES = {
    "max_depth": (0, 60),
    "n_candidates": (1, 2**20),
    "candidates_per_sample": (1, 2**20),
    "n_thresholds": (3, 256),
    "max_samples_per_split": (2, 2**24),
    "n_racing_samples": (2, 2**24),
    "n_finalists": (1, 2**20),
    "min_samples_leaf": (1, 2**31 - 1),
    "max_offset_m": (0.0, 10.0),
}
"""A node at depth 60 still has a number in the full binary tree that fits into int64."""
