"""undergrowth generate: a corpus out of a seed and settings, of drawn people or of recorded ones."""

import functools
import logging
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Annotated, Literal

import tyro

from pipelines.corpus import Header, Order, write_corpus
from pipelines.errors import UserError
from pipelines.generation.composed import ComposedFrames, make_composed, open_recorded
from pipelines.generation.floor import find_floor
from pipelines.progress import Progress
from pipelines.settings import from_table, read_toml
from synth.bodies.poses.library import read_library
from synth.bodies.skeleton import DOFS
from synth.occluders import meshlib
from synth.scene import FrameSource, ObjectMix, PoseMix, SceneConfig
from synth.scene.composed import ComposeConfig

log = logging.getLogger(__name__)

DEFAULT_FRAMES = 1000


@dataclass(frozen=True)
class GenerateSettings:
    """Makes a corpus of labelled depth frames; run again, it goes on where it was interrupted.

    Attributes:
        out: Folder of the corpus: new, empty, or one begun with the same settings.
        config: TOML file with any of these settings; those on the command line go before it.
        frames: How many frames; by default 1000, or with `into` as many as are recorded.
        seed: Seed of everything random; the same settings give the same bytes.
        workers: Processes.
        renderer: numba (any machine) or pyrender (OpenGL; needs undergrowth[gl]).
        poses: Pose library (`undergrowth import mocap`) to take people's poses from besides the procedural ones.
        poses_share: Share of the frames that take from it.
        poses_splits: Splits that use it; the others stay procedural.
        objects: Object library (`undergrowth import meshes`) to take objects from besides the procedural ones.
        objects_share: Share of the draws of an object, of a class that it has, that take from it.
        objects_splits: Splits that use it; the others stay procedural.
        into: Corpus of recorded people (`undergrowth import depth`) to put objects before; draws no people.
        compose: What these objects are drawn from; `scene` and `poses` are for drawn people.
        scene: What the scenes are drawn from.
    """

    out: Annotated[Path, tyro.conf.Positional]
    config: Path | None = None
    frames: int | None = None
    seed: int = 0
    workers: int = 1
    renderer: Literal["numba", "pyrender"] = "numba"
    poses: Path | None = None
    poses_share: float = 0.5
    poses_splits: tuple[Literal["train", "val", "test"], ...] = ("train", "val", "test")
    objects: Path | None = None
    objects_share: float = 0.5
    objects_splits: tuple[Literal["train", "val", "test"], ...] = ("train", "val", "test")
    into: Path | None = None
    compose: ComposeConfig = field(default_factory=ComposeConfig)
    scene: SceneConfig = field(default_factory=SceneConfig)

    @classmethod
    def from_toml(cls, path: Path) -> "GenerateSettings":
        """Defaults out of a TOML file; the folder is still missing."""
        given = read_toml(path)
        settings = from_table(_FileSettings, given, str(path))
        return cls(tyro.MISSING, path, **{item.name: getattr(settings, item.name) for item in fields(settings)})

    def run(self) -> int:
        """Generates the corpus."""
        order = self.order()
        log.info("renderer: %s", order.make_source().description)
        generate(self.out, order, self.workers)
        log.info("%d frames in %s", order.n_frames, self.out)
        return 0

    def order(self) -> Order[FrameSource] | Order[ComposedFrames]:
        """What `write_corpus` is to make."""
        return self._drawn() if self.into is None else self._composed(self.into)

    def _drawn(self) -> Order[FrameSource]:
        if self.compose != ComposeConfig():
            raise UserError("compose says what is put before recorded people: give --into CORPUS, or leave it out")
        config: dict[str, object] = {"renderer": self.renderer, "scene": asdict(self.scene)}
        poses = None
        if self.poses is not None:
            mix = make_mix(self.poses, self.poses_share, self.poses_splits)
            poses = functools.partial(make_mix, self.poses, mix.share, mix.splits, mix.library.digest)
            config["poses"] = {"digest": mix.library.digest, "share": mix.share, "splits": list(mix.splits)}
        objects, about = self._imported_objects()
        n_frames = DEFAULT_FRAMES if self.frames is None else self.frames
        make = functools.partial(make_source, self.scene, self.seed, n_frames, self.renderer, poses, objects)
        angles = tuple((dof.name, dof.lower, dof.upper) for dof in DOFS)
        return Order(self.seed, n_frames, config | about, make, angles)

    def _composed(self, into: Path) -> Order[ComposedFrames]:
        if self.scene != SceneConfig() or self.poses is not None:
            raise UserError("scene and poses are for drawn people, and --into takes recorded ones: use compose")
        corpus = open_recorded(into)
        floor = find_floor(corpus)
        objects, about = self._imported_objects()
        n_frames = len(corpus) if self.frames is None else self.frames
        make = functools.partial(
            make_composed, into, corpus.digest, floor, self.compose, self.seed, n_frames, self.renderer, objects
        )
        recording = corpus.header.config["import"]
        config = {
            "renderer": self.renderer,
            "into": {"corpus": corpus.digest, "floor": asdict(floor), "import": recording},
            "compose": asdict(self.compose),
        }
        angles = tuple((str(name), float(low), float(high)) for name, low, high in corpus.header.labels["angles"])
        return Order(self.seed, n_frames, config | about, make, angles)

    def _imported_objects(self) -> tuple[Callable[[], ObjectMix] | None, dict[str, object]]:
        """How the object library is read again, and what the header says of it."""
        if self.objects is None:
            return None, {}
        mix = make_objects(self.objects, self.objects_share, self.objects_splits)
        digest = mix.library.digest
        about = {"digest": digest, "share": mix.share, "splits": list(mix.splits)}
        make = functools.partial(make_objects, self.objects, mix.share, mix.splits, digest)
        return make, {"objects": about}


def make_mix(path: Path, share: float, splits: tuple[str, ...], digest: str | None = None) -> PoseMix:
    """A pose library and how it is used.

    Args:
        path: The library's file.
        share: Share of the frames that take from it.
        splits: Splits that use it.
        digest: What its digest must be, once a corpus has begun with it.

    Raises:
        UserError: The file is no library, has changed, or lacks poses for a split.
    """
    try:
        mix = PoseMix(read_library(path), share, splits)
    except ValueError as error:
        raise UserError(str(error)) from None
    if digest is not None and mix.library.digest != digest:
        raise UserError(f"{path} has changed since the corpus was begun")
    return mix


def make_objects(path: Path, share: float, splits: tuple[str, ...], digest: str | None = None) -> ObjectMix:
    """An object library and how it is used; arguments and errors as for `make_mix`."""
    try:
        mix = ObjectMix(meshlib.read_library(path), share, splits)
    except ValueError as error:
        raise UserError(str(error)) from None
    if digest is not None and mix.library.digest != digest:
        raise UserError(f"{path} has changed since the corpus was begun")
    return mix


def make_source(
    scene: SceneConfig,
    seed: int,
    n_frames: int,
    renderer: str,
    poses: Callable[[], PoseMix] | None = None,
    objects: Callable[[], ObjectMix] | None = None,
) -> FrameSource:
    """The frames of a corpus.

    Args:
        scene: What the scenes are drawn from.
        seed: Of everything random.
        n_frames: How many.
        renderer: Its name.
        poses: Reads the recorded poses, if any are used.
        objects: Reads the imported objects, if any are used.

    Raises:
        UserError: The renderer's library or device is missing, or a library cannot be used.
    """
    mix = None if poses is None else poses()
    imported = None if objects is None else objects()
    try:
        return FrameSource(scene, seed, n_frames, renderer, mix, imported)
    except (ImportError, RuntimeError) as error:
        raise UserError(f"renderer {renderer} does not start: {error}") from error


@dataclass(frozen=True)
class _FileSettings:
    frames: int | None = None
    seed: int = 0
    workers: int = 1
    renderer: Literal["numba", "pyrender"] = "numba"
    poses: Path | None = None
    poses_share: float = 0.5
    poses_splits: tuple[Literal["train", "val", "test"], ...] = ("train", "val", "test")
    objects: Path | None = None
    objects_share: float = 0.5
    objects_splits: tuple[Literal["train", "val", "test"], ...] = ("train", "val", "test")
    into: Path | None = None
    compose: ComposeConfig = field(default_factory=ComposeConfig)
    scene: SceneConfig = field(default_factory=SceneConfig)


def generate(out: Path, order: Order, workers: int = 1) -> Header:
    """Writes a corpus with a progress bar on anything over two seconds.

    Args:
        out: The folder.
        order: What to make.
        workers: Processes.
    """
    with Progress(order.n_frames, "frame", "generate") as bar:
        return write_corpus(out, order, workers, bar.set_done)
