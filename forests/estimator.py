"""The part of scikit-learn's estimator protocol that both forests share: parameters by name, frames held out."""

import dataclasses
from collections.abc import Iterator
from typing import Any, Self

from forests.frames import FrameSequence, FrameSubset

HELD_OUT_EVERY = 10
"""`fit` tunes on every so many-th frame where it was given no validation frames."""


class Estimator:
    """Parameters of an estimator that is built as `Estimator(config, n_threads)`.

    `config` is a frozen dataclass; its fields are reachable as "config__field", as scikit-learn names nested
    parameters, so `sklearn.base.clone` and grid searches work.

    Attributes:
        config: How the forest is trained and asked.
        n_threads: Threads for training; the result does not depend on it.
    """

    config: Any
    n_threads: int

    def get_params(self, deep: bool = True) -> dict[str, object]:
        """Parameters by name; with `deep` also every field of the config."""
        params: dict[str, object] = {"config": self.config, "n_threads": self.n_threads}
        if deep:
            params.update(_fields("config", self.config))
        return params

    def set_params(self, **params: Any) -> Self:
        """Changes parameters by name.

        Raises:
            ValueError: An unknown name, or a value that the config refuses.
        """
        known = self.get_params()
        for name, value in params.items():
            if name not in known:
                raise ValueError(f"parameter {name!r} is unknown; known are {', '.join(known)}")
            first, _, rest = name.partition("__")
            setattr(self, first, value if not rest else _replaced(self.config, rest, value))
        return self


def hold_out(frames: FrameSequence) -> tuple[FrameSequence, FrameSequence]:
    """(training, validation) frames: every tenth is held out."""
    numbers = range(len(frames))
    held_out = numbers[HELD_OUT_EVERY - 1 :: HELD_OUT_EVERY]
    rest = tuple(i for i in numbers if i not in held_out)
    return FrameSubset(frames, rest), FrameSubset(frames, tuple(held_out))


def _fields(prefix: str, config: Any) -> Iterator[tuple[str, object]]:
    for item in dataclasses.fields(config):
        value = getattr(config, item.name)
        yield f"{prefix}__{item.name}", value
        if dataclasses.is_dataclass(value):
            yield from _fields(f"{prefix}__{item.name}", value)


def _replaced(config: Any, name: str, value: object) -> Any:
    first, _, rest = name.partition("__")
    inner = value if not rest else _replaced(getattr(config, first), rest, value)
    return dataclasses.replace(config, **{first: inner})
