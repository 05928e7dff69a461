"""undergrowth demo: a small corpus and its contact sheet."""

import logging
from dataclasses import dataclass
from pathlib import Path

from pipelines.corpus import Corpus
from pipelines.generate import GenerateSettings, generate
from pipelines.inspect import inspect

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class DemoSettings:
    """Makes a small corpus and draws its contact sheet.

    Attributes:
        out: Folder for corpus and pictures.
        frames: How many frames.
        seed: Seed of everything random.
    """

    out: Path = Path("out/demo")
    frames: int = 40
    seed: int = 1

    def run(self) -> int:
        """Generates, draws, tells where the pictures are."""
        settings = GenerateSettings(self.out / "corpus", frames=self.frames, seed=self.seed)
        generate(settings.out, settings.order())
        corpus = Corpus.open(settings.out)
        written = inspect(corpus, self.out / "inspect")
        log.info("corpus: %d frames in %s", len(corpus), settings.out)
        log.info("statistics: %s", self.out / "inspect" / "index.html")
        log.info("contact sheet: %s", written[0])
        return 0
