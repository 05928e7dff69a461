"""Writes an ordered corpus and shows how far it is."""

from pathlib import Path

from pipelines.corpus import Corpus, Order, write_corpus
from pipelines.corpus.fields import SHARD_FRAMES
from pipelines.corpus.remote.writing import RemoteRunner, write_remote_corpus
from pipelines.corpus.run import Runner, write_shards
from pipelines.generation.drawn import drawn_order
from pipelines.progress import Progress
from synth.scene import SceneConfig


def write_shown(
    out: Path, order: Order, workers: int = 1, runner: Runner | None = None, shards: range | None = None
) -> None:
    """Writes a corpus, or some shards of it, and shows the progress.

    Args:
        out: The folder.
        order: What to make.
        workers: Processes.
        runner: Makes the shards in place of such processes.
        shards: Which shards; None = all.
    """
    first, last = (
        (0, order.n_frames) if shards is None else (SHARD_FRAMES * k for k in (shards.start, shards.stop))
    )
    with Progress(max(min(last, order.n_frames) - first, 1), "frame", "generate") as bar:
        if shards is None:
            write_corpus(out, order, workers, bar.set_done, runner)
        else:
            write_shards(out, order, shards, workers, bar.set_done, runner)


def put_shown(url: str, order: Order, runner: RemoteRunner | None = None) -> None:
    """Writes a corpus to a URL and shows the progress.

    Args:
        url: Where.
        order: What to make.
        runner: Makes and puts the shards in place of this process.
    """
    with Progress(order.n_frames, "frame", "generate") as bar:
        write_remote_corpus(url, order, bar.set_done, runner)


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
