"""Digests by which finished work is found again."""

import functools
import hashlib
import json
from dataclasses import asdict, is_dataclass
from pathlib import Path

from pipelines.corpus.header import software_versions

ROOT = Path(__file__).parents[2]
"""Folder of the packages."""


def digest_of(*values: object) -> str:
    """SHA-256 of values: plain JSON ones, and dataclasses of such."""
    return hashlib.sha256(json.dumps(values, sort_keys=True, default=_plain).encode()).hexdigest()


def _plain(value: object) -> object:
    if is_dataclass(value) and not isinstance(value, type):
        return asdict(value)
    raise TypeError(f"{value!r} of type {type(value).__name__} is no JSON value")


@functools.cache
def versions() -> dict:
    """Versions of Python and the libraries."""
    return software_versions()


@functools.cache
def sources_digest(*places: str) -> str:
    """SHA-256 of the Python files under some folders, or of some files, relative to the packages' folder."""
    digest = hashlib.sha256()
    for place in places:
        path = ROOT / place
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            digest.update(f"{file.relative_to(ROOT).as_posix()}\0".encode())
            digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()
