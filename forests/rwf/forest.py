"""A random walk forest as an estimator: trained from frames, asked with a depth image and where the person is."""

from pathlib import Path
from typing import Self

from numpy.typing import ArrayLike

from forests.boxes import Box
from forests.estimate import JointEstimate
from forests.estimator import Estimator, hold_out
from forests.frames import FrameSequence, Pinhole
from forests.rwf.config import RWFConfig
from forests.rwf.predict import Predictor
from forests.rwf.storage import save_model
from forests.rwf.train import train


class RandomWalkForest(Estimator):
    """Finds joints by walking from a start point, as an estimator of scikit-learn's kind.

    Attributes:
        config: How it is trained and asked.
        n_threads: Threads for training.
        model_: The trained forest, after `fit`.
    """

    def __init__(self, config: RWFConfig = RWFConfig(), n_threads: int = 1) -> None:  # noqa: B008 frozen
        self.config = config
        self.n_threads = n_threads

    def fit(self, frames: FrameSequence, validation: FrameSequence | None = None) -> Self:
        """Trains on frames.

        Args:
            frames: Training frames, such as a `FrameBatch`.
            validation: Frames to tune on; None holds out every tenth training frame, if there are as many.

        Raises:
            ValueError: No frames, or joints that they do not have.
        """
        if validation is None:
            frames, validation = hold_out(frames)
        self.model_ = train(frames, self.config, validation=validation, n_threads=self.n_threads)
        self._predictor = Predictor(self.model_)
        return self

    def predict(
        self, depth: ArrayLike, camera: Pinhole, box: Box | None = None, *, start: ArrayLike | None = None
    ) -> JointEstimate:
        """Finds the joints of the person in `box` or at `start`; see `forests.rwf.predict.Predictor.predict`.

        Raises:
            ValueError: Not fitted yet, no depth image, or both start and box.
        """
        return self._asked().predict(depth, camera, box, start=start)

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
