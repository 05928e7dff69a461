"""Writes an ordered corpus and shows how far it is."""

from pathlib import Path

from pipelines.corpus import Corpus, Header, Order, write_corpus
from pipelines.generation.drawn import drawn_order
from pipelines.progress import Progress
from synth.scene import SceneConfig


def write_shown(out: Path, order: Order, workers: int = 1) -> Header:
    """Writes a corpus and shows its progress.

    Args:
        out: The folder.
        order: What to make.
        workers: Processes.
    """
    with Progress(order.n_frames, "frame", "generate") as bar:
        return write_corpus(out, order, workers, bar.set_done)


def generate_corpus(
    out: Path, scene: SceneConfig | None = None, n_frames: int = 1000, seed: int = 0, workers: int = 1
) -> Corpus:
    """Generates a corpus, or goes on with one that was begun with the same arguments, and opens it.

    Args:
        out: The folder: new, empty, or one begun with the same arguments.
        scene: What the scenes are drawn from; None = the default scenes.
        n_frames: How many frames.
        seed: Of everything random; the same arguments give the same bytes.
        workers: Processes.

    Raises:
        UserError: The folder holds something else, or the disk is full.
    """
    write_shown(out, drawn_order(SceneConfig() if scene is None else scene, seed, n_frames), workers)
    return Corpus.open(out)
