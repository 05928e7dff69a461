"""Asks an orientation net about images: which way the person faces, as JSON values and as an arrow."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from forests.boxes import Box, upper_foreground_box
from forests.crops import foreground_box
from forests.frames import Pinhole
from nets.orientation.config import POSTURES, Region
from pipelines.drawing import palette
from pipelines.drawing.headings import draw_heading
from pipelines.drawing.palette import Picture
from pipelines.drawing.people import boxes_picture, scene_window
from pipelines.drawing.windows import Window, foreground_window
from pipelines.errors import UserError
from pipelines.orientation.frames import HEAD_MARGIN_M
from pipelines.predicting.images import DepthImage, Request
from pipelines.predicting.people import Somebody
from pipelines.predicting.sequence import Answer, ImageRun, PredictionOptions, Seen
from pipelines.predicting.skeleton import number_value

if TYPE_CHECKING:
    from nets.orientation.estimate import OrientationEstimate
    from nets.orientation.predict import OrientationPredictor

SIZE = (560, 560)
"""Of a picture at most [px]."""
ARROW_FROM_BELOW = 45
"""An arrow of a body begins so far above the lower edge [px]."""


class OrientationRun(ImageRun["OrientationEstimate"]):
    """A run that tells which way people face.

    Attributes:
        predictor: The net.
    """

    has_joints = False
    lines_name = "orientations.jsonl"
    schema = ("undergrowth orientation", 1)

    def __init__(
        self, predictor: "OrientationPredictor", about: dict[str, Any], options: PredictionOptions, out: Path
    ) -> None:
        super().__init__(about, options, out)
        self.predictor = predictor

    def _box(self, image: DepthImage, somebody: Somebody | None) -> Box:
        if somebody is not None and self.predictor.region == "body":
            return somebody.person.box
        return self.options.box or region_without_detector(self.predictor.region, *image)

    def _ask(self, request: Request, image: DepthImage, somebody: Somebody | None) -> "OrientationEstimate":
        from nets.runtime import repeatable

        try:
            with repeatable():
                return self.predictor.predict(image.depth, image.camera, self._box(image, somebody))
        except ValueError as error:
            raise UserError(f"{request.source}: {error}") from None

    def _values(self, answer: "Answer[OrientationEstimate]") -> dict[str, Any]:
        estimate = answer.estimate
        return {
            "region": estimate.region,
            "region_box": [round(edge, 2) for edge in self._box(answer.image, answer.somebody)],
            "angle": number_value(estimate.angle),
            "concentration": number_value(estimate.concentration),
            "probability": number_value(estimate.probability),
            "tilt": number_value(estimate.tilt),
            "roll": number_value(estimate.roll),
            "postures": {
                name: number_value(value)
                for name, value in zip(POSTURES, estimate.posture_probability.tolist(), strict=False)
            },
        }

    def _picture(self, answer: "Answer[OrientationEstimate]") -> Picture:
        window = foreground_window(answer.image.depth, *SIZE)
        picture = window.cut(palette.grey_depth(answer.image.depth), is_smooth=True)
        self._draw(picture, window, answer)
        return picture

    def _draw(self, picture: Picture, window: Window, answer: "Answer[OrientationEstimate]") -> None:
        left, _, right, bottom = self._box(answer.image, answer.somebody)
        middle = np.array([(left + right) / 2.0 - window.columns.start, bottom - window.rows.start]) * window.scale
        middle[0] = np.clip(middle[0], 0, picture.shape[1] - 1)
        middle[1] = np.clip(middle[1], 0, picture.shape[0] - ARROW_FROM_BELOW)
        draw_heading(picture, middle, answer.estimate.angle, answer.estimate.probability)

    def _scene_panel(self, seen: "Seen[OrientationEstimate]") -> Picture:
        people = [answer.somebody.person for answer in seen.answers if answer.somebody is not None]
        picture = boxes_picture(seen.image.depth, people)
        for answer in seen.answers:
            self._draw(picture, scene_window(seen.image.depth), answer)
        return picture

    def _panel(self, answer: "Answer[OrientationEstimate]") -> Picture:
        return self._picture(answer)

    def _sentence(self, answer: "Answer[OrientationEstimate]") -> str:
        estimate = answer.estimate
        angle = math.degrees(estimate.angle)
        if estimate.region == "head":
            second = f"tilt {math.degrees(estimate.tilt):.0f}, roll {math.degrees(estimate.roll):.0f} degrees"
            return f"head pan {angle:.0f} degrees (probability {estimate.probability:.2f}), {second}"
        return f"heading {angle:.0f} degrees (probability {estimate.probability:.2f}), {estimate.posture}"


def region_without_detector(region: Region, depth: NDArray[np.uint16], camera: Pinhole) -> Box:
    """The box of a person who is cut out, where no detector gives one.

    Args:
        region: body or head.
        depth: (height, width) uint16 [mm], 0 = nothing; not all 0.
        camera: Intrinsics.
    """
    if region == "body":
        left, top, right, bottom = foreground_box(depth)
        return float(left), float(top), float(right), float(bottom)
    upper = upper_foreground_box(depth, camera)
    assert upper is not None
    middle, top, _, bottom = (upper[0] + upper[2]) / 2.0, *upper[1:]
    px_per_m = (bottom - top) / 0.6
    half = HEAD_MARGIN_M * px_per_m
    return middle - half, top, middle + half, top + 2.0 * half
