"""A corpus at a URL, written: each shard made in a folder of this machine and put, the manifest put last."""

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from pipelines.corpus.folder import Order, locked_folder, prepare_folder
from pipelines.corpus.header import HEADER_NAME, Header
from pipelines.corpus.manifest import MANIFEST_NAME, ShardLine, append_line, read_manifest, rewrite_manifest
from pipelines.corpus.remote.mirror import cache_folder, header_at
from pipelines.corpus.run import Progress
from pipelines.corpus.write import ZARR_NAME, FrameSource, shard_files, write_shard
from pipelines.errors import UserError, in_words
from storage.remote import put

RemoteRunner = Callable[[str, Header, Order, list[int]], Iterator[ShardLine]]
"""Puts shards of an order to a URL, in any order, and yields the manifest's lines of those that are there."""


def write_remote_corpus(
    url: str, order: Order, progress: Progress | None = None, runner: RemoteRunner | None = None
) -> Header:
    """Makes the corpus ordered at a URL, going on where an earlier run on this machine stopped.

    What was put is remembered in the cache folder of this machine. Without it, all shards are made and put again, to
    the same bytes.

    Args:
        url: Where.
        order: What to make.
        progress: Told of every shard.
        runner: Makes and puts the shards in place of this process.

    Raises:
        UserError: Another corpus is there, or the store refuses.
    """
    staging = cache_folder("staging", url)
    tell = progress or (lambda done, earlier: None)
    try:
        staging.mkdir(parents=True, exist_ok=True)
        with locked_folder(staging):
            header = _begun(url, order, staging)
            lines = read_manifest(staging, header)
            rewrite_manifest(staging / MANIFEST_NAME, lines)
            n_earlier = sum(line.n_frames for line in lines.values())
            tell(n_earlier, n_earlier)
            missing = [shard for shard in range(header.n_shards) if shard not in lines]
            for line in (runner or _put_here)(url, header, order, missing):
                append_line(staging / MANIFEST_NAME, line)
                lines[line.shard] = line
                tell(sum(other.n_frames for other in lines.values()), n_earlier)
            rewrite_manifest(staging / MANIFEST_NAME, lines)
            put(f"{url}/{MANIFEST_NAME}", (staging / MANIFEST_NAME).read_bytes())
    except OSError as error:
        raise UserError(in_words(error, url)) from None
    return header


def _begun(url: str, order: Order, staging: Path) -> Header:
    """Puts the header and the arrays' metadata, unless another corpus is there.

    Raises:
        UserError: Another corpus is there.
    """
    header = prepare_folder(staging, order)
    there = header_at(url, staging / "there")
    if there is not None and there.digest != header.digest:
        raise UserError(f"{url} holds a corpus with other settings; choose another URL")
    for path in [staging / HEADER_NAME, *sorted((staging / ZARR_NAME).rglob("zarr.json"))]:
        put(f"{url}/{path.relative_to(staging).as_posix()}", path.read_bytes())
    return header


def _put_here(url: str, header: Header, order: Order, missing: list[int]) -> Iterator[ShardLine]:
    source = order.make_source() if missing else None
    for shard in missing:
        assert source is not None
        yield put_shard(url, header, source, shard)


def put_shard(url: str, header: Header, source: FrameSource, shard: int) -> ShardLine:
    """Makes one shard and puts its files; all are there when this returns.

    Raises:
        OSError: One cannot be put; names its URL.
    """
    with tempfile.TemporaryDirectory(prefix="undergrowth-") as name:
        root = Path(name)
        line = write_shard(root, header, source, shard)
        for path in shard_files(root, header, shard).values():
            put(f"{url}/{path.relative_to(root).as_posix()}", path.read_bytes())
    return line
