"""A regression forest as an estimator: trained from frames, asked with a depth image."""

from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forests.boxes import Box
from forests.estimate import JointEstimate
from forests.estimator import Estimator, hold_out
from forests.frames import FrameSequence, Pinhole
from forests.oarf.config import OARFConfig
from forests.oarf.predict import Predictor
from forests.oarf.storage import save_model
from forests.oarf.train import train


class OcclusionAwareForest(Estimator):
    """A regression forest for joints of people whom objects may hide, used as an estimator of scikit-learn's kind.

    Attributes:
        config: How it is trained and asked.
        n_threads: Threads for training.
        model_: The trained forest, after `fit`.
    """

    def __init__(self, config: OARFConfig = OARFConfig(), n_threads: int = 1) -> None:  # noqa: B008 frozen
        self.config = config
        self.n_threads = n_threads

    def fit(self, frames: FrameSequence, validation: FrameSequence | None = None) -> Self:
        """Trains on frames.

        Args:
            frames: Training frames, such as a `FrameBatch`.
            validation: Frames to tune on; None holds out every tenth training frame.

        Raises:
            ValueError: No frames, none that shows a person, or none that knows a joint.
        """
        if validation is None:
            frames, validation = hold_out(frames)
        self.model_ = train(frames, self.config, validation=validation, n_threads=self.n_threads)
        self._predictor = Predictor(self.model_)
        return self

    def predict(self, depth: ArrayLike, camera: Pinhole, box: Box | None = None) -> JointEstimate:
        """Finds the joints in a depth image.

        Args:
            depth: (height, width) uint16 [mm], 0 = nothing.
            camera: Intrinsics.
            box: (left, top, right, bottom) [px], right and bottom excluded: where to look; None = everywhere.

        Raises:
            ValueError: Not fitted yet, or no depth image.
        """
        return self._asked().predict(np.asarray(depth), camera, box)

    def label_pixels(self, depth: ArrayLike, camera: Pinhole) -> NDArray[np.uint8]:
        """(height, width) uint8: class + 1 of every pixel with depth (`model_.classes.names`), 0 elsewhere."""
        return self._asked().label_pixels(np.asarray(depth), camera)

    def save(self, path: Path) -> None:
        """Writes the trained forest to a file, which `forests.load_model` reads.

        Raises:
            ValueError: Not fitted yet.
        """
        save_model(path, self._asked().model)

    def _asked(self) -> Predictor:
        if not hasattr(self, "_predictor"):
            raise ValueError("this forest is not fitted yet: call fit first")
        return self._predictor
