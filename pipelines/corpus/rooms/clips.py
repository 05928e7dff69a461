"""Clips of a corpus: the frames of one scene over time, through each of its cameras."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pipelines.corpus.read import Corpus
from pipelines.errors import CorpusError
from synth.frame import Frame, RoomFrame
from synth.vocabulary import SPLITS


@dataclass(frozen=True)
class Clip:
    """One clip, or one scene that several cameras see, which is a clip of one time step.

    Attributes:
        corpus: Where it is.
        split: "train", "val" or "test".
        number: Its number within the split.
        numbers: (n_steps, n_views) int64 numbers of its frames in the corpus.
        fps: Time steps a second; 0 where there is one.
    """

    corpus: Corpus = field(repr=False)
    split: str
    number: int
    numbers: NDArray[np.int64] = field(repr=False)
    fps: float

    @property
    def n_steps(self) -> int:
        """Time steps."""
        return len(self.numbers)

    @property
    def n_views(self) -> int:
        """Cameras."""
        return self.numbers.shape[1]

    def frame(self, step: int, view: int = 0, sensor: str | None = None) -> RoomFrame | Frame:
        """One frame; with a sensor's noise, drawn for this frame alone, on the composite depth if asked."""
        number = int(self.numbers[step, view])
        has_rooms = self.corpus.header.has_rooms
        return self.corpus.scene(number, sensor) if has_rooms else self.corpus.frame(number, sensor)

    def frames(self, view: int = 0, sensor: str | None = None) -> Iterator[RoomFrame | Frame]:
        """The frames of one camera, in order of time."""
        return (self.frame(step, view, sensor) for step in range(self.n_steps))

    def array(self, name: str, view: int = 0) -> np.ndarray:
        """(n_steps, ...) one stored array of one camera, by time.

        Of a clip, "joints_world" (n_steps, 8, 15, 3) [m], "joint_velocity" [m/s] and "contacts" are the same for all
        cameras; the entries of people beyond "n_people" are not used.
        """
        return self.corpus.arrays(name, self.numbers[:, view])

    def seconds(self) -> NDArray[np.float64]:
        """(n_steps,) when each time step is, from the clip's beginning [s]."""
        return np.arange(self.n_steps) / (self.fps or 1.0)

    def subjects(self) -> tuple[str, ...]:
        """Who is in it, in order of number, from first to last."""
        return tuple(one.subject_id for one in self.corpus.scene_record(int(self.numbers[0, 0])).people)


def clips_of(corpus: Corpus, split: str | None = None) -> Iterator[Clip]:
    """All finished clips of a corpus, or of a split.

    Args:
        corpus: An open corpus with clips, or with several cameras.
        split: None = all.

    Raises:
        CorpusError: It has neither.
    """
    header = corpus.header
    if "clip" not in header.fields:
        raise CorpusError(
            f"{corpus.path} has neither clips nor several cameras; generate it with scene.clip or scene.cameras"
        )
    n_each, n_steps = header.frames_a_scene, max(header.clip_steps, 1)
    fps = float(header.config["scene"].get("fps", 0.0)) if header.clip_steps else 0.0
    for name in SPLITS if split is None else (split,):
        numbers = corpus.split(name)
        clip = corpus.arrays("clip", numbers)
        for k in np.unique(clip):
            own = numbers[clip == k]
            if len(own) == n_each:
                yield Clip(corpus, name, int(k), own.reshape(n_steps, header.cameras), fps)
