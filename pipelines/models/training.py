"""Trains a model of any kind into a file; finished trees lie beside it until it is there."""

import functools
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from forests.frames import FrameSequence
from forests.growing import Crew
from pipelines.models.checkpoints import TREE_FILES, TreeFolder, open_trees
from pipelines.models.kinds import ModelConfig, ModelKind, Tools


def train_into(
    path: Path,
    kind: ModelKind,
    config: ModelConfig,
    frames: FrameSequence,
    validation: FrameSequence,
    *,
    identity: Mapping[str, Any],
    metadata: Callable[[Any], dict[str, Any]],
    n_threads: int = 1,
    drops_others: bool = False,
    on_resume: Callable[[int], object] = lambda n_trees: None,
    on_share: Callable[[float], object] = lambda share: None,
    crew: Crew | None = None,
) -> None:
    """Trains a model and writes its file. Interrupted, it goes on after the last finished tree when called again.

    Args:
        path: The file; finished trees lie in PATH.partial until it is written.
        kind: What sort of model.
        config: Its settings.
        frames: Frames to learn from.
        validation: Frames to tune on.
        identity: All that the trees depend on, as JSON values: those of another identity are not used.
        metadata: What the file tells beside the model, from the trained model.
        n_threads: Threads; the model does not depend on it.
        drops_others: Remove trees of another identity instead of refusing.
        on_resume: Told how many finished trees are used again, if any are.
        on_share: Told the share of the work that is done, 0..1.
        crew: Does a part of the work on other machines, for kinds that are no nets; the model does not depend on it.

    Raises:
        UserError: Trees of another identity, or another process trains into the same file.
        ValueError: Frames that nothing can be learned from.
    """
    tools = kind.tools()
    unpack = functools.partial(_unpacked, tools, frames, config)
    store: TreeFolder[Any] = TreeFolder(partial_folder(path), identity, tools.pack_tree, unpack, f"{kind.piece}s")
    with open_trees(store, drops_others):
        if store.n_trees:
            on_resume(store.n_trees)
        train = tools.train if crew is None else functools.partial(tools.train, crew=crew)
        model = train(
            frames, config, validation=validation, n_threads=n_threads, checkpoint=store, on_progress=on_share
        )
        tools.save(path, model, metadata(model))
        store.clear()


def _unpacked(tools: Tools, frames: FrameSequence, config: ModelConfig, arrays: dict[str, np.ndarray]) -> Any:
    return tools.unpack_tree(arrays, frames.labels, config)


def partial_folder(path: Path) -> Path:
    """The folder of a model's finished trees."""
    return path.with_name(path.name + ".partial")


def n_finished_trees(path: Path) -> int:
    """Number of finished trees that lie beside a model that is being trained."""
    return sum(1 for _ in partial_folder(path).glob(TREE_FILES))
