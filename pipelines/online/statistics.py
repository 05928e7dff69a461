"""What came of a run: images, people, answers, and how long answers took."""

import time
from collections import Counter, deque

import numpy as np

from pipelines.online.messages import CameraFrame, Plan, Result, TrackedPersons

N_KEPT = 100_000
"""Times that are kept, so that a long run takes no more memory."""


class Statistics:
    """Counts what is told on the bus; `bus.subscribe(object, statistics.take)`.

    Attributes:
        n_images: Images.
        n_people: People who were told of, summed over the images.
        tracks: How often each track was told of.
        answers: Answers by module.
        skips: Skips by reason.
    """

    def __init__(self) -> None:
        self.n_images = self.n_people = 0
        self.tracks: Counter[int] = Counter()
        self.answers: Counter[str] = Counter()
        self.skips: Counter[str] = Counter()
        self._begun: dict[int, float] = {}
        self._latency: deque[float] = deque(maxlen=N_KEPT)
        self._last: dict[int, float] = {}

    def take(self, message: object) -> None:
        """Counts a message."""
        if isinstance(message, CameraFrame):
            self.n_images += 1
            self._begun[message.stamp] = time.perf_counter()
            for stamp in list(self._begun)[:-300]:
                self._settle(stamp)
        elif isinstance(message, TrackedPersons):
            self.n_people += len(message.persons)
            self.tracks.update(one.track_id for one in message.persons)
        elif isinstance(message, Plan):
            self.skips.update(skip.reason for skip in message.skips)
        elif isinstance(message, Result):
            self.answers[message.module] += 1
            if message.stamp in self._begun:
                self._last[message.stamp] = time.perf_counter() - self._begun[message.stamp]

    def _settle(self, stamp: int) -> None:
        del self._begun[stamp]
        if stamp in self._last:
            self._latency.append(self._last.pop(stamp))

    def latency_s(self) -> np.ndarray:
        """(n,) from each image to the last answer about it, of the images with answers [s]."""
        return np.array([*self._latency, *self._last.values()])

    def sentences(self) -> list[str]:
        """The counts in words."""
        out = [f"{self.n_images} images, {len(self.tracks)} tracks, {self.n_people} people in all images together"]
        out += [
            f"{name}: {n} answers, {n / self.n_images:.1f} an image" for name, n in sorted(self.answers.items())
        ]
        latency = self.latency_s()
        if len(latency):
            median, most = np.percentile(latency, [50, 95]) * 1e3
            out.append(f"from an image to its last answer: {median:.1f} ms in the median, {most:.1f} ms at 95 %")
        out += [f"skipped, {reason}: {n} times" for reason, n in self.skips.most_common()]
        return out
