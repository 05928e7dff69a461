"""The folder of results: where finished work lies."""

from dataclasses import dataclass
from pathlib import Path

from pipelines.ablate.jobs import CorpusJob, ScoringJob, TrainingJob
from pipelines.ablate.schema import DOCUMENT_NAME
from pipelines.corpus import Corpus


@dataclass(frozen=True)
class ResultsFolder:
    """Paths by key; a file that is there is finished.

    Attributes:
        root: The folder.
    """

    root: Path

    def corpus(self, job: CorpusJob) -> Path:
        """Folder of a corpus."""
        return self.root / f"corpus-{job.key[:12]}"

    def open_corpus(self, job: CorpusJob) -> Corpus:
        """A finished corpus.

        Raises:
            CorpusError: It is not there, unfinished or damaged.
        """
        return Corpus.open(self.corpus(job))

    def model(self, job: TrainingJob) -> Path:
        """File of a model."""
        return self.root / "models" / f"{job.name}.safetensors"

    def rows(self, job: ScoringJob) -> Path:
        """File of what a model answered."""
        return self.root / "rows" / f"{job.name}.npz"

    @property
    def document(self) -> Path:
        """File of settings, versions, digests and scores."""
        return self.root / DOCUMENT_NAME

    def prepare(self) -> None:
        """Makes the folders."""
        for name in ("models", "rows"):
            (self.root / name).mkdir(parents=True, exist_ok=True)
