"""undergrowth verify: digests, laws and splits of a corpus, every fault by shard and frame."""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from pipelines.corpus import Corpus
from pipelines.corpus.faults import faults
from pipelines.errors import CorpusError
from pipelines.progress import Progress

log = logging.getLogger(__name__)

MAX_SHOWN = 20
"""Faults that are printed; the rest are counted."""


@dataclass(frozen=True)
class VerifySettings:
    """Checks the digests, labels and splits of a corpus. The exit code is 1 if anything is wrong.

    Attributes:
        corpus: Folder of the corpus.
        allow_incomplete: Check the finished shards of an unfinished corpus instead of reporting it as unfinished.
        digests_only: Check only the digests, not the contents of the frames.
    """

    corpus: Annotated[Path, tyro.conf.Positional]
    allow_incomplete: bool = False
    digests_only: bool = False

    def run(self) -> int:
        """Prints the faults."""
        corpus = Corpus.open(self.corpus, self.allow_incomplete)
        n_faults = 0
        with Progress(len(corpus), "frame", "verify") as bar:
            for fault in faults(corpus, with_laws=not self.digests_only, on_frames=bar.update):
                n_faults += 1
                if n_faults <= MAX_SHOWN:
                    log.info("%s", fault)
        if n_faults > MAX_SHOWN:
            log.info("and %d more", n_faults - MAX_SHOWN)
        if n_faults:
            raise CorpusError(f"{self.corpus} has {n_faults} faults")
        log.info("%s is valid: %d frames", self.corpus, len(corpus))
        return 0
