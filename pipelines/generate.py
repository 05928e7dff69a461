"""undergrowth generate: a corpus out of a seed and settings."""

import functools
import logging
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Annotated, Literal

import tyro
from tqdm import tqdm

from pipelines.corpus import Header, Order, write_corpus
from pipelines.errors import UserError
from pipelines.settings import from_table, read_toml
from synth.bodies.skeleton import DOFS
from synth.scene import FrameSource, SceneConfig

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class GenerateSettings:
    """Makes a corpus of labelled depth frames; run again, it goes on where it was interrupted.

    Attributes:
        out: Folder of the corpus: new, empty, or one begun with the same settings.
        config: TOML file with any of these settings; those on the command line go before it.
        frames: How many frames.
        seed: Seed of everything random; the same settings give the same bytes.
        workers: Processes.
        renderer: numba (any machine) or pyrender (OpenGL; needs undergrowth[gl]).
        scene: What the scenes are drawn from.
    """

    out: Annotated[Path, tyro.conf.Positional]
    config: Path | None = None
    frames: int = 1000
    seed: int = 0
    workers: int = 1
    renderer: Literal["numba", "pyrender"] = "numba"
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
        log.info("%d frames in %s", self.frames, self.out)
        return 0

    def order(self) -> Order[FrameSource]:
        """What `write_corpus` is to make."""
        make = functools.partial(make_source, self.scene, self.seed, self.frames, self.renderer)
        angles = tuple((dof.name, dof.lower, dof.upper) for dof in DOFS)
        config = {"renderer": self.renderer, "scene": asdict(self.scene)}
        return Order(self.seed, self.frames, config, make, angles)


def make_source(scene: SceneConfig, seed: int, n_frames: int, renderer: str) -> FrameSource:
    """The frames of a corpus.

    Raises:
        UserError: The renderer's library or device is missing.
    """
    try:
        return FrameSource(scene, seed, n_frames, renderer)
    except (ImportError, RuntimeError) as error:
        raise UserError(f"renderer {renderer} does not start: {error}") from error


@dataclass(frozen=True)
class _FileSettings:
    frames: int = 1000
    seed: int = 0
    workers: int = 1
    renderer: Literal["numba", "pyrender"] = "numba"
    scene: SceneConfig = field(default_factory=SceneConfig)


def generate(out: Path, order: Order, workers: int = 1) -> Header:
    """Writes a corpus with a progress bar on anything over two seconds.

    Args:
        out: The folder.
        order: What to make.
        workers: Processes.
    """
    with tqdm(total=order.n_frames, unit="frame", delay=2.0, dynamic_ncols=True) as bar:

        def show(n_done: int, n_earlier: int) -> None:
            bar.initial = n_earlier
            bar.update(n_done - bar.n)

        return write_corpus(out, order, workers, show)
