"""Makes docs/reliability.png: how often joints that a forest calls p likely are right, on a corpus' test frames.

python tools/reliability_picture.py --corpus DIR --model FILE [--out docs/reliability.png]
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from forests.calibration import WITHIN_M, Reliability, reliability
from forests.frames import FrameSequence
from forests.oarf.model import OARFModel
from forests.oarf.predict import Predictor
from forests.oarf.storage import load_model
from pipelines.corpus import Corpus
from pipelines.corpus.sequence import CorpusFrames

SIDE, MARGIN, HISTOGRAM = 420, 70, 90
INK, GREY, BLUE, ORANGE = (40, 40, 40), (190, 190, 190), (178, 114, 0), (0, 94, 213)


def answers(model: OARFModel, frames: FrameSequence) -> tuple[Reliability, Reliability]:
    """Reliability of "within 10 cm" and of "hidden by an object", all joints together."""
    predictor = Predictor(model)
    within, hidden, is_within, is_hidden = [], [], [], []
    for i in range(len(frames)):
        frame = frames[i]
        estimate = predictor.predict(frame.depth, frame.camera)
        within.append(estimate.probability)
        hidden.append(estimate.hidden_probability)
        is_within.append(np.linalg.norm(estimate.joints - frame.joints, axis=1) <= WITHIN_M)
        is_hidden.append(frame.is_occluded)
    pairs = ((within, is_within), (hidden, is_hidden))
    first, second = (reliability(np.concatenate(p), np.concatenate(y)) for p, y in pairs)
    return first, second


def panel(found: Reliability, title: str, colour: Sequence[int]) -> NDArray[np.uint8]:
    """One diagram: observed share over probability, and below it how many joints each bin holds."""
    image = np.full((SIDE + HISTOGRAM + 2 * MARGIN + 20, SIDE + 2 * MARGIN, 3), 255, np.uint8)
    left, bottom = MARGIN, MARGIN + SIDE

    def at(x: float, y: float) -> tuple[int, int]:
        return round(left + x * SIDE), round(bottom - y * SIDE)

    for tick in np.linspace(0.0, 1.0, 6):
        cv2.line(image, at(0, tick), at(1, tick), (235, 235, 235), 1)
        write(image, f"{tick:.1f}", (left - 38, at(0, tick)[1] + 5))
        write(image, f"{tick:.1f}", (at(tick, 0)[0] - 12, bottom + HISTOGRAM + 40))
    cv2.rectangle(image, at(0, 1), at(1, 0), GREY, 1)
    cv2.line(image, at(0, 0), at(1, 1), GREY, 1, cv2.LINE_AA)
    filled = np.flatnonzero(found.n_samples > 0)
    points = np.array([at(found.predicted[k], found.observed[k]) for k in filled])
    cv2.polylines(image, [points.astype(np.int32)], False, colour, 2, cv2.LINE_AA)
    for point in points:
        cv2.circle(image, tuple(int(v) for v in point), 5, colour, -1, cv2.LINE_AA)
    n_bins, floor = len(found.n_samples), bottom + HISTOGRAM + 15
    for k, n in enumerate(found.n_samples):
        top = floor - round(HISTOGRAM * n / found.n_samples.max())
        cv2.rectangle(image, (at(k / n_bins, 0)[0] + 2, top), (at((k + 1) / n_bins, 0)[0] - 2, floor), GREY, -1)
    write(image, title, (left, MARGIN - 36), 0.55)
    write(image, f"expected calibration error {found.expected_error:.3f}", (left, MARGIN - 14))
    write(image, "probability given (bars: joints)", (left + 90, floor + 48))
    write(image, "came true", (left + 8, MARGIN + 18))
    return image


def write(image: NDArray[np.uint8], text: str, at: tuple[int, int], size: float = 0.45) -> None:
    """Puts text into an image."""
    cv2.putText(image, text, at, cv2.FONT_HERSHEY_SIMPLEX, size, INK, 1, cv2.LINE_AA)


def main() -> None:
    """Asks a forest about test frames, draws."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--corpus", type=Path, required=True)
    parser.add_argument("--model", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=Path("docs/reliability.png"))
    options = parser.parse_args()
    corpus = Corpus.open(options.corpus)
    draw(load_model(options.model), CorpusFrames(corpus, corpus.split("test")), options.out)


def draw(model: OARFModel, frames: FrameSequence, out: Path) -> None:
    """Writes the picture of one forest."""
    within, hidden = answers(model, frames)
    names = ("joint within 10 cm", "joint hidden by an object")
    panels = [panel(r, name, c) for r, name, c in zip((within, hidden), names, (BLUE, ORANGE), strict=True)]
    cv2.imwrite(str(out), np.concatenate(panels, axis=1))
    for name, found in zip(names, (within, hidden), strict=True):
        print(f"{name}: expected calibration error {found.expected_error:.3f}, {found.n_samples.sum()} joints")


if __name__ == "__main__":
    main()
