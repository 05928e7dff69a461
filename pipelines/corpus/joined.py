"""Several corpora learned from together: opened, checked, their frames as one sequence."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forests.frames import DepthFrame, LabelTable
from pipelines.corpus.read import Corpus
from pipelines.corpus.rooms.views import PeopleFrames, people_of
from pipelines.corpus.sequence import CorpusFrames
from pipelines.errors import CorpusError
from pipelines.spread import at_most


@dataclass(frozen=True)
class JoinedFrames:
    """Frames of several corpora, one corpus after the other; image sizes and cameras may differ.

    Attributes:
        parts: Frames of each corpus; of rooms, the people.
    """

    parts: tuple[CorpusFrames | PeopleFrames, ...]

    @property
    def labels(self) -> LabelTable:
        """What the label images mean: the longest table of the corpora, the others are its beginning."""
        return max((part.labels for part in self.parts), key=lambda table: table.n_labels)

    def __len__(self) -> int:
        return sum(map(len, self.parts))

    def __getitem__(self, place: int) -> DepthFrame:
        if not 0 <= place < len(self):
            raise IndexError(f"frame {place} is not in 0..{len(self) - 1}")
        ends = np.cumsum([len(part) for part in self.parts])
        which = int(np.searchsorted(ends, place, side="right"))
        return self.parts[which][place - int(ends[which]) + len(self.parts[which])]


def open_corpora(paths: Sequence[Path]) -> tuple[Corpus, ...]:
    """Opens corpora, in the order given.

    Raises:
        CorpusError: One of them cannot be opened, or two are the same.
    """
    corpora = tuple(map(Corpus.open, paths))
    first: dict[str, Path] = {}
    for corpus in corpora:
        other = first.setdefault(corpus.digest, corpus.path)
        if other is not corpus.path:
            raise CorpusError(f"{other} and {corpus.path} are the same corpus; give it only once")
    return corpora


def frames_of(corpus: Corpus, numbers: NDArray[np.int64], sensor: str | None) -> CorpusFrames | PeopleFrames:
    """Frames of a corpus as models learn from them: of rooms, everybody in them who ought to be found.

    Args:
        corpus: An open corpus.
        numbers: (n,) frame numbers.
        sensor: Sensor model for the composite's depth; None = clean.
    """
    if corpus.header.has_rooms:
        return PeopleFrames(corpus, people_of(corpus, numbers), sensor)
    return CorpusFrames(corpus, numbers, sensor)


@dataclass(frozen=True)
class FrameChoice:
    """Which frames of which corpora are learned from, in words that any process can follow.

    Attributes:
        corpora: Folders of the corpora.
        split: The split.
        sensor: Sensor model for generated frames; None = clean.
        max_frames: At most so many frames of each corpus, evenly spread; 0 = all.
    """

    corpora: tuple[Path, ...]
    split: str
    sensor: str | None = None
    max_frames: int = 0

    def frames(self, opened: Sequence[Corpus] | None = None) -> JoinedFrames:
        """The frames.

        Args:
            opened: The corpora, if they are open already.

        Raises:
            CorpusError: A corpus cannot be opened, or the sensor is not for it.
        """
        corpora = open_corpora(self.corpora) if opened is None else opened
        parts = []
        for corpus, sensor in zip(corpora, sensors_of(corpora, self.sensor), strict=True):
            numbers = corpus.split(self.split)
            parts.append(frames_of(corpus, numbers[at_most(len(numbers), self.max_frames)], sensor))
        return JoinedFrames(tuple(parts))


def digests_of(corpora: Sequence[Corpus]) -> str | list[str]:
    """What a model tells of its corpora: the digest of one, a list of several in their order."""
    digests = [corpus.digest for corpus in corpora]
    return digests[0] if len(digests) == 1 else digests


def sensors_of(corpora: Sequence[Corpus], sensor: str | None) -> tuple[str | None, ...]:
    """The sensor model for each corpus: none for recorded ones if others are generated, or if it is "random".

    Raises:
        CorpusError: An unknown sensor, or a second one for frames that are all recorded.
    """
    from synth.render.sensors import RANDOM

    if sensor == RANDOM:
        return tuple(None if corpus.header.is_recorded else sensor for corpus in corpora)
    generated = [corpus for corpus in corpora if not corpus.header.is_recorded]
    for corpus in generated or corpora:
        corpus.check_sensor(sensor)
    return tuple(None if generated and corpus.header.is_recorded else sensor for corpus in corpora)
