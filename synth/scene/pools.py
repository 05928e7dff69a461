"""The subjects and objects that a block of frames shares, made from (seed, split, number) alone and cached."""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from synth.bodies.body import Body
from synth.bodies.shape.make import make_body
from synth.bodies.spec import SKIRTS, BodySpec, sample_body
from synth.geometry import surface_points
from synth.occluders import registry
from synth.occluders.meshlib import IMPORTED, MeshModel
from synth.occluders.model import Occluder
from synth.scene.config import DRAWS_PER_BLOCK, SceneConfig
from synth.scene.objects import ObjectMix
from synth.vocabulary import N_PARTS, OCCLUDER_CODE, SPLITS

Key = TypeVar("Key")
Value = TypeVar("Value")

_SUBJECT_STREAM, _OBJECT_STREAM = 1, 2
_MAX_SUBJECTS, _MAX_OBJECTS = 24, 256
"""How many the caches keep; a pool has at most 64 subjects, and as many objects of a class."""


SURFACE_SPACING = 0.08
"""Distance between the points that stand for an object's surface [m]."""


@dataclass(frozen=True)
class Subject:
    """A body of the corpus.

    Attributes:
        subject_id: "subject/<split>/<number>".
        body: The body.
        vertex_part: (n_vertices,) uint8, body part of each vertex (of one of its faces).
        spec: What the body was made from, as plain JSON values.
    """

    subject_id: str
    body: Body
    vertex_part: NDArray[np.uint8]
    spec: dict[str, object]
    _rows: dict[tuple[str, frozenset[int]], NDArray[np.int64]] = field(default_factory=dict, repr=False)

    def vertices_of(self, parts: frozenset[int]) -> NDArray[np.int64]:
        """(m,) indices of the vertices that belong to these parts."""
        return self._rows_of("vertices", parts, lambda: is_among(parts, self.vertex_part))

    def vertices_without(self, parts: frozenset[int]) -> NDArray[np.int64]:
        """(m,) indices of the vertices that do not belong to these parts."""
        return self._rows_of("others", parts, lambda: ~is_among(parts, self.vertex_part))

    def faces_of(self, parts: frozenset[int]) -> NDArray[np.int64]:
        """(m,) indices of the faces that belong to these parts."""
        return self._rows_of("faces", parts, lambda: is_among(parts, self.body.mesh.face_label))

    def _rows_of(
        self, kind: str, parts: frozenset[int], find: Callable[[], NDArray[np.bool_]]
    ) -> NDArray[np.int64]:
        if (kind, parts) not in self._rows:
            self._rows[kind, parts] = np.flatnonzero(find())
        return self._rows[kind, parts]


@dataclass(frozen=True)
class PooledObject:
    """An object of the corpus.

    Attributes:
        spec_id: "<class>/<kind>/<split>/<number>".
        spec: Its fields as plain JSON values.
        occluder: The thing itself.
        surface: (n_points, 3) points spread over its surface, its own frame [m].
    """

    spec_id: str
    spec: dict[str, object]
    occluder: Occluder
    surface: NDArray[np.float64]


class Pools:
    """Makes and keeps the subjects and objects of a corpus.

    Args:
        config: How many frames share a subject or object.
        seed: The corpus seed.
        imported: Imported objects among the procedural ones.
        max_subjects: How many subjects are kept.
    """

    def __init__(
        self,
        config: SceneConfig,
        seed: int,
        imported: ObjectMix | None = None,
        max_subjects: int = _MAX_SUBJECTS,
    ) -> None:
        self._config = config
        self._seed = seed
        self._subjects: OrderedDict[tuple[str, int, str], Subject] = OrderedDict()
        self._specs: OrderedDict[tuple[str, int], BodySpec] = OrderedDict()
        self._objects: OrderedDict[tuple[str, str, int], PooledObject] = OrderedDict()
        self._imported = imported
        self._max_subjects = max_subjects
        self._models: OrderedDict[str, PooledObject] = OrderedDict()

    def draw_subject(self, split: str, frame_idx: int, rng: np.random.Generator, is_seated: bool) -> Subject:
        """One of the subjects of the frame's block, dressed for a seat if they sit."""
        return self.subject(split, _draw_number(frame_idx, self._config.frames_per_subject, rng), is_seated)

    def subject(self, split: str, number: int, is_seated: bool) -> Subject:
        """The subject of a number, dressed for a seat if they sit."""
        spec = self._subject_spec(split, number)
        spec = dressed_to_sit(spec) if is_seated else spec
        key = (split, number, spec.bottom)
        return cached(self._subjects, key, self._max_subjects, lambda: _make_subject(spec, split, number))

    def draw_object(
        self, class_name: str, split: str, frame_idx: int, rng: np.random.Generator, kinds: tuple[str, ...] = ()
    ) -> PooledObject:
        """One of the class's objects of the frame's block; of one of the kinds, if any are given.

        A block's objects take the kinds in turn, so that every block has several. Imported objects are drawn from
        all of the split's, of which only those with a role among the kinds will do, if any are given.
        """
        model = None if self._imported is None else self._imported.draw(class_name, split, kinds, rng)
        if model is not None:
            return cached(self._models, model.name, _MAX_OBJECTS, lambda: _pooled(model))
        kinds = kinds or registry.KINDS[class_name]
        number = _draw_number(frame_idx, self._config.frames_per_object, rng)
        kind = kinds[number % len(kinds)]
        key = (split, kind, number)
        return cached(self._objects, key, _MAX_OBJECTS, lambda: self._make_object(class_name, kind, split, number))

    def _subject_spec(self, split: str, number: int) -> BodySpec:
        stream = [self._seed, _SUBJECT_STREAM, SPLITS.index(split), number]

        def draw() -> BodySpec:
            rng = np.random.default_rng(stream)
            spec = sample_body(rng, self._config.child_share, self._config.wardrobe)
            share = self._config.stature_share
            if spec.age < 18.0 or share == 0.0 or (share < 1.0 and rng.random() >= share):
                return spec
            stature = round(float(rng.uniform(*self._config.stature)), 3)
            return replace(spec, stature=stature, mass=round(spec.mass * (stature / spec.stature) ** 2, 1))

        return cached(self._specs, (split, number), _MAX_OBJECTS, draw)

    def _make_object(self, class_name: str, kind: str, split: str, number: int) -> PooledObject:
        kind_idx = registry.KINDS[class_name].index(kind)
        stream = [self._seed, _OBJECT_STREAM, SPLITS.index(split), number, OCCLUDER_CODE[class_name], kind_idx]
        spec = registry.sample(class_name, np.random.default_rng(stream), kind=kind)
        spec_id = f"{class_name}/{kind}/{split}/{number:05d}"
        occluder = registry.make(spec)
        return PooledObject(
            spec_id, registry.to_plain(spec), occluder, surface_points(occluder.mesh, SURFACE_SPACING)
        )


def is_among(parts: frozenset[int], labels: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """(n,) whether each label is one of the parts; by table, which is faster than `np.isin`."""
    table = np.zeros(N_PARTS + 1, dtype=np.bool_)
    table[list(parts)] = True
    return table[labels]


def _pooled(model: MeshModel) -> PooledObject:
    spec: dict[str, object] = {"kind": IMPORTED, "name": model.name}
    return PooledObject(model.spec_id, spec, model.occluder, surface_points(model.occluder.mesh, SURFACE_SPACING))


def dressed_to_sit(spec: BodySpec) -> BodySpec:
    """The same person in trousers, if they wear a skirt or a coat: its surface stands, but cannot drape on a lap."""
    if spec.bottom == "coat":
        return replace(spec, bottom="straight")
    return replace(spec, bottom="trousers", bottom_ease=0.01) if spec.bottom in SKIRTS else spec


def _make_subject(spec: BodySpec, split: str, number: int) -> Subject:
    body = make_body(spec)
    vertex_part = np.zeros(len(body.mesh.vertices), dtype=np.uint8)
    vertex_part[body.mesh.faces.ravel()] = np.repeat(body.mesh.face_label, 3)
    return Subject(f"subject/{split}/{number:05d}", body, vertex_part, spec.plain())


def per_block(frames_each: int) -> int:
    """How many entries a block of frames shares, for each to be in so many frames on average."""
    return -(-DRAWS_PER_BLOCK // frames_each)


def _draw_number(frame_idx: int, frames_each: int, rng: np.random.Generator) -> int:
    """Number of one of the entries that the frame's block of the split shares."""
    n_each = per_block(frames_each)
    return (frame_idx // DRAWS_PER_BLOCK) * n_each + int(rng.integers(n_each))


def cached(cache: OrderedDict[Key, Value], key: Key, n_max: int, make: Callable[[], Value]) -> Value:
    """What a cache has under a key, made now if it has nothing; the entry that was used longest ago makes room."""
    if key in cache:
        cache.move_to_end(key)
        return cache[key]
    value = make()
    cache[key] = value
    if len(cache) > n_max:
        cache.popitem(last=False)
    return value
