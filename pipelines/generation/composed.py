"""Frames of a recorded corpus with drawn objects before the person, as a source of frames."""

import functools
from dataclasses import asdict, replace
from pathlib import Path

from pipelines.corpus import Corpus, Order
from pipelines.errors import UserError
from pipelines.generation.floor import Floor, find_floor
from pipelines.generation.libraries import LibraryUse, object_mix
from pipelines.spread import evenly_spread
from synth.frame import Frame
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
        self._rows = [numbers[evenly_spread(len(numbers), n)] for numbers, n in zip(recorded, counts, strict=True)]

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


def open_recorded(path: Path) -> Corpus:
    """A corpus whose people furniture can be put before.

    Raises:
        UserError: It is no recorded corpus, or its pixels have no part labels.
    """
    corpus = Corpus.open(path)
    config = corpus.header.config
    if "import" not in config:
        raise UserError(f"--into {path} must be a corpus made by `undergrowth import depth`")
    if config["import"]["parts"] == "none":
        raise UserError(f"--into {path}: its recordings have no joints that objects could occlude")
    return corpus


def composed_order(
    into: Path,
    compose: ComposeConfig,
    seed: int,
    n_frames: int | None = None,
    renderer: str = "numba",
    objects: LibraryUse | None = None,
) -> Order[ComposedFrames]:
    """A corpus of recorded people with objects before them.

    Args:
        into: Folder of the recorded corpus.
        compose: What the objects are drawn from.
        seed: Of everything random.
        n_frames: How many frames; None = as many as are recorded.
        renderer: numba or pyrender.
        objects: Imported objects that some frames take, if any are used.

    Raises:
        UserError: The corpus or the library cannot be used.
    """
    corpus = open_recorded(into)
    floor = find_floor(corpus)
    n_frames = len(corpus) if n_frames is None else n_frames
    config = {
        "renderer": renderer,
        "into": {"corpus": corpus.digest, "floor": asdict(floor), "import": corpus.header.config["import"]},
        "compose": asdict(compose),
    }
    if objects is not None:
        objects = replace(objects, digest=object_mix(objects).library.digest)
        config["objects"] = objects.told()
    make = functools.partial(make_composed, into, corpus.digest, floor, compose, seed, n_frames, renderer, objects)
    angles = tuple((str(name), float(low), float(high)) for name, low, high in corpus.header.labels["angles"])
    return Order(seed, n_frames, config, make, angles)


def make_composed(
    path: Path,
    digest: str,
    floor: Floor,
    compose: ComposeConfig,
    seed: int,
    n_frames: int,
    renderer: str,
    objects: LibraryUse | None = None,
) -> ComposedFrames:
    """The frames of such a corpus.

    Args:
        path: Folder of the recorded corpus.
        digest: What its digest must be.
        floor: Its floor.
        compose: What the objects are drawn from.
        seed: Of everything random.
        n_frames: How many.
        renderer: Its name.
        objects: Imported objects, if any are used.

    Raises:
        UserError: The corpus has changed, a library cannot be used, or the renderer does not start.
    """
    corpus = open_recorded(path)
    if corpus.digest != digest:
        raise UserError(f"{path} has changed since the corpus was begun")
    mix = None if objects is None else object_mix(objects)
    source = ComposedFrames(corpus, n_frames, Composer(compose, seed, floor.transform(), renderer, mix))
    try:
        _ = source.description
    except (ImportError, RuntimeError) as error:
        raise UserError(f"the renderer {renderer} cannot start: {error}") from error
    return source
