"""undergrowth predict: the joints in depth images, as JSON and drawn."""

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from forests.finder.find import PeopleFinder
from pipelines.errors import UserError
from pipelines.models.opening import open_model
from pipelines.orientation.opening import is_orientation_net, open_net
from pipelines.predicting.images import Request, corpus_requests, recorded_requests
from pipelines.predicting.people import FULL_SHARE, share_with_depth
from pipelines.predicting.sequence import (
    SHEET_NAME,
    ImageRun,
    PredictionOptions,
    PredictionRun,
    numbered_files,
)
from pipelines.recordings.plain import GivenCamera
from pipelines.targets import check_folder
from storage.ranges import MAX_FRAMES, check_fields
from synth.camera import MAX_PIXELS

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class PredictSettings:
    """Finds the joints of the person in each depth image and writes NAME.json and NAME.overlay.png.

    In images of whole scenes everybody is found, and NAME_0.json, NAME_1.json ... are written from left to right. For
    several images it also writes skeletons.jsonl and sheet.png. Images that cannot be read are reported and
    skipped. Of an orientation net it writes which way the person faces, and orientations.jsonl.

    Attributes:
        model: File of the model.
        depth: A folder of recordings, or depth files: PNG, PGM, TIFF, EXR, .npy, .raw, .pcd, .h5.
        out: Folder for the results.
        layout: Name of a known layout, or a .toml file. By default the layout is found from the contents of the
            folder.
        camera: Camera preset of images that no layout describes.
        intrinsics: fx fy cx cy of the images [px], instead of a preset.
        every: Use every Nth image.
        corpus: Take the images from this corpus instead of files.
        frame: Frame numbers in the corpus.
        sensor: Name of a sensor model whose noise is added to the depth of generated frames. By default the depth
            stays clean.
        people: What the images show. one: one person, cut out or in a box. all: whole scenes, in which people are
            found; boxes and range of a layout are not used. auto: whole scenes, if at least half of the pixels have
            depth and neither a box, a range nor a layout says what of them is the person.
        box: Where the person is: left top right bottom [px], right and bottom excluded. By default the whole image
            is used.
        near: Ignore depth nearer than this [m].
        far: Ignore depth farther than this [m].
        smooth: Treat the images as a sequence and smooth the joints over time.
        fps: Images per second of the sequence, counted before --every leaves any out.
        pictures: Write NAME.overlay.png for every image.
        skeleton: Make one skeleton out of the model's proposals. Without, each joint is found on its own.
    """

    model: Annotated[Path, tyro.conf.Positional]
    depth: Annotated[tuple[Path, ...], tyro.conf.Positional] = ()
    out: Path = Path("out/predict")
    layout: str | None = None
    camera: str | None = None
    intrinsics: tuple[float, float, float, float] | None = None
    every: int = 1
    corpus: Path | None = None
    frame: tuple[int, ...] = ()
    sensor: str | None = None
    people: Literal["auto", "one", "all"] = "auto"
    box: tuple[int, int, int, int] | None = None
    near: float = 0.0
    far: float = math.inf
    smooth: bool = False
    fps: float = 30.0
    pictures: bool = True
    skeleton: bool = True

    def __post_init__(self) -> None:
        if not 0.0 <= self.near < self.far:
            raise ValueError(f"near={self.near} and far={self.far} must be 0 <= near < far [m]")
        if self.box is not None and not (self.box[0] < self.box[2] and self.box[1] < self.box[3]):
            raise ValueError(f"box={self.box} must be left top right bottom, left < right, top < bottom")
        check_fields(self, {"every": (1, MAX_FRAMES), "frame": (0, MAX_FRAMES), "fps": (0.001, 1e6)})
        check_fields(self, {"box": (-MAX_PIXELS, MAX_PIXELS)})

    def run(self) -> int:
        """Asks the model about every image.

        Raises:
            UserError: Inputs that contradict one another, or images that were left out.
        """
        self._check_inputs()
        is_whole, requests = self._images()
        options = PredictionOptions(
            self.box,
            self.near,
            self.far,
            self.fps if self.smooth else 0.0,
            self.pictures,
            finder=PeopleFinder() if is_whole else None,
        )
        run = self._prediction(options)
        check_folder(self.out, self._names(requests, run.lines_name, is_whole))
        self.out.mkdir(parents=True, exist_ok=True)
        if len(requests) == 1:
            run.predict_one(requests[0])
            return 0
        tally = run.predict_all(requests)
        lines = self.out / run.lines_name
        log.info("%d images: %s, %s", len(requests) - tally.n_skipped, lines, self.out / SHEET_NAME)
        if is_whole:
            images = "1 image" if tally.n_deserted == 1 else f"{tally.n_deserted} images"
            log.info("%d people; %s in which nobody is found", tally.n_people, images)
        if tally.n_skipped:
            raise UserError(
                f"{tally.n_skipped} of {len(requests)} images were skipped; {lines.name} gives the reasons"
            )
        return 0

    def _images(self) -> tuple[bool, list[Request]]:
        """Whether the images are of whole scenes, and the images.

        Raises:
            UserError: There are none, or people in whole scenes are to be followed.
        """
        requests = self._requests(self.people == "all")
        is_one = self.people == "one" or (self.people == "auto" and self._is_one_person(requests))
        if is_one:
            return False, requests
        if self.smooth:
            raise UserError(
                "--smooth follows one person, but the images are of whole scenes, whose people are not followed from "
                "image to image; give --people one if they show one person, cut out"
            )
        return True, requests if self.people == "all" else self._requests(True)

    def _is_one_person(self, requests: Sequence[Request]) -> bool:
        """Whether images show one person, by what is told of them or, if that is nothing, by how full they are."""
        is_told = self.box is not None or self.near > 0.0 or math.isfinite(self.far)
        if is_told or any(request.is_cut_out for request in requests):
            return True
        if self.corpus is not None:
            return False
        share = share_with_depth(requests)
        if share < FULL_SHARE:
            return True
        log.info(
            "%.0f %% of the pixels have depth, so people are looked for; --people one takes each for one person's",
            100 * share,
        )
        return False

    def _prediction(self, options: PredictionOptions) -> ImageRun[Any]:
        """The model, ready to be asked.

        Raises:
            UserError: It cannot be opened, or a setting does not concern such models.
        """
        if not is_orientation_net(self.model):
            return PredictionRun(*open_model(self.model, self.skeleton), options, self.out)
        if self.smooth:
            raise UserError(f"{self.model} is an orientation net; --smooth is for joints")
        from pipelines.orientation.answering import OrientationRun

        return OrientationRun(*open_net(self.model), options, self.out)

    def _check_inputs(self) -> None:
        """Refuses inputs that contradict one another."""
        if self.people == "all" and self.box is not None:
            raise UserError("--people all finds everybody's box; leave --box out")
        if (self.corpus is None) == (not self.depth):
            raise UserError("give depth images, or --corpus DIR --frame N")
        if self.corpus is not None:
            if not self.frame or self.camera or self.intrinsics or self.layout:
                raise UserError("--corpus needs --frame N; leave --camera, --intrinsics and --layout out")
            if self.smooth:
                raise UserError("--smooth needs a sequence of files; the frames of a corpus are not a sequence")
            return
        if self.frame or self.sensor:
            raise UserError("--frame and --sensor need --corpus DIR")

    def _names(self, requests: Sequence[Request], lines_name: str, is_whole: bool) -> list[str]:
        """Names of the files that will be written; of people in whole scenes, of those that are there."""
        names = [request.name for request in requests]
        of_all = [lines_name, SHEET_NAME] if len(requests) > 1 else []
        pictures = [f"{name}.overlay.png" for name in names] if self.pictures else []
        if is_whole:
            return of_all + pictures + [path.name for name in names for path in numbered_files(self.out, name)]
        return of_all + pictures + [f"{name}.json" for name in names]

    def _requests(self, is_whole: bool) -> list[Request]:
        """All images that are asked about, not read yet."""
        if self.corpus is not None:
            return corpus_requests(self.corpus, self.frame, self.sensor)
        is_given = self.camera is not None or self.intrinsics is not None
        camera = GivenCamera(self.camera or "", self.intrinsics) if is_given else None
        requests = recorded_requests(self.depth, self.layout, camera, is_whole)
        names = [request.name for request in requests]
        if len(set(names)) < len(names):
            twice = min(name for name in names if names.count(name) > 1)
            raise UserError(f"several images are called {twice}, so their results would overwrite each other")
        return requests[:: self.every]
