"""Deals imported subjects and models to the splits: by name, by pattern, else by a hash of the name."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase

from pipelines.errors import UserError
from synth.vocabulary import SPLITS

SHARES: Mapping[str, float] = {"train": 0.7, "val": 0.1, "test": 0.2}
"""How names that no list holds are dealt to the splits."""


@dataclass(frozen=True)
class SplitRule:
    """Which split a name belongs to.

    Attributes:
        train: Names, or patterns such as '0*', that belong to this split.
        val: Likewise.
        test: Likewise.
        seed: Deals out the names that no list holds, each independently of the others.
    """

    train: tuple[str, ...] = ()
    val: tuple[str, ...] = ()
    test: tuple[str, ...] = ()
    seed: int = 0

    def __post_init__(self) -> None:
        first: dict[str, str] = {}
        for split in SPLITS:
            for name in getattr(self, split):
                if first.setdefault(name, split) != split:
                    raise UserError(f"{name} is listed for {first[name]} and for {split}")

    def split_of(self, name: str) -> str:
        """The split of a name; a list that holds the name itself counts before one with a pattern."""
        for matches in (str.__eq__, fnmatchcase):
            for split in SPLITS:
                if any(matches(name, listed) for listed in getattr(self, split)):
                    return split
        digest = hashlib.sha256(f"{self.seed}/{name}".encode(errors="surrogateescape")).digest()
        drawn = int.from_bytes(digest[:8], "big") / 2.0**64
        for split, share in SHARES.items():
            drawn -= share
            if drawn < 0.0:
                return split
        return SPLITS[-1]
