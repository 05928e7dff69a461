"""manifest.jsonl: one line a finished shard, which alone says that the shard exists."""

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path

from pipelines.corpus.header import Header
from pipelines.errors import CorpusError
from storage.atomic import append, write_atomically
from synth.vocabulary import SPLITS

MANIFEST_NAME = "manifest.jsonl"


@dataclass(frozen=True)
class SplitIds:
    """Who and what stands in one split's frames of a shard, each list sorted.

    Attributes:
        n_frames: Frames of that split.
        subjects: Subject identifiers.
        objects: Object spec identifiers.
        poses: Pose draw identifiers.
    """

    n_frames: int
    subjects: list[str]
    objects: list[str]
    poses: list[str]


@dataclass(frozen=True)
class ShardLine:
    """One line of the manifest.

    Attributes:
        shard: The shard's number.
        first: Its first frame.
        n_frames: How many frames it holds.
        n_bytes: Size of each of its files, by array name; "info" is the JSON lines file.
        sha256: Digest of each of its files' bytes.
        splits: What its frames hold, by split.
    """

    shard: int
    first: int
    n_frames: int
    n_bytes: dict[str, int]
    sha256: dict[str, str]
    splits: dict[str, SplitIds] = field(repr=False)

    def to_json(self) -> str:
        """The line, without its end."""
        return json.dumps(asdict(self), separators=(",", ":"), sort_keys=True)


def _parse(text: str, header: Header) -> ShardLine:
    """A line whose every value is of its type and fits the header.

    Raises:
        ValueError, KeyError, TypeError, AttributeError, RecursionError: It is none.
    """
    values = json.loads(text)
    values["splits"] = {name: SplitIds(**ids) for name, ids in values["splits"].items()}
    line = ShardLine(**values)
    frames = header.frames_of(line.shard) if _is_count(line.shard) else range(0)
    if not frames or (line.first, line.n_frames) != (frames.start, len(frames)):
        raise ValueError(f"shard {line.shard!r:.40} has the wrong frames")
    files = {*header.fields, "info"}
    if set(line.n_bytes) != files or not all(map(_is_count, line.n_bytes.values())):
        raise ValueError("n_bytes must give a size for each array")
    if set(line.sha256) != files or not all(isinstance(digest, str) for digest in line.sha256.values()):
        raise ValueError("sha256 must give a digest for each array")
    for split, ids in line.splits.items():
        listed = (ids.subjects, ids.objects, ids.poses)
        is_names = all(isinstance(names, list) and all(isinstance(n, str) for n in names) for names in listed)
        if split not in SPLITS or not is_names or not _is_count(ids.n_frames):
            raise ValueError(f"the split {split!r:.40} must be known, and hold a number and three lists of names")
    return line


def _is_count(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def read_manifest(root: Path, header: Header) -> dict[int, ShardLine]:
    """Finished shards by number; a last line without its end was cut by an interruption and does not count.

    Args:
        root: The corpus folder.
        header: Its header, which the lines must fit.

    Raises:
        CorpusError: A line before the last cannot be read, or does not fit the header.
    """
    return read_lines_of(root / MANIFEST_NAME, header)


def part_path(root: Path, shards: range) -> Path:
    """The manifest of the shards that one job of an array makes, until `undergrowth join` adds them to the corpus'."""
    return root / f"manifest-{shards.start:06d}-{shards.stop:06d}.jsonl"


def part_paths(root: Path) -> list[Path]:
    """Manifests of all jobs that have written here."""
    return sorted(root.glob("manifest-*-*.jsonl"))


def read_lines_of(path: Path, header: Header) -> dict[int, ShardLine]:
    """The lines of one manifest, as `read_manifest` reads them."""
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return {}
    except UnicodeDecodeError as error:
        raise CorpusError(f"{path} is damaged: {error}") from None
    lines = {}
    for number, line in enumerate(text.split("\n")[:-1], start=1):
        try:
            parsed = _parse(line, header)
        except KeyError as error:
            raise CorpusError(f"line {number} of {path} is damaged: it lacks {error}") from None
        except (ValueError, TypeError, AttributeError, RecursionError) as error:
            raise CorpusError(f"line {number} of {path} is damaged: {error}") from None
        lines[parsed.shard] = parsed
    return lines


def append_line(path: Path, line: ShardLine) -> None:
    """Adds a finished shard to a manifest; on the disk when this returns."""
    append(path, line.to_json() + "\n")


def rewrite_manifest(path: Path, lines: dict[int, ShardLine]) -> None:
    """Replaces a manifest by its lines in order of shard."""
    write_atomically(path, "".join(lines[shard].to_json() + "\n" for shard in sorted(lines)))
