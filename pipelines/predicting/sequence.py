"""Images asked about one after the other: a JSON file and a picture each, and for several one of each of all."""

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

from forests.estimate import JointEstimate
from pipelines.drawing.files import write_picture
from pipelines.drawing.overlays import skeleton_panel
from pipelines.drawing.palette import Picture
from pipelines.drawing.skeletons import PERSON_FROM
from pipelines.drawing.tiles import N_SHOWN, sheet, sheet_tile
from pipelines.errors import UserError
from pipelines.models.asking import Contestant, ask
from pipelines.predicting.images import DepthImage, Request
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
    """

    box: tuple[int, int, int, int] | None = None
    near: float = 0.0
    far: float = math.inf
    fps: float = 0.0
    pictures: bool = True
    lists: bool = True


class Answer(NamedTuple, Generic[EstimateT]):
    """What came of an image.

    Attributes:
        request: The image.
        image: As it was asked about.
        estimate: What the model answered.
    """

    request: Request
    image: DepthImage
    estimate: EstimateT


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
    def _ask(self, request: Request, image: DepthImage) -> EstimateT:
        """Asks the model about an image; a UserError if it cannot answer."""

    @abstractmethod
    def _values(self, answer: Answer[EstimateT]) -> dict[str, Any]:
        """What the model answered, as JSON values."""

    @abstractmethod
    def _picture(self, answer: Answer[EstimateT]) -> Picture:
        """The picture of an image."""

    @abstractmethod
    def _panel(self, answer: Answer[EstimateT]) -> Picture:
        """The picture of an image for the contact sheet."""

    @abstractmethod
    def _sentence(self, answer: Answer[EstimateT]) -> str:
        """What the model answered, in words."""

    def predict_one(self, request: Request) -> None:
        """Asks about an only image.

        Raises:
            UserError: It cannot be read, or shows nothing.
        """
        answer = self._answer(request)
        self._write(answer)
        self._tell(answer)

    def predict_all(self, requests: Sequence[Request]) -> int:
        """Asks about each image of a sequence; those that cannot be read are told and left out.

        Returns:
            How many were left out.
        """
        shown = set(first_to_last(len(requests), N_SHOWN).tolist())
        tiles: list[Picture] = []
        lines = []
        n_skipped = 0
        for place, request in enumerate(progress(requests, "image", "predict")):
            try:
                answer = self._answer(request)
            except (UserError, OSError) as error:
                n_skipped += 1
                log.info("skipped: %s", error)
                lines.append(_line({"name": request.name, "error": readable(str(error))}))
                continue
            lines.append(_line({"name": request.name} | self._write(answer)))
            if place in shown:
                tiles.append(sheet_tile(self._panel(answer), request.name))
            if self.options.lists and len(requests) <= N_LISTED:
                self._tell(answer)
        write_atomically(self.out / self.lines_name, "".join(lines))
        if tiles:
            write_picture(self.out / SHEET_NAME, sheet(tiles, self.has_joints))
        return n_skipped

    def _answer(self, request: Request) -> Answer[EstimateT]:
        image = request.read()
        depth = self._cut(image.depth, request.source)
        if unlikely := request.judge(depth):
            log.warning("warning: %s", unlikely)
        cut = DepthImage(depth, image.camera)
        return Answer(request, cut, self._ask(request, cut))

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

    def _write(self, answer: Answer[EstimateT]) -> dict[str, Any]:
        """Writes an image's files, and gives what they say."""
        document = self._document(answer)
        write_atomically(self._path(answer), json.dumps(document, indent=1) + "\n")
        if self.options.pictures:
            write_picture(self.out / f"{answer.request.name}.overlay.png", self._picture(answer))
        return document

    def _path(self, answer: Answer[EstimateT]) -> Path:
        return self.out / f"{answer.request.name}.json"

    def _tell(self, answer: Answer[EstimateT]) -> None:
        log.info("%s: %s, %s", answer.request.source, self._sentence(answer), self._path(answer))

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
        } | self._values(answer)


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

    def _ask(self, request: Request, image: DepthImage) -> JointEstimate:
        estimate = ask(self.contestant, image.depth, image.camera, self.options.box)
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

    def _sentence(self, answer: Answer[JointEstimate]) -> str:
        n_found = int((answer.estimate.confidence > 0).sum())
        nobody = ", probably nobody" if answer.estimate.person_probability < PERSON_FROM else ""
        return f"found {n_found} of {len(self.contestant.joints)} joints{nobody}"


def _line(document: dict[str, Any]) -> str:
    return json.dumps(document, separators=(",", ":")) + "\n"
