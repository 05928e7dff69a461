"""What `undergrowth predict` has written about images, with the images where they can be found."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forests.finder.floor import Floor
from forests.frames import Intrinsics
from pipelines.corpus import Corpus
from pipelines.drawing.skeletons import OUTSIDE_FROM
from pipelines.errors import UserError
from pipelines.online.messages import NS, TrackSkeleton
from pipelines.predicting.sequence import LINES_NAME
from pipelines.predicting.skeleton import SCHEMA
from pipelines.recordings.plain import GivenCamera, file_layout
from pipelines.recordings.readers import read_image
from pipelines.viewer.moments import LEVEL, Arrow, Moment, heading_of_camera, standing


class AnswerShow:
    """The images of a folder of answers, in the order in which they were asked about.

    Attributes:
        fps: A slow pace, since nothing tells how fast the images followed one another.
    """

    def __init__(self, path: Path, corpus: Corpus | None = None, sensor: str | None = None) -> None:
        """Reads the answers.

        Args:
            path: The folder, or its skeletons.jsonl.
            corpus: Where frames of a corpus are, if the answers are about such.
            sensor: Whose noise was added to them.

        Raises:
            UserError: There are no answers, or other ones than of skeletons.
        """
        self.fps = 10.0
        self._corpus, self._sensor = corpus, sensor
        file = path / LINES_NAME if path.is_dir() else path
        self._images: dict[str, list[dict[str, Any]]] = {}
        for number, text in enumerate(_lines(file), start=1):
            try:
                answer = json.loads(text)
            except ValueError as error:
                raise UserError(f"{file}:{number} is no JSON: {error}") from None
            if answer.get("schema") == SCHEMA:
                self._images.setdefault(answer["image"]["source"], []).append(answer)
        if not self._images:
            raise UserError(f"{file} holds no skeletons")
        self._sources = list(self._images)

    def __len__(self) -> int:
        """How many images there are."""
        return len(self._sources)

    def moment(self, number: int) -> Moment:
        """An image, if it is found, with what was answered about it."""
        source = self._sources[number]
        answers = self._images[source]
        camera = Intrinsics(*(float(answers[0]["camera"][name]) for name in ("fx", "fy", "cx", "cy")))
        T = _pose(answers)
        skeletons, persons, arrows = [], [], []
        for k, answer in enumerate(answers):
            found = answer.get("found")
            track_id = (found["number"] if found else k) + 1
            skeleton = _skeleton(track_id, answer, T)
            skeletons.append(skeleton)
            is_known = np.isfinite(skeleton.positions).all(axis=1)
            if is_known.any():
                top = skeleton.positions[is_known]
                persons.append(standing(track_id, top[0, :2], float(top[:, 2].max()) + 0.12))
            if answer.get("heading") is not None:
                arrows.append(Arrow(track_id, "body", heading_of_camera(float(answer["heading"]), T)))
        depth, why = self._depth(source, camera)
        return Moment(source + why, depth, camera, T, {}, tuple(persons), tuple(skeletons), tuple(arrows))

    def close(self) -> None:
        """Does nothing."""

    def _depth(self, source: str, camera: Intrinsics) -> tuple[NDArray[np.uint16] | None, str]:
        """The image that answers are about, and why there is none."""
        name, _, number = source.rpartition(" ")
        if name == "frame" and number.isdecimal():
            if self._corpus is None:
                return None, " (--corpus tells where its image is)"
            return self._corpus.arrays("depth", [int(number)], self._sensor)[0], ""
        path = Path(source)
        try:
            layout = file_layout(path, GivenCamera("", (camera.fx, camera.fy, camera.cx, camera.cy)))
            return read_image(path, layout), ""
        except (UserError, OSError) as error:
            return None, f" (no image: {error})"


def _lines(file: Path) -> list[str]:
    try:
        return file.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise UserError(f"{file} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise UserError(f"{file} is no text") from None


def _pose(answers: list[dict[str, Any]]) -> NDArray[np.float64]:
    """(4, 4) the camera on the floor that was found, level if none was."""
    for answer in answers:
        floor = (answer.get("found") or {}).get("floor")
        if floor is not None:
            return Floor(np.array(floor["normal"], np.float64), float(floor["height"])).T_floor_camera
    return LEVEL


def _skeleton(track_id: int, answer: dict[str, Any], T_floor_camera: NDArray[np.float64]) -> TrackSkeleton:
    joints = answer["joints"]

    def values(name: str) -> NDArray[np.float32]:
        told = (joint.get(name) for joint in joints.values())
        return np.array([math.nan if value is None else value for value in told], np.float32)

    places = np.array([joint["xyz"] or (math.nan,) * 3 for joint in joints.values()], np.float64).reshape(-1, 3)
    placed: NDArray[np.float32] = (places @ T_floor_camera[:3, :3].T + T_floor_camera[:3, 3]).astype(np.float32)
    placed[values("outside_probability") > OUTSIDE_FROM] = np.nan
    return TrackSkeleton(
        NS,
        "floor",
        track_id,
        answer["model"]["name"],
        tuple(joints),
        placed,
        values("probability"),
        values("spread"),
        values("hidden_probability"),
    )
