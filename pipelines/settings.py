"""Settings from TOML tables into frozen dataclasses; unknown keys and wrong types are refused by name."""

import dataclasses
import tomllib
import types
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import TypeVar

from pipelines.errors import UserError

T = TypeVar("T")


def read_toml(path: Path) -> dict:
    """The tables of a TOML file.

    Raises:
        UserError: There is no such file, or it is no TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"cannot read {path}: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise UserError(f"{path} is not valid TOML: {error}") from None


def from_table(cls: type[T], table: Mapping[str, object], where: str, **given: object) -> T:
    """Builds a dataclass of settings from a table; keys left out keep their defaults.

    Args:
        cls: The dataclass, its nested settings dataclasses too.
        table: Values by field name.
        where: The table's name in messages.
        given: Values of other fields, taken as they are.

    Raises:
        UserError: An unknown key, a value of another type, or one that the dataclass refuses.
    """
    known = {item.name: item for item in dataclasses.fields(typing.cast("type", cls)) if item.init}
    hints = typing.get_type_hints(cls)
    values = dict(given)
    for key, value in table.items():
        if key not in known:
            names = [name for name in known if name not in given]
            raise UserError(f"{where} has an unknown key {key!r}; known are {', '.join(names)}")
        values[key] = _converted(hints[key], value, f"{where}.{key}")
    try:
        return cls(**values)
    except (TypeError, ValueError) as error:
        raise UserError(f"{where}: {error}") from None


def defaults_from(cls: type[T], path: Path, config: str = "config", **missing: object) -> T:
    """Settings of a command with the defaults that a TOML file gives.

    Args:
        cls: The dataclass of the settings.
        path: The file; it may hold any of the settings, nested ones as tables.
        config: Name of the setting that holds the file's path itself.
        missing: Settings that only the command line can give, and what stands for them until then.

    Raises:
        UserError: The file cannot be read, has an unknown key, or a value that the settings refuse.
    """
    table = read_toml(path)
    for name in (config, *missing):
        if name in table:
            raise UserError(f"{path} has a key {name!r}, which only the command line can give")
    return from_table(cls, table, str(path), **missing, **{config: path})


def _converted(kind: object, value: object, where: str) -> object:
    """A TOML value as the annotated type."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin in (types.UnionType, typing.Union):
        return _first_that_fits(arguments, value, where)
    if origin is typing.Literal and value in arguments:
        return value
    if origin is typing.Literal:
        raise UserError(f"{where}={value!r} is unknown; known are {', '.join(map(str, arguments))}")
    if origin is tuple and isinstance(value, list):
        return _converted_tuple(arguments, value, where)
    is_table = origin is dict or (isinstance(kind, type) and dataclasses.is_dataclass(kind))
    if is_table and not isinstance(value, Mapping):
        raise UserError(f"{where}={value!r} must be a table, not {type(value).__name__}")
    if origin is dict and isinstance(value, Mapping):
        return {key: _converted(arguments[1], item, f"{where}.{key}") for key, item in value.items()}
    if isinstance(kind, type) and dataclasses.is_dataclass(kind) and isinstance(value, Mapping):
        return from_table(kind, value, where)
    return _converted_plain(kind, value, where)


def _converted_tuple(kinds: tuple, value: list, where: str) -> tuple:
    if len(kinds) == 2 and kinds[1] is ...:
        kinds = (kinds[0],) * len(value)
    if len(kinds) != len(value):
        raise UserError(f"{where} has {len(value)} values, must have {len(kinds)}")
    return tuple(_converted(k, v, f"{where}[{i}]") for i, (k, v) in enumerate(zip(kinds, value, strict=True)))


def _converted_plain(kind: object, value: object, where: str) -> object:
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        return _as_float(value, where)
    if kind is Path and isinstance(value, str):
        return Path(value)
    if isinstance(kind, type) and isinstance(value, kind) and isinstance(value, bool) == (kind is bool):
        return value
    name = kind.__name__ if isinstance(kind, type) else str(kind)
    raise UserError(f"{where}={value!r:.60} must be {name}, not {type(value).__name__}")


def _as_float(value: int, where: str) -> float:
    try:
        return float(value)
    except OverflowError:
        raise UserError(f"{where} is a number of more than 300 digits") from None


def _first_that_fits(kinds: tuple, value: object, where: str) -> object:
    last: UserError | None = None
    for kind in kinds:
        if kind is type(None):
            continue
        try:
            return _converted(kind, value, where)
        except UserError as error:
            last = error
    raise last or UserError(f"{where}={value!r} is not allowed")
