"""What all specs of generators share: fields with a unit and limits, checks, and plain JSON values."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Self

import numpy as np


def number(low: float, high: float) -> Any:
    """A field for a real number in [low, high], in metres or radians as its docstring says."""
    return field(metadata={"low": low, "high": high, "type": float})


def count(low: int, high: int) -> Any:
    """A field for an integer in low..high."""
    return field(metadata={"low": low, "high": high, "type": int})


def choice(*names: str) -> Any:
    """A field for one of some names."""
    return field(metadata={"names": names, "type": str})


def flag() -> Any:
    """A field for true or false."""
    return field(metadata={"type": bool})


@dataclass(frozen=True)
class Spec:
    """Base of every generator's parameters: frozen, in metres and radians, checked when made."""

    def __post_init__(self) -> None:
        for entry in fields(self):
            value = _checked(type(self).__name__, entry.name, getattr(self, entry.name), entry.metadata)
            object.__setattr__(self, entry.name, value)

    def require(self, is_met: bool, sentence: str) -> None:
        """Refuses sizes that do not fit each other.

        Raises:
            ValueError: `is_met` is false.
        """
        if not is_met:
            raise ValueError(f"{type(self).__name__}: {sentence}")

    def to_plain(self) -> dict[str, object]:
        """The fields as plain JSON values."""
        return {entry.name: getattr(self, entry.name) for entry in fields(self)}

    @classmethod
    def from_plain(cls, plain: Mapping[str, object]) -> Self:
        """The inverse of `to_plain`.

        Raises:
            ValueError: A field is unknown or missing, or its value is not allowed.
        """
        cls.check_names(plain)
        missing = [e.name for e in fields(cls) if e.name not in plain]
        if missing:
            raise ValueError(f"{cls.__name__} lacks {', '.join(missing)}")
        return cls(**plain)

    @classmethod
    def check_names(cls, plain: Mapping[str, object]) -> None:
        """Refuses fields that the spec does not have.

        Raises:
            ValueError: Some field is unknown; the message lists the known ones.
        """
        known = [entry.name for entry in fields(cls)]
        unknown = [name for name in plain if name not in known]
        if unknown:
            raise ValueError(f"{cls.__name__} has no field {', '.join(unknown)}, only {', '.join(known)}")


def _checked(owner: str, name: str, value: object, metadata: Mapping[str, Any]) -> object:
    """The value in its field's own type, if it is allowed."""
    kind = metadata["type"]
    if kind is bool or kind is str:
        allowed = metadata.get("names", (False, True))
        if not isinstance(value, (kind, np.bool_)) or value not in allowed:
            raise ValueError(f"{owner}: {name}={value!r} must be one of {', '.join(map(str, allowed))}")
        return kind(value)
    low, high = metadata["low"], metadata["high"]
    is_number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    real = float(value) if is_number else math.nan  # type: ignore[arg-type]
    if not math.isfinite(real) or (kind is int and real != int(real)):
        raise ValueError(f"{owner}: {name}={value!r} must be {'an integer' if kind is int else 'a number'}")
    if not low <= real <= high:
        raise ValueError(f"{owner}: {name}={value} must be in [{low:g}, {high:g}]")
    return kind(real)


def uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A draw from [low, high), rounded to a tenth of a millimetre or milliradian so that specs read well."""
    return round(float(rng.uniform(low, high)), 4)


def pick(rng: np.random.Generator, names: tuple[str, ...], weights: tuple[float, ...] | None = None) -> str:
    """One of the names."""
    p = None if weights is None else np.array(weights) / sum(weights)
    return names[int(rng.choice(len(names), p=p))]


def chance(rng: np.random.Generator, probability: float) -> bool:
    """True with this probability."""
    return bool(rng.random() < probability)
