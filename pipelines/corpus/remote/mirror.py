"""A corpus at a URL, read: its files come to a folder of this machine when they are first asked for."""

import hashlib
import os
from collections.abc import Iterator, Mapping
from pathlib import Path

from pipelines.corpus.header import HEADER_NAME, Header, read_header
from pipelines.corpus.manifest import MANIFEST_NAME, ShardLine
from pipelines.errors import CorpusError, in_words
from storage.atomic import write_atomically
from storage.remote import get

CACHE_VARIABLE = "UNDERGROWTH_CACHE"
"""Names the folder of what was read from URLs; by default undergrowth in the user's cache folder."""


def cache_folder(kind: str, url: str) -> Path:
    """The folder for one URL."""
    base = os.environ.get(CACHE_VARIABLE) or Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser()
    return Path(base) / "undergrowth" / kind / hashlib.sha256(url.encode()).hexdigest()[:20]


def mirror(url: str) -> Path:
    """The folder in which a corpus' files lie once they are read; header and manifest are there, as they are now.

    Raises:
        CorpusError: There is no finished corpus.
    """
    root = cache_folder("corpora", url)
    try:
        header, manifest = get(f"{url}/{HEADER_NAME}"), get(f"{url}/{MANIFEST_NAME}")
        root.mkdir(parents=True, exist_ok=True)
        write_atomically(root / HEADER_NAME, header)
        write_atomically(root / MANIFEST_NAME, manifest)
    except FileNotFoundError as error:
        raise CorpusError(f"{url} is not a finished corpus: there is no {error.filename}") from None
    except OSError as error:
        raise CorpusError(in_words(error, url)) from None
    return root


class MirroredFiles(Mapping[str, Path]):
    """Files of a shard by array name; each is read from the URL when it is first asked for, and checked.

    Args:
        url: Of the corpus.
        root: Its mirror.
        paths: Where the shard's files lie there.
        line: The shard's line of the manifest.
    """

    def __init__(self, url: str, root: Path, paths: Mapping[str, Path], line: ShardLine) -> None:
        self._url, self._root, self._paths, self._line = url, root, paths, line
        self._checked: set[str] = set()

    def __getitem__(self, name: str) -> Path:
        path = self._paths[name]
        if name not in self._checked:
            if not (path.is_file() and digest_of(path.read_bytes()) == self._line.sha256[name]):
                self._read(path, name)
            self._checked.add(name)
        return path

    def __iter__(self) -> Iterator[str]:
        return iter(self._paths)

    def __len__(self) -> int:
        return len(self._paths)

    def _read(self, path: Path, name: str) -> None:
        url = f"{self._url}/{path.relative_to(self._root).as_posix()}"
        try:
            content = get(url)
            if digest_of(content) != self._line.sha256[name]:
                raise CorpusError(f"{url} is damaged: it is not the file that the manifest names")
            path.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(path, content)
        except OSError as error:
            raise CorpusError(in_words(error, url)) from None


def digest_of(content: bytes) -> str:
    """SHA-256, as the manifest has it."""
    return hashlib.sha256(content).hexdigest()


def header_at(url: str, scratch: Path) -> Header | None:
    """The header of a corpus that was begun at a URL, or None.

    Args:
        url: Of the corpus.
        scratch: A folder to read it by.
    """
    try:
        content = get(f"{url}/{HEADER_NAME}")
    except FileNotFoundError:
        return None
    scratch.mkdir(parents=True, exist_ok=True)
    write_atomically(scratch / HEADER_NAME, content)
    return read_header(scratch)
