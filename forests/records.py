"""Configs as JSON values and back: frozen dataclasses whose fields are plain, tuples, or dataclasses again."""

import dataclasses
import typing
from collections.abc import Mapping
from typing import Any, TypeVar

T = TypeVar("T")


def to_json(record: Any) -> dict[str, Any]:
    """A dataclass as JSON values; fields that say so are left out where they have their default."""
    return {
        item.name: _plain(getattr(record, item.name))
        for item in dataclasses.fields(record)
        if not (item.metadata.get("is_omitted_if_default") and getattr(record, item.name) == item.default)
    }


def _plain(value: Any) -> Any:
    if dataclasses.is_dataclass(value):
        return to_json(value)
    return [_plain(item) for item in value] if isinstance(value, tuple) else value


def from_json(cls: type[T], values: object) -> T:
    """A dataclass from JSON values.

    Args:
        cls: The dataclass.
        values: By field name; those that are missing, as from files of earlier versions, take their defaults.

    Raises:
        ValueError: Fields missing, unknown, of another type, or refused by the dataclass.
    """
    items = dataclasses.fields(typing.cast("Any", cls))
    names = [item.name for item in items]
    needed = {item.name for item in items if item.default is item.default_factory is dataclasses.MISSING}
    if not isinstance(values, Mapping) or not needed <= set(values) <= set(names):
        given = ", ".join(map(str, values)) if isinstance(values, Mapping) else type(values).__name__
        raise ValueError(f"{cls.__name__} is ({given}), must be ({', '.join(names)})")
    kinds = typing.get_type_hints(cls)
    return cls(**{name: _typed(kinds[name], values[name], f"{cls.__name__}.{name}") for name in values})


def _typed(kind: Any, value: Any, where: str) -> Any:
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if dataclasses.is_dataclass(kind):
        return from_json(typing.cast("type", kind), value)
    if origin is typing.Literal and isinstance(value, str) and value in arguments:
        return value
    if origin is tuple and isinstance(value, list):
        is_any_length = arguments[-1] is ...
        if is_any_length or len(arguments) == len(value):
            kinds = arguments[:1] * len(value) if is_any_length else arguments
            return tuple(_typed(k, v, where) for k, v in zip(kinds, value, strict=True))
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        return _float(value, where)
    if isinstance(kind, type) and type(value) is kind:
        return value
    raise ValueError(f"{where} is {value!r:.60}, must be {getattr(kind, '__name__', kind)}")


def _float(value: int, where: str) -> float:
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"{where} is too large for a float") from None
