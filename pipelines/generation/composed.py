"""Frames of a recorded corpus with drawn objects before the person, as a source of frames."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.corpus import Corpus
from pipelines.errors import UserError
from pipelines.generation.floor import Floor
from synth.frame import Frame
from synth.scene import ObjectMix
from synth.scene.composed import ComposeConfig, Composer
from synth.scene.config import SplitShares
from synth.vocabulary import SPLITS


class ComposedFrames:
    """The frames of a composed corpus, in any order: train, then val, then test.

    Each depends on the settings, the seed, its split, its number in the split and its recorded frame alone.

    Args:
        corpus: The recorded corpus.
        n_frames: Length of the new one; each split gets its share of the recorded frames.
        composer: Puts the objects there.
    """

    def __init__(self, corpus: Corpus, n_frames: int, composer: Composer) -> None:
        self.corpus = corpus
        self.composer = composer
        recorded = [corpus.split(split) for split in SPLITS]
        counts = SplitShares(*(float(len(numbers)) for numbers in recorded)).counts(n_frames)
        self._rows = [spread_over(numbers, n) for numbers, n in zip(recorded, counts, strict=True)]

    def __len__(self) -> int:
        return sum(len(rows) for rows in self._rows)

    @property
    def description(self) -> str:
        """Which back end and device draws, in words."""
        return self.composer.renderer(self.corpus.camera(int(self.corpus.indices[0]))).description

    def recorded_index(self, index: int) -> tuple[int, int]:
        """Number of a frame's recorded frame in its corpus, and its own number in its split.

        Raises:
            IndexError: There is no such frame.
        """
        left = index
        for rows in self._rows:
            if 0 <= left < len(rows):
                return int(rows[left]), left
            left -= len(rows)
        raise IndexError(f"frame {index} must be in 0..{len(self) - 1}")

    def frame(self, index: int) -> Frame:
        """Makes a frame."""
        number, frame_idx = self.recorded_index(index)
        return self.composer.compose(self.corpus[number], index, frame_idx)


def spread_over(numbers: NDArray[np.int64], n: int) -> NDArray[np.int64]:
    """(n,) of the given numbers, evenly spread and rising; each as often as the others, within one."""
    return numbers[np.arange(n) * len(numbers) // max(n, 1)]


def open_recorded(path: Path) -> Corpus:
    """A corpus whose people furniture can be put before.

    Raises:
        UserError: It is no recorded corpus, or its pixels have no part labels.
    """
    corpus = Corpus.open(path)
    config = corpus.header.config
    if "import" not in config:
        raise UserError(f"--into {path} must be a corpus of `undergrowth import depth`")
    if config["import"]["parts"] == "none":
        raise UserError(f"--into {path}: its recordings have no joints, so that nothing tells what objects hide")
    return corpus


def make_composed(
    path: Path,
    digest: str,
    floor: Floor,
    compose: ComposeConfig,
    seed: int,
    n_frames: int,
    renderer: str,
    objects: Callable[[], ObjectMix] | None = None,
) -> ComposedFrames:
    """The frames of a composed corpus.

    Args:
        path: Folder of the recorded corpus.
        digest: What its digest must be.
        floor: Its floor.
        compose: What the objects are drawn from.
        seed: Of everything random.
        n_frames: How many.
        renderer: Its name.
        objects: Reads the imported objects, if any are used.

    Raises:
        UserError: The corpus has changed, a library cannot be used, or the renderer does not start.
    """
    corpus = open_recorded(path)
    if corpus.digest != digest:
        raise UserError(f"{path} has changed since the corpus was begun")
    mix = None if objects is None else objects()
    source = ComposedFrames(corpus, n_frames, Composer(compose, seed, floor.transform(), renderer, mix))
    try:
        _ = source.description
    except (ImportError, RuntimeError) as error:
        raise UserError(f"renderer {renderer} does not start: {error}") from error
    return source
