"""undergrowth generate and join: a corpus of drawn people, or of drawn objects in front of recorded people."""

import logging
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal, Self

import tyro

from pipelines.corpus import Order
from pipelines.corpus.run import join_shards
from pipelines.errors import UserError
from pipelines.generation.composed import ComposedFrames, composed_order
from pipelines.generation.drawn import Source, drawn_order, whole_frames
from pipelines.generation.libraries import LibraryUse
from pipelines.generation.writing import put_shown, write_shown
from pipelines.settings import defaults_from
from storage.ranges import MAX_FRAMES, MAX_SEED, MAX_THREADS, check_fields
from storage.remote import url_of
from synth.scene import SceneConfig
from synth.scene.composed import ComposeConfig

log = logging.getLogger(__name__)

DEFAULT_FRAMES = 1000
_RANGES = {
    "frames": (1, MAX_FRAMES),
    "seed": (0, MAX_SEED),
    "workers": (1, MAX_THREADS),
}
Splits = tuple[Literal["train", "val", "test"], ...]


@dataclass(frozen=True)
class GenerateSettings:
    """Makes a corpus of labelled depth frames. If it is interrupted, the same command continues where it stopped.

    Attributes:
        out: Folder of the corpus: new, empty, or begun with the same settings. Or a URL, such as s3://bucket/corpus.
        config: TOML file with any of these settings. Settings given on the command line override it.
        frames: Number of frames. The default is 1000 (rounded up to whole clips and
            views), or with --into the number of recorded frames.
        seed: Seed of all randomness. The same settings and seed give the same bytes.
        workers: Number of processes. The corpus does not depend on it.
        scheduler: Dask scheduler whose workers make the corpus in place of such processes: tcp://HOST:PORT, or local:N
            for N workers of this machine. All must see the folder. Needs undergrowth[cluster].
        only_shards: FIRST:END makes these shards of 64 frames alone, as one job of an array; `undergrowth join`
            completes the corpus when all jobs are through.
        renderer: numba (runs on any machine) or pyrender (OpenGL; needs undergrowth[gl]).
        poses: Library of recorded poses, made by `undergrowth import mocap`, to use besides the procedural poses; for
            clips, of motions, made with its --clips.
        poses_share: Share of the frames whose pose is taken from the library; of clips, of the people on their feet.
        poses_splits: Splits that use the pose library. The other splits have procedural poses only.
        objects: Library of objects, made by `undergrowth import meshes`, to use besides the procedural objects.
        objects_share: Share of the object draws that use the library, where it has an object of the class.
        objects_splits: Splits that use the object library. The other splits have procedural objects only.
        into: Corpus of recorded people, made by `undergrowth import depth`. Objects are placed in front of these
            people, and no people are generated.
        compose: How objects are placed in front of recorded people; used only with --into.
        scene: How scenes with generated people are drawn; not used with --into.
    """

    out: Annotated[Path, tyro.conf.Positional]
    config: Path | None = None
    frames: int | None = None
    seed: int = 0
    workers: int = 1
    scheduler: str | None = None
    only_shards: str | None = None
    renderer: Literal["numba", "pyrender"] = "numba"
    poses: Path | None = None
    poses_share: float = 0.5
    poses_splits: Splits = ("train", "val", "test")
    objects: Path | None = None
    objects_share: float = 0.5
    objects_splits: Splits = ("train", "val", "test")
    into: Path | None = None
    compose: ComposeConfig = field(default_factory=ComposeConfig)
    scene: SceneConfig = field(default_factory=SceneConfig)

    def __post_init__(self) -> None:
        check_fields(self, _RANGES)

    @classmethod
    def from_toml(cls, path: Path) -> Self:
        """Defaults out of a TOML file; the folder is still missing."""
        return defaults_from(cls, path, out=tyro.MISSING)

    def run(self) -> int:
        """Generates the corpus."""
        order = self.order()
        log.info("renderer: %s", order.make_source().description)
        if (url := url_of(self.out)) is not None:
            return self._put(url, order)
        shards = None if self.only_shards is None else _range_of(self.only_shards)
        if self.scheduler is None:
            write_shown(self.out, order, self.workers, shards=shards)
        else:
            self._run_on_cluster(self.scheduler, order, shards)
        what = "" if self.only_shards is None else f"the shards {self.only_shards} of "
        log.info("%s%d frames in %s", what, order.n_frames, self.out)
        return 0

    def _put(self, url: str, order: Order) -> int:
        if self.workers > 1 or self.only_shards is not None:
            raise UserError("with a URL, give --scheduler local:N in place of --workers, and no --only-shards")
        if self.scheduler is None:
            put_shown(url, order)
        else:
            from pipelines.cluster.shards import puts_on
            from pipelines.engine.cluster import open_cluster

            with open_cluster(self.scheduler) as cluster:
                put_shown(url, order, puts_on(cluster))
        log.info("%d frames in %s", order.n_frames, url)
        return 0

    def _run_on_cluster(self, scheduler: str, order: Order, shards: range | None) -> None:
        from pipelines.cluster.shards import shards_on
        from pipelines.engine.cluster import open_cluster

        if self.workers > 1:
            raise UserError("--workers counts processes of this machine; with --scheduler its workers are used")
        with open_cluster(scheduler) as cluster:
            write_shown(self.out, order, runner=shards_on(cluster), shards=shards)

    def order(self) -> Order[Source] | Order[ComposedFrames]:
        """What `write_corpus` is to make.

        Raises:
            UserError: Settings that contradict one another, or a library or corpus that cannot be used.
        """
        poses = None if self.poses is None else LibraryUse(self.poses, self.poses_share, self.poses_splits)
        objects = (
            None if self.objects is None else LibraryUse(self.objects, self.objects_share, self.objects_splits)
        )
        if self.into is not None:
            if self.scene != SceneConfig() or poses is not None:
                raise UserError("--scene and --poses describe generated people; with --into use --compose instead")
            return composed_order(self.into, self.compose, self.seed, self.frames, self.renderer, objects)
        if self.compose != ComposeConfig():
            raise UserError("--compose describes objects in front of recorded people; give --into CORPUS too")
        n_frames = whole_frames(self.scene, DEFAULT_FRAMES) if self.frames is None else self.frames
        return drawn_order(self.scene, self.seed, n_frames, self.renderer, poses, objects)


@dataclass(frozen=True)
class JoinSettings:
    """Completes a corpus that was made by `undergrowth generate --only-shards` in several jobs.

    Says which shards are missing, if any are; the corpus has then to be joined again.

    Attributes:
        corpus: Folder of the corpus.
    """

    corpus: Annotated[Path, tyro.conf.Positional]

    def run(self) -> int:
        """Joins the corpus."""
        header = join_shards(self.corpus)
        log.info("%d frames in %s", header.n_frames, self.corpus)
        return 0


def _range_of(text: str) -> range:
    """Shards of FIRST:END."""
    first, colon, end = text.partition(":")
    if not (colon and first.isdecimal() and end.isdecimal() and len(text) < 20):
        raise UserError(f"only_shards={text!r:.40} must be FIRST:END, such as 0:100")
    return range(int(first), int(end))
