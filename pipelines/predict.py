"""undergrowth predict: the joints in depth images, as JSON and drawn."""

import json
import logging
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, NamedTuple, cast

import cv2
import numpy as np
import tyro
from numpy.typing import NDArray

from forests.estimate import JointEstimate
from forests.frames import Intrinsics, Pinhole
from pipelines.corpus import Corpus
from pipelines.corpus.header import write_atomically
from pipelines.depthfile import read_depth
from pipelines.errors import UserError
from pipelines.evaluate import load_contestant
from pipelines.overlay import PixelLabels, overlay
from pipelines.predictions import Contestant, PixelLabeller
from synth.render.presets import camera as preset

log = logging.getLogger(__name__)

SCHEMA = "undergrowth skeleton"
SCHEMA_VERSION = 1


class DepthImage(NamedTuple):
    """What is asked about.

    Attributes:
        name: Of the files that are written.
        source: Where it came from, for messages.
        depth: (height, width) uint16 [mm], 0 = nothing.
        camera: Intrinsics.
    """

    name: str
    source: str
    depth: NDArray[np.uint16]
    camera: Pinhole


@dataclass(frozen=True)
class PredictSettings:
    """Finds the joints of the one person in each depth image; writes NAME.json and NAME.overlay.png.

    Attributes:
        model: The model's file.
        depth: Depth images, 16-bit PNG or .npy of integers [mm], 0 = nothing.
        out: Folder of what is written.
        camera: Camera preset of the images.
        intrinsics: fx fy cx cy of the images [px], instead of a preset.
        corpus: Take the images from a corpus instead of files.
        frame: Frame numbers in the corpus.
        sensor: Sensor model for the corpus' depth; by default clean depth.
        box: left top right bottom [px], right and bottom excluded: where the person is; by default everywhere.
        near: Cut away what is nearer [m].
        far: Cut away what is farther [m].
    """

    model: Annotated[Path, tyro.conf.Positional]
    depth: Annotated[tuple[Path, ...], tyro.conf.Positional] = ()
    out: Path = Path("out/predict")
    camera: str | None = None
    intrinsics: tuple[float, float, float, float] | None = None
    corpus: Path | None = None
    frame: tuple[int, ...] = ()
    sensor: str | None = None
    box: tuple[int, int, int, int] | None = None
    near: float = 0.0
    far: float = math.inf

    def __post_init__(self) -> None:
        if not 0.0 <= self.near < self.far:
            raise ValueError(f"near={self.near} and far={self.far} must be 0 <= near < far [m]")
        if self.box is not None and not (self.box[0] < self.box[2] and self.box[1] < self.box[3]):
            raise ValueError(f"box={self.box} must be left top right bottom, left < right, top < bottom")

    def run(self) -> int:
        """Asks the model about every image."""
        self._check_inputs()
        contestant, about = load_contestant(self.model)
        forest: Any = contestant.predictor
        self.out.mkdir(parents=True, exist_ok=True)
        for image in self._images():
            depth = self._cut(image)
            estimate = forest.predict(depth, image.camera, box=self.box)
            path = self.out / f"{image.name}.json"
            write_atomically(path, json.dumps(self._document(image, contestant, about, estimate), indent=1) + "\n")
            drawing = self.out / f"{image.name}.overlay.png"
            if not cv2.imwrite(str(drawing), picture(contestant, depth, image.camera, estimate)):
                raise UserError(f"cannot write {drawing}")
            n_found = int((estimate.confidence > 0).sum())
            log.info("%s: %d of %d joints, %s", image.source, n_found, len(contestant.joints), path)
        return 0

    def _check_inputs(self) -> None:
        """Refuses inputs that contradict one another."""
        if (self.corpus is None) == (not self.depth):
            raise UserError("give depth images, or --corpus DIR --frame N")
        if self.corpus is not None:
            if not self.frame or self.camera or self.intrinsics:
                raise UserError("--corpus needs --frame N, and brings its camera")
            return
        if self.frame or self.sensor:
            raise UserError("--frame and --sensor need --corpus DIR")
        if (self.camera is None) == (self.intrinsics is None):
            raise UserError("the camera is needed: give either --camera NAME or --intrinsics FX FY CX CY")
        names = [path.stem for path in self.depth]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise UserError(f"several images are called {twice[0]}: what is written would mix")

    def _images(self) -> Iterator[DepthImage]:
        if self.corpus is None:
            for path in self.depth:
                depth = read_depth(path)
                yield DepthImage(path.stem, str(path), depth, self._camera(path, depth))
            return
        corpus = Corpus.open(self.corpus)
        for number in self.frame:
            if number not in corpus.indices:
                raise UserError(f"frame {number} is not in {self.corpus}, which has 0..{len(corpus) - 1}")
            depth = corpus.arrays("depth", [number], self.sensor)[0]
            yield DepthImage(f"frame_{number:06d}", f"frame {number}", depth, corpus.camera(number))

    def _camera(self, path: Path, depth: NDArray[np.uint16]) -> Pinhole:
        if self.intrinsics is not None:
            fx, fy = self.intrinsics[:2]
            if not (all(map(math.isfinite, self.intrinsics)) and fx > 0 and fy > 0):
                raise UserError(f"intrinsics={self.intrinsics} must be finite, fx and fy above 0")
            return Intrinsics(*self.intrinsics)
        try:
            camera = preset(cast("str", self.camera))
        except ValueError as error:
            raise UserError(str(error)) from None
        height, width = depth.shape
        if (camera.width, camera.height) != (width, height):
            raise UserError(
                f"{path} is {width}x{height}, but camera {camera.name} gives {camera.width}x{camera.height}; "
                "give --intrinsics for cut or scaled images"
            )
        return camera

    def _cut(self, image: DepthImage) -> NDArray[np.uint16]:
        """The depth image without what is nearer or farther; something must be left in the box."""
        metres = image.depth * 1e-3
        depth = image.depth * ((metres >= self.near) & (metres <= self.far))
        left, top, right, bottom = self.box or (0, 0, depth.shape[1], depth.shape[0])
        if not depth[max(0, top) : max(0, bottom), max(0, left) : max(0, right)].any():
            where = " in the box" if self.box else ""
            raise UserError(f"{image.source} shows nothing{where} between {self.near:g} and {self.far:g} m")
        return depth

    def _document(
        self, image: DepthImage, contestant: Contestant, about: dict[str, Any], estimate: JointEstimate
    ) -> dict[str, Any]:
        height, width = image.depth.shape
        return {
            "schema": SCHEMA,
            "schema_version": SCHEMA_VERSION,
            "model": {name: about[name] for name in ("name", "kind", "digest")},
            "image": {"source": image.source, "width": width, "height": height},
            "camera": {name: float(getattr(image.camera, name)) for name in ("fx", "fy", "cx", "cy")},
            "box": self.box,
            "near": self.near,
            "far": _number(self.far),
            "joints": joint_values(estimate, contestant.joints),
        }


def joint_values(estimate: JointEstimate, joints: tuple[str, ...]) -> dict[str, dict[str, Any]]:
    """What was found, by joint, as JSON values; docs/formats.md describes the keys.

    Args:
        estimate: The joints.
        joints: Their names.
    """
    values: dict[str, dict[str, Any]] = {}
    for k, name in enumerate(joints):
        is_there = np.isfinite(estimate.proposals[k]).all(axis=1)
        found = zip(estimate.proposals[k][is_there], estimate.proposal_confidence[k][is_there], strict=True)
        values[name] = {
            "xyz": _place(estimate.joints[k]),
            "uv": _place(estimate.joints_2d[k]),
            "confidence": _number(estimate.confidence[k]),
            "probability": _number(estimate.probability[k]),
            "hidden_probability": _number(estimate.hidden_probability[k]),
            "spread": _number(estimate.spread[k]),
            "proposals": [{"xyz": _place(xyz), "confidence": _number(share)} for xyz, share in found],
        }
    return values


def picture(
    contestant: Contestant, depth: NDArray[np.uint16], camera: Pinhole, estimate: JointEstimate
) -> NDArray[np.uint8]:
    """The skeleton over the depth; beside it the labels of the pixels, if the model gives any."""
    if contestant.classes is None:
        return overlay(depth, estimate, contestant.joints)
    labels = cast("PixelLabeller", contestant.predictor).label_pixels(depth, camera)
    return overlay(depth, estimate, contestant.joints, PixelLabels(labels, contestant.classes.names))


def _place(values: NDArray[np.float32]) -> list[float | None] | None:
    return [_number(value) for value in values] if np.isfinite(values).all() else None


def _number(value: float) -> float | None:
    """Six digits; None for what is not finite, which JSON cannot say."""
    return float(f"{value:.6g}") if math.isfinite(value) else None
