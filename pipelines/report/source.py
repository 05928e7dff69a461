"""What a report is made of: an ablation's document, the rows behind its main table, its corpus if it is there."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipelines.ablate.schema import DOCUMENT_NAME, SCHEMA, SCHEMA_VERSION
from pipelines.corpus import Corpus
from pipelines.errors import CorpusError, UserError
from pipelines.foreign import reading
from pipelines.metrics.results import Results, Truths, read_results, same_frames
from pipelines.report.methods import METHODS

RESAMPLING_SEED = 0
"""The same frames are drawn as for the ablation's own scores."""


@dataclass(frozen=True)
class Source:
    """An ablation as the page shows it.

    Attributes:
        folder: Where it lies.
        document: Its ablation.json.
        answers: What each method of the main table answered, by row and seed.
        corpus: The main table's corpus; None = pictures are left out.
    """

    folder: Path
    document: Mapping[str, Any]
    answers: Mapping[str, Sequence[Results]]
    corpus: Corpus | None

    @property
    def main(self) -> Mapping[str, Any]:
        """The main table's condition."""
        return self.document["main"]

    @property
    def rows(self) -> tuple[str, ...]:
        """The main table's methods, in the order in which they are shown."""
        return tuple(name for name in METHODS if name in self.answers)

    @property
    def truths(self) -> Truths:
        """Frames of the method that answers most joints, and what is true there."""
        return max((seeds[0].truths for seeds in self.answers.values()), key=lambda t: len(t.joints))

    @property
    def n_resamples(self) -> int:
        """Resamples of the test frames."""
        return int(self.document["settings"]["n_resamples"])

    def rng(self) -> np.random.Generator:
        """Draws resamples."""
        return np.random.default_rng(RESAMPLING_SEED)

    def pairs(self, first: str, second: str) -> list[tuple[Results, Results]]:
        """Answers of two methods by training; none if they did not answer the same joints of the same frames."""
        both = zip(self.answers.get(first, ()), self.answers.get(second, ()), strict=False)
        return [(a, b) for a, b in both if same_frames(a.truths, b.truths)]


def read_source(folder: Path, corpus: Path | None = None) -> Source:
    """Reads the folder of an ablation.

    Args:
        folder: Where `undergrowth ablate` wrote.
        corpus: Its main corpus, if that lies elsewhere.

    Raises:
        UserError: No ablation, one of another version, missing or damaged rows, another corpus.
    """
    path = folder / DOCUMENT_NAME
    document = read_document(path)
    with reading(path, "the document of an ablation"):
        rows = document["main"]["rows"]
        unknown = [name for name in rows if name not in METHODS]
        if unknown or not rows:
            raise UserError(f"{path} has the rows {', '.join(rows) or 'none'}; known are {', '.join(METHODS)}")
        answers = {
            name: [_read_rows(folder, training) for training in row["trainings"]] for name, row in rows.items()
        }
        return Source(folder, document, answers, _open_corpus(folder, document, corpus))


def read_document(path: Path) -> dict:
    """Reads ablation.json.

    Raises:
        UserError: There is none, it is damaged, or of another version.
    """
    if not path.exists():
        raise UserError(f"{path.parent} is not the folder of an ablation: it has no {path.name}")
    with reading(path, "the document of an ablation"):
        document = json.loads(path.read_text(encoding="utf-8"))
    found = (document.get("schema"), document.get("schema_version")) if isinstance(document, dict) else None
    if found != (SCHEMA, SCHEMA_VERSION):
        raise UserError(f"{path} holds {found!r:.60}; this program reads {(SCHEMA, SCHEMA_VERSION)}")
    return document


def _read_rows(folder: Path, training: Mapping[str, Any]) -> Results:
    results, context = read_results(folder / training["rows"]["file"])
    if context.get("key") != training["rows"]["key"] or len(results) != 1:
        raise UserError(f"{folder / training['rows']['file']} is not the file of rows that {DOCUMENT_NAME} names")
    return results[0]


def _open_corpus(folder: Path, document: Mapping[str, Any], given: Path | None) -> Corpus | None:
    name = next(iter(document["main"]["rows"].values()))["trainings"][0]["corpus"]
    path = given or folder / name
    try:
        corpus = Corpus.open(path)
    except CorpusError:
        if given is not None:
            raise
        return None
    digest = next(item["digest"] for item in document["corpora"] if item["folder"] == name)
    if corpus.digest != digest:
        raise UserError(
            f"{path} has the digest {corpus.digest}, but the ablation used a corpus with the digest {digest}"
        )
    return corpus
