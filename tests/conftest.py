"""Gives numba a cache of its own for every state of the sources.

Numba looks at the file of the function that it compiles, not at the files of the functions called from there, so a
shared cache may run machine code of an earlier callee.
"""

import contextlib
import hashlib
import os
import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
UNUSED_S = 3 * 3600.0
"""Caches that no run of the tests has begun with for so long are removed [s]."""


def sources_digest() -> str:
    """A name for the present contents of the packages."""
    digest = hashlib.sha256()
    for package in ("storage", "synth", "forests", "nets", "pipelines"):
        for path in sorted((ROOT / package).rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                digest.update(f"{path.relative_to(ROOT)}\0".encode())
                digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:16]


def set_numba_cache() -> None:
    """Names the cache in the environment, which workers of pytest-xdist and processes of the tests inherit."""
    caches = ROOT / ".numba_cache"
    cache = caches / sources_digest()
    cache.mkdir(parents=True, exist_ok=True)
    os.utime(cache)
    os.environ["NUMBA_CACHE_DIR"] = str(cache)
    newest = cache.stat().st_mtime
    for old in caches.iterdir():
        with contextlib.suppress(FileNotFoundError):
            if newest - old.stat().st_mtime > UNUSED_S:
                shutil.rmtree(old, ignore_errors=True)


if not os.environ.get("NUMBA_CACHE_DIR"):
    set_numba_cache()
