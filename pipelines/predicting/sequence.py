"""Images asked about one after the other: a JSON file and a picture each, and for several one of each of all."""

import glob
import json
import logging
import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from forests.boxes import Box
from forests.estimate import JointEstimate
from forests.finder.find import PeopleFinder
from pipelines.drawing.files import write_picture
from pipelines.drawing.overlays import skeleton_panel
from pipelines.drawing.palette import Picture
from pipelines.drawing.people import captioned, people_panel
from pipelines.drawing.skeletons import PERSON_FROM
from pipelines.drawing.tiles import N_SHOWN, sheet, sheet_tile
from pipelines.errors import UserError
from pipelines.models.asking import Contestant, ask
from pipelines.predicting.images import DepthImage, Request
from pipelines.predicting.people import Somebody, everybody, found_values
from pipelines.predicting.skeleton import SCHEMA, SCHEMA_VERSION, body_values, number_value, skeleton_picture
from pipelines.predicting.smooth import TrackSmoother
from pipelines.progress import progress
from pipelines.recordings.entries import readable
from pipelines.spread import first_to_last
from storage.atomic import write_atomically

log = logging.getLogger(__name__)

LINES_NAME, SHEET_NAME = "skeletons.jsonl", "sheet.png"
EstimateT = TypeVar("EstimateT")
N_LISTED = 20
"""Of more images, not every one is told."""


@dataclass(frozen=True)
class PredictionOptions:
    """How images are asked about.

    Attributes:
        box: left, top, right, bottom [px]: where the person is; None = not told.
        near: What is nearer is cut away [m].
        far: What is farther is cut away [m].
        fps: Frames a second of a sequence that is smoothed; 0 = not smoothed.
        pictures: Whether every image gets a picture.
        lists: Whether every image is told, of not too many.
        finder: Finds people in images of whole scenes; None = an image shows one person, cut out or in the box.
    """

    box: tuple[int, int, int, int] | None = None
    near: float = 0.0
    far: float = math.inf
    fps: float = 0.0
    pictures: bool = True
    lists: bool = True
    finder: PeopleFinder | None = None


class Answer(NamedTuple, Generic[EstimateT]):
    """What came of an image, or of one of the people in it.

    Attributes:
        request: The image.
        image: As it was asked about.
        estimate: What the model answered.
        somebody: Who was found in the image; None = the image shows one person.
    """

    request: Request
    image: DepthImage
    estimate: EstimateT
    somebody: Somebody | None = None

    @property
    def name(self) -> str:
        """Of the files that are written."""
        return self.request.name if self.somebody is None else f"{self.request.name}_{self.somebody.number}"

    @property
    def source(self) -> str:
        """Where the image comes from and who it is about, for messages."""
        return self.request.source + ("" if self.somebody is None else f", person {self.somebody.number}")


class Seen(NamedTuple, Generic[EstimateT]):
    """What came of an image, of everybody in it.

    Attributes:
        request: The image.
        image: As it was asked about.
        answers: By number; of an image that shows one person, one.
    """

    request: Request
    image: DepthImage
    answers: tuple[Answer[EstimateT], ...]


class Tally(NamedTuple):
    """What came of many images.

    Attributes:
        n_skipped: Images that could not be read.
        n_people: People who were answered.
        n_deserted: Images in which nobody was found.
    """

    n_skipped: int
    n_people: int
    n_deserted: int


class ImageRun(ABC, Generic[EstimateT]):
    """A model that is asked about images, and the folder that what it answers is written to.

    Attributes:
        about: What is told of the model's file.
        options: How it is asked.
        out: The folder.
        lines_name: Of the file with all answers of a sequence.
        schema: Of an answer.
        has_joints: Whether the pictures show joints.
    """

    has_joints: ClassVar[bool] = True
    lines_name: ClassVar[str]
    schema: ClassVar[tuple[str, int]]

    def __init__(self, about: dict[str, Any], options: PredictionOptions, out: Path) -> None:
        self.about = about
        self.options = options
        self.out = out

    @abstractmethod
    def _ask(self, request: Request, image: DepthImage, somebody: Somebody | None) -> EstimateT:
        """Asks the model about an image, or about one who was found in it; a UserError if it cannot answer."""

    @abstractmethod
    def _values(self, answer: Answer[EstimateT]) -> dict[str, Any]:
        """What the model answered, as JSON values."""

    @abstractmethod
    def _picture(self, answer: Answer[EstimateT]) -> Picture:
        """The picture of an image that shows one person."""

    @abstractmethod
    def _panel(self, answer: Answer[EstimateT]) -> Picture:
        """The picture of such an image for the contact sheet."""

    @abstractmethod
    def _scene_panel(self, seen: Seen[EstimateT]) -> Picture:
        """The picture of a whole scene for the contact sheet."""

    @abstractmethod
    def _sentence(self, answer: Answer[EstimateT]) -> str:
        """What the model answered, in words."""

    def predict_one(self, request: Request) -> None:
        """Asks about an only image.

        Raises:
            UserError: It cannot be read, or shows nothing.
        """
        seen = self._seen(request)
        self._write(seen)
        self._tell(seen)

    def predict_all(self, requests: Sequence[Request]) -> Tally:
        """Asks about each image of a sequence; those that cannot be read are told and left out."""
        shown = set(first_to_last(len(requests), N_SHOWN).tolist())
        tiles: list[Picture] = []
        lines = []
        n_skipped = n_people = n_deserted = 0
        for place, request in enumerate(progress(requests, "image", "predict")):
            try:
                seen = self._seen(request)
            except (UserError, OSError) as error:
                n_skipped += 1
                log.info("skipped: %s", error)
                lines.append(_line({"name": request.name, "error": readable(str(error))}))
                continue
            lines += self._write(seen)
            n_people += len(seen.answers)
            n_deserted += not seen.answers
            if place in shown:
                tiles.append(sheet_tile(self._seen_panel(seen), request.name))
            if self.options.lists and len(requests) <= N_LISTED:
                self._tell(seen)
        write_atomically(self.out / self.lines_name, "".join(lines))
        if tiles:
            write_picture(self.out / SHEET_NAME, sheet(tiles, self.has_joints))
        return Tally(n_skipped, n_people, n_deserted)

    def _seen(self, request: Request) -> Seen[EstimateT]:
        image = request.read()
        depth = self._cut(image.depth, request.source)
        cut = DepthImage(depth, image.camera)
        if self.options.finder is None:
            if unlikely := request.judge(depth):
                log.warning("warning: %s", unlikely)
            return Seen(request, cut, (Answer(request, cut, self._ask(request, cut, None)),))
        answers = []
        for somebody in everybody(self.options.finder, cut):
            alone = DepthImage(somebody.depth, image.camera)
            answers.append(Answer(request, alone, self._ask(request, alone, somebody), somebody))
        return Seen(request, cut, tuple(answers))

    def _cut(self, depth: NDArray[np.uint16], source: str) -> NDArray[np.uint16]:
        """The depth image without what is nearer or farther; something must be left in the box."""
        near, far = self.options.near, self.options.far
        metres = depth * 1e-3
        depth = depth * ((metres >= near) & (metres <= far))
        left, top, right, bottom = self.options.box or (0, 0, depth.shape[1], depth.shape[0])
        if not depth[max(0, top) : max(0, bottom), max(0, left) : max(0, right)].any():
            where = " in the box" if self.options.box else ""
            raise UserError(f"{source} shows nothing{where} between {near:g} and {far:g} m")
        return depth

    def _write(self, seen: Seen[EstimateT]) -> list[str]:
        """Writes an image's files, and gives what they say as lines."""
        lines = []
        for answer in seen.answers:
            document = self._document(answer)
            write_atomically(self._path(answer), json.dumps(document, indent=1) + "\n")
            lines.append(_line({"name": answer.name} | document))
        if self.options.finder is not None:
            written = {self._path(answer) for answer in seen.answers}
            for path in numbered_files(self.out, seen.request.name):
                if path not in written:
                    path.unlink()
        if not seen.answers:
            lines.append(_line({"name": seen.request.name, "n_people": 0}))
        if self.options.pictures:
            picture = self._seen_picture(seen)
            write_picture(self.out / f"{seen.request.name}.overlay.png", picture)
        return lines

    def _seen_picture(self, seen: Seen[EstimateT]) -> Picture:
        if self.options.finder is None:
            return self._picture(seen.answers[0])
        panel = self._scene_panel(seen)
        return captioned(panel) if self.has_joints else panel

    def _seen_panel(self, seen: Seen[EstimateT]) -> Picture:
        return self._panel(seen.answers[0]) if self.options.finder is None else self._scene_panel(seen)

    def _path(self, answer: Answer[EstimateT]) -> Path:
        return self.out / f"{answer.name}.json"

    def _tell(self, seen: Seen[EstimateT]) -> None:
        for answer in seen.answers:
            log.info("%s: %s, %s", answer.source, self._sentence(answer), self._path(answer))
        if not seen.answers:
            log.info("%s: nobody is found", seen.request.source)

    def _document(self, answer: Answer[EstimateT]) -> dict[str, Any]:
        height, width = answer.image.depth.shape
        schema, version = self.schema
        return {
            "schema": schema,
            "schema_version": version,
            "model": {name: self.about[name] for name in ("name", "kind", "digest")},
            "image": {"source": answer.request.source, "width": width, "height": height},
            "camera": {name: float(getattr(answer.image.camera, name)) for name in ("fx", "fy", "cx", "cy")},
            "box": self.options.box,
            "near": self.options.near,
            "far": number_value(self.options.far),
            "found": None if answer.somebody is None else found_values(answer.somebody),
        } | self._values(answer)


def numbered_files(folder: Path, name: str) -> list[Path]:
    """The files of people who were found in an image of that name before."""
    return [
        path
        for path in folder.glob(f"{glob.escape(name)}_*.json")
        if path.stem.removeprefix(f"{name}_").isdecimal()
    ]


class PredictionRun(ImageRun[JointEstimate]):
    """A run that finds joints.

    Attributes:
        contestant: The model.
    """

    lines_name = LINES_NAME
    schema = (SCHEMA, SCHEMA_VERSION)

    def __init__(
        self, contestant: Contestant, about: dict[str, Any], options: PredictionOptions, out: Path
    ) -> None:
        super().__init__(about, options, out)
        self.contestant = contestant
        self._smoother = TrackSmoother(options.fps) if options.fps else None

    def _ask(self, request: Request, image: DepthImage, somebody: Somebody | None) -> JointEstimate:
        box: Box | None = self.options.box
        if somebody is not None and self.contestant.box_joints:
            box = somebody.person.upper_body
        estimate = ask(self.contestant, image.depth, image.camera, box)
        if self._smoother is not None:
            estimate = self._smoother.smoothed(request.track, request.tick, estimate)
        return estimate

    def _values(self, answer: Answer[JointEstimate]) -> dict[str, Any]:
        smoothed = {"smoothed_fps": self.options.fps or None}
        return smoothed | body_values(answer.estimate, self.contestant.joints)

    def _picture(self, answer: Answer[JointEstimate]) -> Picture:
        return skeleton_picture(self.contestant, *answer.image, answer.estimate)

    def _panel(self, answer: Answer[JointEstimate]) -> Picture:
        return skeleton_panel(answer.image.depth, answer.estimate, self.contestant.joints)

    def _scene_panel(self, seen: Seen[JointEstimate]) -> Picture:
        people = [answer.somebody.person for answer in seen.answers if answer.somebody is not None]
        estimates = [answer.estimate for answer in seen.answers]
        return people_panel(seen.image.depth, people, estimates, self.contestant.joints)

    def _sentence(self, answer: Answer[JointEstimate]) -> str:
        n_found = int((answer.estimate.confidence > 0).sum())
        nobody = ", probably nobody" if answer.estimate.person_probability < PERSON_FROM else ""
        return f"found {n_found} of {len(self.contestant.joints)} joints{nobody}"


def _line(document: dict[str, Any]) -> str:
    return json.dumps(document, separators=(",", ":")) + "\n"
