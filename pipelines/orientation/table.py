"""The ablation of orientation nets as a table for the terminal, and as pictures of answers against the truth."""

from collections.abc import Iterator, Mapping
from typing import Any

import cv2
import numpy as np

from pipelines.drawing import palette
from pipelines.drawing.captions import write_words
from pipelines.drawing.palette import Picture

CELL_PX = 4
_HEAD, _SIDE, _GAP = 22, 92, 8
TITLES = {
    "softmax_centres": "class centre",
    "softmax_interpolated": "interpolated",
    "regression": "regression",
    "von_mises": "von Mises",
    "biternion_cosine": "biternion",
    "biternion_von_mises": "biternion + vM",
}
"""Of the columns, in the order of the paper's table 4."""


def table_lines(document: Mapping[str, Any]) -> Iterator[str]:
    """Mean error [degrees] over the seeds, with the deviation between them."""
    cells = {(cell["output"], cell["n_bins"]): cell for cell in document["cells"]}
    outputs, bins = _axes(document)
    yield f"mean angular error [degrees] on {document['n_test']} heads, and its deviation over the seeds"
    yield f"{'sectors':<10}" + "".join(f"{TITLES[output]:>18}" for output in outputs)
    for n_bins in bins:
        shown = "".join(f"{_words(cells.get((output, n_bins))):>18}" for output in outputs)
        yield f"{n_bins or 'none':<10}" + shown


def _axes(document: Mapping[str, Any]) -> tuple[list[str], list[int]]:
    """Outputs and numbers of sectors that are there, in the order of the table."""
    there = {cell["output"] for cell in document["cells"]}
    bins = {cell["n_bins"] for cell in document["cells"]}
    return [name for name in TITLES if name in there], sorted(bins - {0}) + [0] * (0 in bins)


def _words(cell: Mapping[str, Any] | None) -> str:
    if cell is None:
        return "-"
    deviation = cell["deviation_of_seeds_deg"]
    return f"{cell['mean_error_deg']:.1f}" + ("" if deviation is None else f" ± {deviation:.1f}")


def counts_picture(document: Mapping[str, Any]) -> Picture:
    """Answers (upwards) against the truth (rightwards), -180..180 degrees, a field for each cell of the table.

    As figure 1 of the paper; the brighter, the more heads. A right answer lies on the diagonal.
    """
    cells = {(cell["output"], cell["n_bins"]): np.array(cell["counts"]) for cell in document["cells"]}
    outputs, bins = _axes(document)
    side = CELL_PX * len(next(iter(cells.values())))
    size = (_HEAD + len(bins) * (side + _GAP), _SIDE + len(outputs) * (side + _GAP), 3)
    picture = np.full(size, palette.PAPER, np.uint8)
    for row, n_bins in enumerate(bins):
        top = _HEAD + row * (side + _GAP)
        write_words(picture, f"{n_bins} sectors" if n_bins else "true angles", (4, top + side // 2))
        for column, output in enumerate(outputs):
            left = _SIDE + column * (side + _GAP)
            if row == 0:
                write_words(picture, TITLES[output], (left, 15))
            if (output, n_bins) in cells:
                picture[top : top + side, left : left + side] = _field(cells[output, n_bins], side)
    return picture


def _field(counts: np.ndarray, side: int) -> Picture:
    share = np.sqrt(counts / max(1, counts.max()))[::-1]
    grey = np.rint(255.0 * share).astype(np.uint8)
    large = cv2.resize(grey, (side, side), interpolation=cv2.INTER_NEAREST)
    return np.asarray(cv2.applyColorMap(large, cv2.COLORMAP_VIRIDIS), np.uint8)


_CURVE = (560, 250)
_CURVE_OUTPUTS = {
    "biternion_von_mises": palette.SKY_BLUE,
    "biternion_cosine": palette.BLUISH_GREEN,
    "softmax_interpolated": palette.ORANGE,
    "regression": palette.REDDISH_PURPLE,
}


def turning_picture(document: Mapping[str, Any], n_bins: int) -> Picture:
    """Sines of the answers about a person who turns, of nets that learned from so many sectors (the paper's figure 2).

    The faint line is the truth, which rightwards makes a full turn.

    Args:
        document: Of an ablation.
        n_bins: Sectors; 0 = true angles.
    """
    width, height = _CURVE
    picture = np.full((height + 2 * _HEAD, width + 16, 3), palette.PAPER, np.uint8)
    true = np.array(document["turning_rad"])
    order = np.argsort(true, kind="stable")

    def curve(angle: np.ndarray, colour: palette.Colour, thick: int) -> None:
        x = np.linspace(8, 8 + width, len(order))
        y = _HEAD + height * (0.5 - 0.45 * np.sin(angle[order]))
        points = np.rint(np.stack([x, y], axis=1)).astype(np.int32)
        cv2.polylines(picture, [points], False, colour, thick, cv2.LINE_AA)

    curve(true, palette.FAINT, 5)
    place = 8
    for cell in document["cells"]:
        colour = _CURVE_OUTPUTS.get(cell["output"])
        if cell["n_bins"] == n_bins and colour is not None:
            curve(np.array(cell["turning_rad"]), colour, 1)
            cv2.line(picture, (place, height + _HEAD + 11), (place + 16, height + _HEAD + 11), colour, 3)
            place = 20 + write_words(picture, TITLES[cell["output"]], (place + 22, height + _HEAD + 15))
    learned = f"{n_bins} sectors" if n_bins else "true angles"
    write_words(picture, f"sine of the pan over a turn, learned from {learned}", (8, 15))
    return picture
