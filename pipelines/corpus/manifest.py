"""manifest.jsonl: one line a finished shard, which alone says that the shard exists."""

import json
import os
from dataclasses import asdict, dataclass, field
from pathlib import Path

from pipelines.errors import CorpusError
from storage.atomic import write_atomically

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


def _parse(text: str) -> ShardLine:
    values = json.loads(text)
    values["splits"] = {name: SplitIds(**ids) for name, ids in values["splits"].items()}
    return ShardLine(**values)


def read_manifest(root: Path) -> dict[int, ShardLine]:
    """Finished shards by number; a last line without its end was cut by an interruption and does not count.

    Raises:
        CorpusError: A line before the last cannot be read.
    """
    path = root / MANIFEST_NAME
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return {}
    except UnicodeDecodeError as error:
        raise CorpusError(f"{path} is damaged: {error}") from None
    lines = {}
    for number, line in enumerate(text.split("\n")[:-1], start=1):
        try:
            parsed = _parse(line)
        except (json.JSONDecodeError, TypeError, KeyError, AttributeError):
            raise CorpusError(f"line {number} of {path} is damaged") from None
        lines[parsed.shard] = parsed
    return lines


def append_line(root: Path, line: ShardLine) -> None:
    """Adds a finished shard; on the disk when this returns."""
    with (root / MANIFEST_NAME).open("a", encoding="utf-8") as file:
        file.write(line.to_json() + "\n")
        file.flush()
        os.fsync(file.fileno())


def rewrite_manifest(root: Path, lines: dict[int, ShardLine]) -> None:
    """Replaces the manifest by its lines in order of shard."""
    write_atomically(root / MANIFEST_NAME, "".join(lines[shard].to_json() + "\n" for shard in sorted(lines)))
