"""Growing one tree on several threads, with the same result for any number of them."""

from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.crops import Crops
from forests.growing.buffers import Target
from forests.growing.config import GrowthConfig
from forests.growing.crew import Call, Crew
from forests.growing.numbering import GrownTree, numbered
from forests.growing.splitting import Rules
from forests.growing.subtree import GrownNodes, grow_nodes, grow_subtree
from forests.samples import Samples

DIRECTION_ONE = 16384
"""int16 of a unit along one axis of a direction."""

SUBTREE_SAMPLES = 32768
"""A node with more samples is a task of its own; with fewer, all of its subtree is one task."""


class _Task(NamedTuple):
    node: int
    depth: int
    begin: int
    end: int


def grow_class_tree(
    crops: Crops,
    samples: Samples,
    classes: NDArray[np.uint8],
    n_classes: int,
    config: GrowthConfig,
    seed: int,
    tree: int,
    n_threads: int,
    on_samples: Callable[[int], object] = lambda n: None,
    offsets: NDArray[np.int16] | None = None,
    crew: Crew | None = None,
) -> GrownTree:
    """Grows one tree by information gain on Shannon entropy (equations 2-4).

    The result depends on (seed, tree) and the data alone, not on n_threads. Beside crops, samples and classes it
    takes 8 bytes a sample, 4 more for a moment at the root, and 100 bytes a node.

    Args:
        crops: Images; may be mapped from a file.
        samples: (n,) pixels in order of frame, row and column.
        classes: (n,) uint8, 0..n_classes-1.
        n_classes: Classes, 1..256.
        config: How.
        seed: Of the forest.
        tree: The tree's number.
        n_threads: Threads.
        on_samples: Called, from the calling thread, with the number of further samples that reached their leaf.
        offsets: (n, 3) int16, by whose summed squared deviation nodes of one class alone are split; None: they
            are leaves.
        crew: Grows the subtrees in place of threads; the tree is the same.

    Raises:
        ValueError: No samples, or classes or offsets that do not fit them.
    """
    if not 1 <= n_classes <= 256:
        raise ValueError(f"n_classes={n_classes} must be in 1..256")
    if classes.shape != samples.frame.shape or classes.dtype != np.uint8:
        raise ValueError(f"classes are {classes.dtype} {classes.shape}, must be uint8 {samples.frame.shape}")
    if len(classes) and classes.max() >= n_classes:
        raise ValueError(f"class {classes.max()} is not in 0..{n_classes - 1}")
    further = np.empty((0, 3), np.int16) if offsets is None else _vectors("offsets", offsets, len(classes))
    target = Target(np.ascontiguousarray(classes), n_classes, further)
    return _grow(crops, samples, target, config, seed, tree, n_threads, on_samples, crew)


def grow_direction_tree(
    crops: Crops,
    samples: Samples,
    directions: NDArray[np.int16],
    config: GrowthConfig,
    seed: int,
    tree: int,
    n_threads: int,
    on_samples: Callable[[int], object] = lambda n: None,
    crew: Crew | None = None,
) -> GrownTree:
    """Grows one tree by the fall of the summed squared deviation of unit directions.

    Args:
        crops: Images; may be mapped from a file.
        samples: (n,) pixels in order of frame, row and column.
        directions: (n, 3) int16, unit vectors times DIRECTION_ONE.
        config: How.
        seed: Of the forest.
        tree: The tree's number.
        n_threads: Threads; the tree is the same for any number.
        on_samples: Called, from the calling thread, with the number of further samples that reached their leaf.
        crew: Grows the subtrees in place of threads; the tree is the same.

    Raises:
        ValueError: No samples, or directions that do not fit them.
    """
    target = Target(np.empty(0, np.uint8), 0, _vectors("directions", directions, len(samples.frame)))
    return _grow(crops, samples, target, config, seed, tree, n_threads, on_samples, crew)


def _vectors(name: str, values: NDArray[np.int16], n: int) -> NDArray[np.int16]:
    """Checked to be (n, 3) int16."""
    if values.shape != (n, 3) or values.dtype != np.int16:
        raise ValueError(f"{name} are {values.dtype} {values.shape}, must be int16 {(n, 3)}")
    return np.ascontiguousarray(values)


def _grow(
    crops: Crops,
    samples: Samples,
    target: Target,
    config: GrowthConfig,
    seed: int,
    tree: int,
    n_threads: int,
    on_samples: Callable[[int], object],
    crew: Crew | None,
) -> GrownTree:
    n = len(samples.frame)
    if not 1 <= n < 2**31:
        raise ValueError(f"{n} samples given, must be 1..{2**31 - 1}")
    if n_threads < 1:
        raise ValueError(f"n_threads={n_threads} must be at least 1")
    if min(seed, tree) < 0:
        raise ValueError(f"seed={seed} and tree={tree} must be at least 0")
    rules = _rules(crops, config, seed, tree)
    order = np.arange(n, dtype=np.int32)
    stop = np.zeros(1, np.bool_)

    def run(task: _Task, call: Call | None) -> tuple[GrownNodes, list[_Task]]:
        is_large = task.end - task.begin > SUBTREE_SAMPLES
        if call is not None and not is_large:
            return _grown_elsewhere(call, order, task, rules), []
        max_nodes = 1 if is_large else 2**62
        grown, further = grow_nodes(crops, samples, target, order, *task, max_nodes, rules, stop)
        return grown, [_Task(*row) for row in further.tolist()]

    root = _Task(1, 0, 0, n)
    if crew is None:
        parts = _run_tasks(lambda task: run(task, None), root, n_threads, stop, on_samples)
    else:
        with crew.sharing(crops, samples, target) as call:
            parts = _run_tasks(lambda task: run(task, call), root, crew.n_calls, stop, on_samples)
    return numbered(GrownNodes(*(np.concatenate(column) for column in zip(*parts, strict=True))), order)


def _grown_elsewhere(call: Call, order: NDArray[np.int32], task: _Task, rules: Rules) -> GrownNodes:
    """The subtree below a node, grown by another process."""
    members = order[task.begin : task.end]
    grown, members[:] = call(grow_subtree, task.node, task.depth, members.copy(), rules)
    return GrownNodes(*grown)._replace(begin=grown.begin + task.begin, end=grown.end + task.begin)


def _rules(crops: Crops, config: GrowthConfig, seed: int, tree: int) -> Rules:
    return Rules(
        seed,
        tree,
        config.max_depth,
        config.n_candidates,
        config.candidates_per_sample,
        config.n_thresholds,
        config.max_samples_per_split,
        config.n_racing_samples,
        config.n_finalists,
        config.min_samples_leaf,
        config.max_offset_m,
        int(crops.classes.max(initial=0)),
        crops.facts.shape[1],
    )


def _run_tasks(
    run: Callable[[_Task], tuple[GrownNodes, list[_Task]]],
    root: _Task,
    n_threads: int,
    stop: NDArray[np.bool_],
    on_samples: Callable[[int], object],
) -> list[GrownNodes]:
    """Runs a task and those that come out of it; an exception stops the workers."""
    parts: list[GrownNodes] = []
    with ThreadPoolExecutor(n_threads) as pool:
        try:
            running = {pool.submit(run, root)}
            while running:
                done, running = wait(running, return_when=FIRST_COMPLETED)
                for future in done:
                    grown, further = future.result()
                    parts.append(grown)
                    running |= {pool.submit(run, task) for task in further}
                    on_samples(int((grown.end - grown.begin)[~grown.is_split].sum()))
        except BaseException:
            stop[0] = True
            pool.shutdown(cancel_futures=True)
            raise
    return parts
