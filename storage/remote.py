"""Files at URLs, such as s3://bucket/name: put whole, read whole, tried again; nothing is listed. Needs fsspec."""

import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

T = TypeVar("T")

N_TRIES = 5
WAIT_S = 0.3
"""After the first failure; doubles with each further one."""
_URL = re.compile(r"([a-z][a-z0-9+]+):/+(.+)")


def url_of(path: Path | str) -> str | None:
    """The URL that a path stands for, since a `Path` joins the slashes of one; None if it is a path of the system."""
    matched = _URL.fullmatch(str(path))
    return f"{matched[1]}://{matched[2]}" if matched else None


def put(url: str, content: bytes) -> None:
    """Writes a file whole, in place of an old one; doing so twice is the same as once.

    Raises:
        OSError: It cannot be written; names the URL.
    """
    _tried(url, lambda store, path: store.pipe_file(path, content))


def get(url: str) -> bytes:
    """Reads a file whole.

    Raises:
        FileNotFoundError: There is none.
        OSError: It cannot be read; names the URL.
    """
    return bytes(_tried(url, lambda store, path: store.cat_file(path)))


def _tried(url: str, act: Callable[[Any, str], T]) -> T:
    """Does something until it works; what is denied or missing is not tried again."""
    for attempt in range(N_TRIES):
        try:
            store, path = _store(url)
            return act(store, path)
        except FileNotFoundError as error:
            raise FileNotFoundError(error.errno or 2, "there is no such file", url) from None
        except PermissionError as error:
            raise PermissionError(error.errno or 13, "permission denied", url) from None
        except (ImportError, ValueError) as error:
            raise OSError(None, f"{error}", url) from None
        except Exception as error:  # of whatever client the store has
            if attempt + 1 == N_TRIES:
                words = " ".join(str(error).split())[:200] or type(error).__name__
                raise OSError(None, f"{words} (tried {N_TRIES} times)", url) from None
        time.sleep(WAIT_S * 2**attempt)
    raise AssertionError


def _store(url: str) -> tuple[Any, str]:
    try:
        import fsspec
    except ImportError:
        raise ImportError("URLs need fsspec: pip install 'undergrowth[remote]'") from None
    return fsspec.core.url_to_fs(url)
