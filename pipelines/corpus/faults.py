"""Everything that can be wrong with a corpus on disk: every fault as a sentence, by shard and frame."""

import hashlib
from collections.abc import Callable, Iterator

import numpy as np

from pipelines.corpus import shards
from pipelines.corpus.fields import SHARD_FRAMES
from pipelines.corpus.frameinfo import split_ids
from pipelines.corpus.laws import broken_laws
from pipelines.corpus.manifest import ShardLine
from pipelines.corpus.read import Corpus
from pipelines.corpus.rooms.laws import broken_room_laws
from pipelines.corpus.rooms.together import scene_faults
from pipelines.corpus.write import ZARR_NAME
from pipelines.errors import CorpusError
from synth.vocabulary import SPLITS


def faults(
    corpus: Corpus, with_laws: bool = True, on_frames: Callable[[int], object] = lambda n: None
) -> Iterator[str]:
    """Everything wrong with a corpus, one sentence each.

    Args:
        corpus: An open corpus; opening has checked header, manifest and splits.
        with_laws: Look at every frame's contents too, not at digests alone.
        on_frames: Told how many frames were gone through.
    """
    yield from _metadata_faults(corpus)
    for shard in sorted(corpus.lines):
        yield from shard_faults(corpus, corpus.lines[shard])
        if with_laws:
            yield from _law_faults(corpus, corpus.lines[shard])
        on_frames(corpus.lines[shard].n_frames)
    if with_laws:
        yield from _scene_faults(corpus)


def _scene_faults(corpus: Corpus) -> Iterator[str]:
    """What does not belong together in clips and in the views of one scene."""
    try:
        yield from scene_faults(corpus)
    except CorpusError as error:
        yield str(error)


def _metadata_faults(corpus: Corpus) -> Iterator[str]:
    if corpus.url is not None:
        return  # zarr's own; nothing here reads them
    root = corpus.path / ZARR_NAME
    expected = {root / "zarr.json": shards.group_metadata()}
    for item in corpus.header.fields.values():
        expected[root / item.name / "zarr.json"] = shards.array_metadata(item, corpus.header.n_frames)
    for path, text in expected.items():
        if not path.is_file() or path.read_bytes() != text.encode():
            yield f"{path} is missing or damaged"


def shard_faults(corpus: Corpus, line: ShardLine) -> Iterator[str]:
    """Files of a shard whose bytes are not those of the manifest, with the frames that are hit."""
    for name, path in corpus.files(line.shard).items():
        frames = f"frames {line.first}..{line.first + line.n_frames - 1}"
        if not path.is_file():
            yield f"shard {line.shard} ({frames}): {path} is missing"
            continue
        data = path.read_bytes()
        if hashlib.sha256(data).hexdigest() != line.sha256[name]:
            hit = _damaged_frames(corpus, line, name)
            which = f"frame {', '.join(map(str, hit))}" if hit else frames
            yield f"shard {line.shard} ({which}): {path} is damaged: its digest differs from the manifest"
        elif len(data) != line.n_bytes[name]:
            told = f"the manifest says {line.n_bytes[name]} bytes, it holds {len(data)}"
            yield f"shard {line.shard} ({frames}): the manifest is damaged: {told} ({path})"
    yield from _record_faults(corpus, line)


def _damaged_frames(corpus: Corpus, line: ShardLine, name: str) -> list[int]:
    """Frames of one file that cannot be decoded; empty if it is not known which are hit."""
    item = corpus.header.fields.get(name)
    if item is None or not item.is_image:
        return []
    hit = []
    for index in range(line.first, line.first + line.n_frames):
        try:
            corpus.arrays(name, [index])
        except CorpusError:
            hit.append(index)
    return hit


def _record_faults(corpus: Corpus, line: ShardLine) -> Iterator[str]:
    """Whether manifest, records and the split array say the same."""
    numbers = np.arange(line.first, line.first + line.n_frames)
    try:
        infos = [corpus.record(int(i)) for i in numbers]
        splits = corpus.arrays("split", numbers)
    except CorpusError as error:
        yield f"shard {line.shard}: {error}"
        return
    if split_ids(infos) != line.splits:
        yield f"shard {line.shard}: its records name other subjects, objects or poses than the manifest"
    for info, code in zip(infos, splits, strict=True):
        if code >= len(SPLITS) or SPLITS[code] != info.split:
            yield f"frame {info.index}: its record says split {info.split}, the array {code}"


def _law_faults(corpus: Corpus, line: ShardLine) -> Iterator[str]:
    for index in range(line.first, min(line.first + line.n_frames, line.first + SHARD_FRAMES)):
        try:
            broken = (
                broken_room_laws(corpus.scene(index), corpus.header)
                if corpus.header.has_rooms
                else broken_laws(corpus[index], corpus.header)
            )
        except CorpusError as error:
            yield f"frame {index}: {error}"
            continue
        for sentence in broken:
            yield f"frame {index}: {sentence}"
