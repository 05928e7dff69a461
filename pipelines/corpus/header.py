"""corpus.json: what a corpus was made of and how its codes read."""

import functools
import hashlib
import importlib.metadata
import json
import platform
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

import numpy as np

from pipelines.corpus.fields import SHARD_FRAMES, Field, fields_of, moment_fields, motion_fields, room_fields_of
from pipelines.errors import CorpusError
from storage.ranges import MAX_FRAMES, MAX_SEED
from synth.camera import MAX_SIDE
from synth.vocabulary import (
    BONES,
    JOINT_NAMES,
    OCCLUDER_CLASSES,
    PART_NAMES,
    SCENE_CLASSES,
    SINGLE_STATES,
    SPLITS,
    JointState,
)

SCHEMA = "undergrowth corpus"
SCHEMA_VERSION = 1
"""Of frames that show one person."""
ROOM_SCHEMA_VERSION = 2
"""Of whole scenes."""
HEADER_NAME = "corpus.json"
_PACKAGES = ("numpy", "numba", "numcodecs", "scipy")
Angles = tuple[tuple[str, float, float], ...]
"""Name, lower and upper limit [rad] of each joint angle of the skeleton; empty if it has none to tell."""

_ROOM_CONVENTIONS = {
    "world": "right-handed, z up, ground z = 0, metres; the origin is the middle of the room's floor",
    "people": "entries of people count from 0, the image `person` from 1; n_people says how many entries are used",
    "body layer": "of person k: equal to the composite where person == k + 1 and hidden_part[k] == 0, else "
    "hidden_depth[k] and hidden_part[k]",
}
"""What schema 2 says otherwise."""
_CONVENTIONS = {
    "world": "right-handed, z up, ground z = 0, metres",
    "camera": "OpenCV axes: x right, y down, z forward; pixel centres at integers, u = fx*X/Z + cx",
    "depth": "along the optical axis, uint16 millimetres, 0 = no return",
    "left and right": "the person's own",
    "body layer": "equal to the composite where part > 0 and hidden_part == 0, else hidden_depth and hidden_part",
}


@dataclass(frozen=True)
class Header:
    """What corpus.json says.

    Attributes:
        schema_version: 1 for frames that show one person, 2 for whole scenes.
        seed: The corpus seed.
        n_frames: Frames of the whole corpus.
        height: Image height [px].
        width: Image width [px].
        n_dof: Joint angles of the skeleton.
        config: The resolved configuration as JSON values.
        labels: Names of joints, bones, joint states, parts, occluder classes and splits, in order of code; names
            and limits of the joint angles.
        software: Versions of what made it.
        digest: SHA-256 over all of the above.
    """

    schema_version: int
    seed: int
    n_frames: int
    height: int
    width: int
    n_dof: int
    config: dict
    labels: dict
    software: dict
    digest: str

    @property
    def n_shards(self) -> int:
        """Shards of the whole corpus."""
        return -(-self.n_frames // SHARD_FRAMES)

    @property
    def is_recorded(self) -> bool:
        """Whether a real camera measured its people: `import depth`, or objects put before them."""
        return "import" in self.config or "into" in self.config

    @property
    def has_rooms(self) -> bool:
        """Whether the frames are whole scenes."""
        return self.schema_version == ROOM_SCHEMA_VERSION

    @property
    def cameras(self) -> int:
        """Cameras that see each scene at the same time."""
        return _count(self.config, "cameras", 1)

    @property
    def clip_steps(self) -> int:
        """Time steps of a clip; 0 if the frames are single moments."""
        return _count(self.config, "clip", 0)

    @property
    def frames_a_scene(self) -> int:
        """Consecutive frames that show one scene: every camera at every time step."""
        return self.cameras * max(self.clip_steps, 1)

    @functools.cached_property
    def fields(self) -> dict[str, Field]:
        """The stored arrays by name."""
        fields = room_fields_of if self.has_rooms else fields_of
        listed = fields(self.height, self.width, self.n_dof)
        if self.frames_a_scene > 1 or self.clip_steps:
            listed |= moment_fields()
        return listed | motion_fields() if self.clip_steps else listed

    def frames_of(self, shard: int) -> range:
        """Frame numbers of a shard."""
        return range(shard * SHARD_FRAMES, min(self.n_frames, (shard + 1) * SHARD_FRAMES))


def _count(config: dict, name: str, otherwise: int) -> int:
    """A whole number of the settings of drawn scenes."""
    scene = config.get("scene")
    value = scene.get(name, otherwise) if isinstance(scene, dict) else otherwise
    return value if isinstance(value, int) and value > 0 else otherwise


def label_tables(schema_version: int = SCHEMA_VERSION) -> dict:
    """Names by code, as plain JSON values."""
    has_rooms = schema_version == ROOM_SCHEMA_VERSION
    return {
        "joints": list(JOINT_NAMES),
        "bones": [list(bone) for bone in BONES],
        "joint_states": [state.name.lower() for state in (JointState if has_rooms else SINGLE_STATES)],
        "parts": list(PART_NAMES),
        "occluders": list(SCENE_CLASSES if has_rooms else OCCLUDER_CLASSES),
        "splits": list(SPLITS),
    }


def software_versions() -> dict:
    """Versions that the bytes of a frame may hang on."""
    versions = {"undergrowth": version_of("undergrowth"), "python": platform.python_version()}
    return versions | {name: version_of(name) for name in _PACKAGES}


def version_of(package: str) -> str:
    """Version of an installed package; "source tree" if it is not installed."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "source tree"


def plain_json(value: object) -> object:
    """Turns numpy scalars and arrays into JSON values; for `json.dumps(default=...)`."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise TypeError(f"{value!r} of type {type(value).__name__} is no JSON value")


def build_header(
    seed: int,
    n_frames: int,
    config: dict,
    angles: Angles,
    size: tuple[int, int],
    n_dof: int,
    schema_version: int = SCHEMA_VERSION,
) -> dict:
    """The document of corpus.json, digest last."""
    has_rooms = schema_version == ROOM_SCHEMA_VERSION
    document = {
        "schema": SCHEMA,
        "schema_version": schema_version,
        "seed": seed,
        "n_frames": n_frames,
        "height": size[0],
        "width": size[1],
        "n_dof": n_dof,
        "shard_frames": SHARD_FRAMES,
        "config": json.loads(json.dumps(config, default=plain_json)),
        "labels": label_tables(schema_version) | {"angles": [list(angle) for angle in angles]},
        "conventions": _CONVENTIONS | (_ROOM_CONVENTIONS if has_rooms else {}),
        "software": software_versions(),
    }
    return document | {"digest": digest_of(document)}


def _check_labels(path: Path, there: object, schema_version: int) -> None:
    """Refuses codes that read otherwise here.

    The program knows joints, states, parts and splits by their codes, so that these tables must be its own. Of the
    occluder classes a corpus may lack the last ones, which were added after it was made.
    """
    if not isinstance(there, dict):
        raise CorpusError(f"{path} is damaged: it has no label tables")
    angles = there.get("angles")
    if not isinstance(angles, list) or not all(map(_is_angle, angles)):
        raise CorpusError(f"{path} is damaged: its joint angles must be names with two limits")
    for name, here in label_tables(schema_version).items():
        given = there.get(name)
        if not isinstance(given, list):
            raise CorpusError(f"{path} is damaged: it has no table of {name}")
        known = here[: len(given)] if name == "occluders" and given else here
        if given != known:
            code, theirs, ours = next(
                (code, *pair) for code, pair in enumerate(zip_longest(given, known)) if pair[0] != pair[1]
            )
            raise CorpusError(f"{path} has other {name}: code {code} is {theirs!r}, this program reads {ours!r}")


def _is_angle(value: object) -> bool:
    """Whether a value is a name with two limits."""
    if not isinstance(value, list) or len(value) != 3:
        return False
    name, *limits = value
    return isinstance(name, str) and all(isinstance(limit, int | float) for limit in limits)


def digest_of(document: dict) -> str:
    """SHA-256 of all of the document but its digest."""
    rest = {key: value for key, value in document.items() if key != "digest"}
    return hashlib.sha256(json.dumps(rest, sort_keys=True).encode()).hexdigest()


_RANGES = {
    "seed": (0, MAX_SEED),
    "n_frames": (1, MAX_FRAMES),
    "height": (1, MAX_SIDE),
    "width": (1, MAX_SIDE),
    "n_dof": (0, 1000),
    "shard_frames": (SHARD_FRAMES, SHARD_FRAMES),
}
"""Whole numbers of corpus.json."""


def read_header(root: Path) -> Header:
    """Reads and checks corpus.json.

    Raises:
        CorpusError: There is none, it is damaged, or its schema is another.
    """
    path = root / HEADER_NAME
    try:
        document = json.loads(path.read_bytes())
    except (FileNotFoundError, NotADirectoryError):
        raise CorpusError(f"{root} is not a corpus: it has no {HEADER_NAME}") from None
    except (ValueError, RecursionError) as error:
        raise CorpusError(f"{path} is damaged: {error}") from None
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        raise CorpusError(f"{path} is not the header of an undergrowth corpus")
    version = document.get("schema_version")
    if version not in (SCHEMA_VERSION, ROOM_SCHEMA_VERSION):
        raise CorpusError(
            f"{path} has schema version {version}; this program reads versions {SCHEMA_VERSION} and "
            f"{ROOM_SCHEMA_VERSION}"
        )
    if document.get("digest") != digest_of(document):
        raise CorpusError(f"{path} is damaged: its digest does not match its contents")
    _check_labels(path, document.get("labels"), version)
    return _header(path, document)


def _header(path: Path, document: dict) -> Header:
    """The header of a document whose digest and labels are right; no number of it asks for absurd memory."""
    for name in ("config", "software"):
        if not isinstance(document.get(name), dict):
            raise CorpusError(f"{path} is damaged: {name} must hold values by name")
    for name, (least, most) in _RANGES.items():
        value = document.get(name)
        if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
            raise CorpusError(f"{path} is damaged: {name}={value!r:.40} must be a whole number in {least}..{most}")
    if len(document["labels"]["angles"]) > document["n_dof"]:
        raise CorpusError(f"{path} is damaged: it names more joint angles than it has")
    return Header(**{name: document[name] for name in Header.__dataclass_fields__})
