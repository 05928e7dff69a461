"""undergrowth view: a page that shows corpora, recordings and answers, with a time line and the votes of forests."""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from forests.frames import Intrinsics
from pipelines.corpus import Corpus
from pipelines.corpus.header import HEADER_NAME
from pipelines.errors import UserError
from pipelines.models.opening import open_model
from pipelines.online.sources.bag import is_bag
from pipelines.recordings.plain import GivenCamera
from pipelines.viewer.answers import AnswerShow
from pipelines.viewer.moments import Show
from pipelines.viewer.page import Page
from pipelines.viewer.recorded import RecordedShow
from pipelines.viewer.truth import CorpusShow
from pipelines.viewer.votes import VoteView

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class ViewSettings:
    """Shows a corpus, a recording or answers in a browser, until it is interrupted.

    Attributes:
        source: A corpus, a recording of ROS (one that `live --record` wrote shows all that was told), or a folder
            that `predict` wrote.
        port: Serve the page on this port of this machine; 0 = any that is free.
        model: A forest whose votes for a joint can be shown.
        sensor: Name of a sensor model whose noise is added to the depth of generated frames.
        camera_number: Show this camera of a corpus with several, counted from 0.
        corpus: Where the frames are that answers are about, if they are of a corpus.
        topic: Topic of the depth images of a recording.
        intrinsics: fx fy cx cy of the images [px], instead of those of a recording's CameraInfo.
    """

    source: Annotated[Path, tyro.conf.Positional]
    port: int = 8080
    model: Path | None = None
    sensor: str | None = None
    camera_number: int = 0
    corpus: Path | None = None
    topic: str | None = None
    intrinsics: tuple[float, float, float, float] | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.port < 65536:
            raise ValueError(f"port={self.port} must be in 0..65535")

    def run(self) -> int:
        """Serves the page until it is interrupted.

        Raises:
            UserError: The source or the model cannot be used, or viser is not installed.
        """
        page = self.page()
        log.info("%s shows %s; press Ctrl-C to end", page.address, self.source)
        try:
            page.run()
        except KeyboardInterrupt:
            log.info("ended")
        finally:
            page.close()
        return 0

    def page(self) -> Page:
        """The page; errors as of `run`."""
        show = self._show()
        votes = None
        if self.model is not None:
            contestant, _ = open_model(self.model)
            votes = VoteView(contestant.predictor, self._is_cut_out())
        return Page(show, self.port, votes)

    def _is_cut_out(self) -> bool:
        return self._is_corpus() and not Corpus.open(self.source).header.has_rooms

    def _is_corpus(self) -> bool:
        return (self.source / HEADER_NAME).is_file()

    def _show(self) -> Show:
        if self._is_corpus():
            return CorpusShow(Corpus.open(self.source), self.sensor, self.camera_number)
        if is_bag(self.source):
            given = None if self.intrinsics is None else GivenCamera("", self.intrinsics).values
            camera = None if given is None else Intrinsics(given.fx, given.fy, given.cx, given.cy)
            return RecordedShow(self.source, self.topic, camera)
        if not self.source.exists():
            raise UserError(f"there is no file or folder {self.source}")
        return AnswerShow(self.source, None if self.corpus is None else Corpus.open(self.corpus), self.sensor)
