"""Settings from TOML: what is unknown, of another type or out of range is named."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import pytest

from pipelines.errors import UserError
from pipelines.settings import from_table, read_toml


@dataclass(frozen=True)
class Weights:
    table: float = 1.0
    other: float = 0.0

    def __post_init__(self):
        if self.table < 0:
            raise ValueError(f"table={self.table} must not be negative")


@dataclass(frozen=True)
class Settings:
    n: int = 3
    name: str = "a"
    kind: Literal["numba", "pyrender"] = "numba"
    span: tuple[float, float] | None = None
    sizes: tuple[int, ...] = ()
    is_on: bool = False
    path: Path = Path()
    weights: Weights = field(default_factory=Weights)
    shares: dict[str, float] = field(default_factory=dict)


def test_values_of_every_kind_are_taken():
    table = {
        "n": 4, "kind": "pyrender", "span": [1, 2.5], "sizes": [1, 2, 3], "is_on": True, "path": "x/y",
        "weights": {"table": 2}, "shares": {"a": 1},
    }  # fmt: skip
    made = from_table(Settings, table, "f.toml")
    assert made == Settings(4, "a", "pyrender", (1.0, 2.5), (1, 2, 3), True, Path("x/y"), Weights(2.0), {"a": 1.0})
    assert isinstance(made.weights.table, float)
    assert from_table(Settings, {}, "f.toml") == Settings()


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"m": 1}, r"f.toml has an unknown key 'm'; known are n, name, kind"),
        ({"weights": {"tabel": 1}}, r"f.toml.weights has an unknown key 'tabel'; known are table, other"),
        ({"n": "4"}, r"f.toml.n='4' must be int, not str"),
        ({"n": True}, r"f.toml.n=True must be int, not bool"),
        ({"n": 1.5}, r"must be int, not float"),
        ({"is_on": 1}, r"must be bool, not int"),
        ({"kind": "metal"}, r"f.toml.kind='metal' is unknown; known are numba, pyrender"),
        ({"span": [1]}, r"f.toml.span has 1 values, must have 2"),
        ({"span": ["a", "b"]}, r"f.toml.span\[0\]='a' must be float"),
        ({"weights": 3}, r"f.toml.weights=3 must be a table, not int"),
        ({"weights": {"table": -1}}, r"f.toml.weights: table=-1.0 must not be negative"),
    ],
)
def test_what_is_wrong_is_named(table, message):
    with pytest.raises(UserError, match=message):
        from_table(Settings, table, "f.toml")


def test_files_that_are_no_toml_are_named(tmp_path):
    with pytest.raises(UserError, match="No such file"):
        read_toml(tmp_path / "none.toml")
    (tmp_path / "bad.toml").write_text("a = = 1")
    with pytest.raises(UserError, match=r"bad.toml is not valid TOML"):
        read_toml(tmp_path / "bad.toml")
