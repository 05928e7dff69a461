"""undergrowth demo: the whole story at a small size, from frames to a report."""

import importlib.util
import logging
from dataclasses import dataclass, field, replace
from pathlib import Path

from pipelines.ablate.ablation import run_ablation, usable_cores
from pipelines.ablate.config import FOREST_ROWS, AblationConfig, Size, load_config
from pipelines.ablate.schema import DOCUMENT_NAME
from pipelines.ablate.terminal import table_lines
from pipelines.inspect.write import PAGE_NAMES, write_inspection
from pipelines.predicting.images import layout_requests, recording_layout
from pipelines.predicting.recording import N_ASKED, Folder, Recording
from pipelines.predicting.sequence import SHEET_NAME, PredictionOptions, PredictionRun
from pipelines.recordings.entries import list_files
from pipelines.recordings.layout import Foreground
from pipelines.recordings.plain import GivenCamera
from pipelines.report.methods import METHODS, shown_methods
from pipelines.report.models import first_models
from pipelines.report.source import Source, read_source
from pipelines.report.write import recordings_of, write_report
from pipelines.spread import first_to_last
from pipelines.targets import check_folder
from storage.ranges import MAX_THREADS, check_fields

NET_ROW = "heat"
"""The net that is shown beside the forests."""
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class DemoSettings:
    """Makes frames, trains all forests on them, scores them and writes the report, in minutes at the size demo.

    Where torch is installed, a heat map net is trained and scored beside the forests, unless the settings name rows.

    If it is interrupted, the same command continues where it stopped. With --real it ends with skeletons on
    recorded depth.

    Attributes:
        out: Folder for the corpus, models, scores, pictures and report.
        size: The size of the ablation, as in `undergrowth ablate`.
        config: TOML file with any of the ablation's settings. They override those of the size.
        threads: Number of threads, and of processes that make frames. The scores do not depend on it.
        real: Folder of recorded depth images. The trained forests predict the joints in them.
        layout: Name of the folder's layout, or a .toml file. By default the layout is found from its contents.
        camera: Camera preset, for a folder of plain depth files that no layout describes.
        far: Farthest depth that is kept in plain depth files [m]; 0 keeps all.
    """

    out: Path = Path("out/demo")
    size: Size = "demo"
    config: Path | None = None
    threads: int = field(default_factory=usable_cores)
    real: Path | None = None
    layout: str | None = None
    camera: str | None = None
    far: float = 0.0

    def __post_init__(self) -> None:
        check_fields(self, {"threads": (1, MAX_THREADS), "far": (0.0, 1000.0)})
        if self.real is None and (self.layout or self.camera):
            raise ValueError("--layout and --camera describe a folder of recordings; give the folder with --real")
        if self.far and not self.camera:
            raise ValueError("--far applies only to plain depth files, which need --camera")

    def run(self) -> int:
        """Runs all steps; ends with the table and the report's path."""
        results = self.out / "ablation"
        check_folder(results, [DOCUMENT_NAME])
        check_folder(self.out, ["report.html"])
        check_folder(self.out / "inspect", PAGE_NAMES)
        folder = None if self.real is None else self._folder(self.real)
        document = run_ablation(with_net(load_config(self.size, self.config)), results, self.threads)
        source = read_source(results)
        recordings = recordings_of(source, [folder] if folder else [])
        write_report(source, self.out / "report.html", recordings)
        if source.corpus is not None:
            log.info("frames: %s", write_inspection(source.corpus, self.out / "inspect")[0])
        for line in table_lines(document):
            log.info("%s", line)
        log.info("")
        n_skipped = 0
        if folder is not None:
            n_skipped = draw_recording(source, folder, self.out / "recorded" / recordings[0].name)
            tell_scores(recordings[0])
        log.info("report: %s", self.out / "report.html")
        return 1 if n_skipped else 0

    def _folder(self, path: Path) -> Folder:
        """How the folder of recordings reads, found before minutes of training."""
        camera = GivenCamera(self.camera) if self.camera else None
        name, layout = recording_layout(path, self.layout, camera)
        if self.far:
            layout = replace(layout, foreground=Foreground(0.0, self.far))
        return Folder(path, name, layout)


def with_net(config: AblationConfig) -> AblationConfig:
    """The same with a heat map net beside the forests, where torch is installed and all forests are compared."""
    has_torch = importlib.util.find_spec("torch") is not None
    return replace(config, rows=(*FOREST_ROWS, NET_ROW)) if has_torch and config.rows == FOREST_ROWS else config


def draw_recording(source: Source, folder: Folder, out: Path) -> int:
    """Draws what the forests that the report shows find in its frames of a folder: a picture each, and a sheet.

    Returns:
        How many images could not be read.
    """
    models = first_models(source)
    requests = layout_requests(list_files(folder.path, folder.layout.files), folder.name, folder.layout)
    chosen = [requests[place] for place in first_to_last(len(requests), N_ASKED)]
    n_skipped = 0
    for name in shown_methods(tuple(models)):
        there = out / name
        there.mkdir(parents=True, exist_ok=True)
        n_skipped = (
            PredictionRun(models[name].contestant, models[name].about, PredictionOptions(lists=False), there)
            .predict_all(chosen)
            .n_skipped
        )
        log.info("skeletons, %s: %s", METHODS[name].name, there / SHEET_NAME)
    return n_skipped


def tell_scores(recording: Recording) -> None:
    """Says how many of the known joints of a recording each method finds."""
    for name, score in recording.scores.items():
        log.info(
            "%s, %s: %.1f %% of %d known joints within 10 cm, mean error %.1f cm",
            recording.name, METHODS[name].name, 100 * score.within, score.n_joints, 100 * score.mean_m,
        )  # fmt: skip
