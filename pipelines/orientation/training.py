"""Trains an orientation net on corpora into a file; the last finished epoch lies beside it until it is there."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from forests.records import to_json
from nets.orientation.config import OrientationConfig
from nets.orientation.frames import Patches, collect_patches
from pipelines.corpus.header import software_versions
from pipelines.corpus.joined import digests_of, sensors_of
from pipelines.corpus.read import Corpus
from pipelines.errors import UserError
from pipelines.models.checkpoints import TreeFolder, open_trees
from pipelines.models.training import partial_folder
from pipelines.orientation.frames import CorpusOrientations, JoinedOrientations
from pipelines.progress import Progress
from pipelines.spread import at_most

State = dict[str, np.ndarray]


def frames_of(
    corpora: Sequence[Corpus], split: str, config: OrientationConfig, sensor: str | None, max_frames: int
) -> JoinedOrientations:
    """The frames of a split of several corpora.

    Args:
        corpora: Open corpora.
        split: train, val or test.
        config: Of the net.
        sensor: Sensor model for the depth of generated frames; None = clean.
        max_frames: Most frames of each corpus, evenly spread; 0 = all.
    """

    def chosen(corpus: Corpus, of_corpus: str | None) -> CorpusOrientations:
        numbers = corpus.split(split)
        return CorpusOrientations(corpus, numbers[at_most(len(numbers), max_frames)], config.region, of_corpus)

    pairs = zip(corpora, sensors_of(corpora, sensor), strict=True)
    return JoinedOrientations([chosen(*pair) for pair in pairs])


def cut_patches(frames: JoinedOrientations, config: OrientationConfig) -> Patches:
    """Cuts the patches of frames, with a progress bar."""
    with Progress(len(frames), "frame", "cut patches") as bar:
        return collect_patches(frames, config.region, config.view, bar.update)


def versions() -> dict[str, str]:
    """Versions that the weights may hang on."""
    from nets.runtime import load_torch

    return software_versions() | {"torch": str(load_torch().__version__)}


def identity_of(
    corpora: Sequence[Corpus], config: OrientationConfig, sensor: str | None, max_frames: int, n_threads: int
) -> dict[str, Any]:
    """All that the weights depend on, as JSON values."""
    return {
        "kind": "orientation",
        "corpus": digests_of(corpora),
        "config": to_json(config),
        "sensor": sensor,
        "max_frames": max_frames,
        "threads": n_threads,
        "software": versions(),
    }


def train_into(
    path: Path,
    config: OrientationConfig,
    patches: Patches,
    validation: Patches,
    *,
    identity: Mapping[str, Any],
    metadata: Callable[[Any], dict[str, Any]],
    n_threads: int = 1,
    drops_others: bool = False,
    on_resume: Callable[[int], object] = lambda n_epochs: None,
    on_share: Callable[[float], object] = lambda share: None,
) -> None:
    """Trains a net and writes its file. Interrupted, it goes on after the last finished epoch when called again.

    Args:
        path: The file; the state after the last finished epoch lies in PATH.partial until it is written.
        config: How.
        patches: What to learn from.
        validation: What to calibrate on.
        identity: All that the weights depend on, as JSON values: states of another identity are not used.
        metadata: What the file tells beside the model, from the trained model.
        n_threads: Threads.
        drops_others: Remove states of another identity instead of refusing.
        on_resume: Told how many finished epochs are used again, if any are.
        on_share: Told the share of the work that is done, 0..1.

    Raises:
        UserError: States of another identity, or another process trains into the same file.
        ValueError: Patches that nothing can be learned from.
    """
    from nets.orientation.storage import save_model
    from nets.orientation.train import train

    store: TreeFolder[State] = TreeFolder(partial_folder(path), identity, dict, dict, "epochs")
    with open_trees(store, drops_others):
        if (state := store.load(0)) is not None:
            on_resume(int(state["n_epochs"]))
        model = train(
            patches,
            config,
            validation=validation,
            n_threads=n_threads,
            checkpoint=store,
            on_progress=on_share,
        )
        save_model(path, model, metadata(model))
        store.clear()


def check_patches(patches: Patches, corpora: Sequence[Corpus], config: OrientationConfig) -> None:
    """Makes sure that there is something to learn from.

    Raises:
        UserError: No training frame shows what is asked about, and tells its angle.
    """
    if len(patches.angle) < 2:
        names = ", ".join(str(corpus.path) for corpus in corpora)
        what = "heading of a body" if config.region == "body" else "pan of a head that is seen"
        raise UserError(f"{names}: {len(patches.angle)} training frames tell the {what}; at least 2 are needed")
