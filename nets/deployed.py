"""Exported orientation nets, asked with onnxruntime alone: torch is not needed."""

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.boxes import Box
from forests.frames import Pinhole
from nets.orientation.decode import decode_crops, softmax
from nets.orientation.model import Calibration
from nets.patches import MISSING, body_window, cut_patch, head_window
from nets.runtime import MissingLibraryError
from nets.views import View

INPUT = "images"


class Facing(NamedTuple):
    """Which way a person faces.

    Attributes:
        angle: Heading of the body or pan of the head: 0 = towards the camera, pi / 2 = towards the image's right
            [rad].
        concentration: Kappa of the von Mises distribution about the angle.
        probability: That the angle is right to 22.5 degrees.
        posture: Name of the likeliest posture; empty of heads.
        posture_probability: Of that posture; NaN of heads.
    """

    angle: float
    concentration: float
    probability: float
    posture: str
    posture_probability: float


class DeployedOrientation:
    """An exported orientation net, ready to be asked.

    Attributes:
        region: What it looks at: body or head.
    """

    def __init__(self, path: Path | str) -> None:
        """Opens an .onnx file that `to_onnx` of `nets.orientation.export` made.

        Raises:
            MissingLibraryError: onnxruntime is not installed.
            ValueError: There is no such file, or it holds no such net.
        """
        session = _session(Path(path))
        told = session.get_modelmeta().custom_metadata_map
        try:
            config, self._postures = json.loads(told["config"]), tuple(json.loads(told["postures"]))
            self._view, self._calibration = View(**json.loads(told["view"])), json.loads(told["calibration"])
            self.region, self._output = str(config["region"]), config["output"]
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(f"{path} holds no exported orientation net: {error!r} in its metadata") from None
        self._session = session

    def patch(self, depth: NDArray[np.uint16], camera: Pinhole, box: Box) -> NDArray[np.float32]:
        """(2, height, width) what the net looks at.

        Args:
            depth: (height, width) uint16 [mm], 0 = nothing.
            camera: Intrinsics.
            box: left, top, right, bottom [px] of the body or of the head.

        Raises:
            ValueError: An empty box, or one in which the image shows nothing.
        """
        view = self._view
        if self.region == "head":
            window = head_window(depth, camera, box)
        else:
            window = body_window(depth, camera, box, view.height * view.pixel_m)
        relative = cut_patch(depth, camera, window, (view.height, view.width), view.pixel_m).relative
        is_there = relative != MISSING
        value = np.clip(relative * np.float32(1e-3 / view.reach_m), -1.0, 1.0)
        return np.stack([value * is_there, is_there]).astype(np.float32)

    def ask(self, patches: NDArray[np.float32]) -> list[Facing]:
        """Which way the people of patches face.

        Args:
            patches: (n, 2, height, width), see `patch`.
        """
        if not len(patches):
            return []
        raw, told, second = self._session.run(["angle", "log_concentration", "auxiliary"], {INPUT: patches})
        angles = decode_crops(raw[:, None], self._output)
        calibration = Calibration(**self._calibration)
        kappa, probability = calibration.concentration(told), calibration.probability(told)
        likely = softmax(second) if self.region == "body" else np.full((len(raw), 1), np.nan)
        names = self._postures if self.region == "body" else ("",)
        best = likely.argmax(axis=1)
        return [
            Facing(float(angle), float(k), float(p), names[j], float(likely[row, j]))
            for row, (angle, k, p, j) in enumerate(zip(angles, kappa, probability, best.tolist(), strict=True))
        ]


def _session(path: Path) -> Any:
    """A session on one thread."""
    try:
        import onnxruntime
    except ImportError:
        raise MissingLibraryError(
            "exported nets need onnxruntime, which is not installed; install it with: pip install onnxruntime"
        ) from None
    if not path.is_file():
        raise ValueError(f"there is no file {path}")
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    try:
        return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
    except Exception as error:
        raise ValueError(f"{path} holds no sound ONNX graph: {error}") from None
