"""undergrowth card: writes what a model learned from, how well it finds joints, and its limits, beside the model."""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from pipelines.card.orientation import orientation_card
from pipelines.card.write import card_of
from pipelines.corpus.joined import open_corpora
from pipelines.orientation.opening import is_orientation_net
from pipelines.targets import check_ours, check_place
from storage.atomic import write_atomically
from storage.ranges import MAX_FRAMES, MAX_THREADS, check_fields

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class CardSettings:
    """Writes a model card: what the model learned from, its scores on the test split of each corpus, its limits.

    Attributes:
        model: File of the model.
        corpora: Folders of the corpora that it is scored on. Those that it was trained on are described too.
        out: File of the card. By default it is called like the model, with ".md" instead of its ending.
        sensor: Name of a sensor model whose noise is added to the depth of generated test frames; "ideal" leaves
            it clean.
        joint_offsets: Frames of each recorded corpus on which the places of its joints relative to the model's are
            learned; they are not scored. 0 scores the joints as they are.
        limit: Score at most this many frames of each corpus, evenly spread; 0 scores all.
        threads: Number of frames that are processed at the same time. The scores do not depend on it.
    """

    model: Annotated[Path, tyro.conf.Positional]
    corpora: Annotated[tuple[Path, ...], tyro.conf.Positional]
    out: Path | None = None
    sensor: str = "random"
    joint_offsets: int = 20
    limit: int = 0
    threads: int = 1

    def __post_init__(self) -> None:
        if not self.corpora:
            raise ValueError("corpora: give at least one folder with frames of the split test")
        ranges = {"limit": (0, MAX_FRAMES), "joint_offsets": (0, MAX_FRAMES), "threads": (1, MAX_THREADS)}
        check_fields(self, ranges)

    def run(self) -> int:
        """Scores the model and writes the card."""
        out = self.out or self.model.with_suffix(".md")
        check_place(out)
        check_ours(out, ".md")
        corpora = open_corpora(self.corpora)
        if is_orientation_net(self.model):
            text = orientation_card(self.model, corpora, self.sensor, self.limit)
        else:
            text = card_of(self.model, corpora, self.sensor, self.joint_offsets, self.limit, self.threads)
        write_atomically(out, text)
        log.info("%s", out)
        return 0
