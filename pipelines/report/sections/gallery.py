"""The section of example frames: what the camera saw, what is true, what each method answered."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from forests.calibration import WITHIN_M
from pipelines.drawing.labels import PixelLabels, true_labels
from pipelines.drawing.palette import CLASS_COLOURS, css_colour
from pipelines.drawing.windows import Window
from pipelines.report.examples import ERROR_CAP_M, PLACES, Example, choose_examples, frame_errors
from pipelines.report.methods import METHODS
from pipelines.report.models import first_model
from pipelines.report.page import Section, Tile
from pipelines.report.pictures import depth_image, errors_image, example_window, labels_image, truth_image
from pipelines.report.source import Source
from pipelines.report.text import SPACE, number
from synth.frame import Frame
from synth.vocabulary import OCCLUDER_CLASSES, OCCLUDER_CODE

_TITLE = "Examples"
_NAME = "examples"

Labels = Mapping[int, PixelLabels]
"""A method's labels of the pixels of the examples, by the example's row."""


class ShownExample(NamedTuple):
    """An example as the page shows it.

    Attributes:
        number: Of the frame.
        title: Why this one.
        objects: Classes of its objects.
        percent_seen: How much of the person is seen.
        gain: Of the pair of methods [cm].
        tiles: Its pictures.
    """

    number: int
    title: str
    objects: str
    percent_seen: str
    gain: str
    tiles: list[Tile]


def examples_section(source: Source) -> Section:
    """Frames at the quantiles of the gain."""
    choice = choose_examples(source)
    if choice is None:
        return Section(_NAME, _TITLE, missing="they need two methods that answered the same frames")
    if source.corpus is None:
        return Section(_NAME, _TITLE, missing="the corpus is not there")
    sensor = source.document["settings"]["sensor"]
    truths = source.truths
    frames = {item.row: source.corpus.frame(int(truths.frame[item.row]), sensor) for item in choice.examples}
    labelling = [name for name in source.rows if source.main["rows"][name]["pixels"][0]]
    labels = {name: _labels_of(source, name, frames) for name in labelling}
    first, second = (METHODS[name].name for name in choice.pair)
    values = {
        "frames": "the test frames in which an object hides a joint" if choice.is_hiding else "all test frames",
        "n_frames": choice.n_frames,
        "first": first,
        "second": second,
        "cap_cm": f"{100 * ERROR_CAP_M:.0f}",
        "quantiles": [f"{place.quantile:g}" for place in PLACES],
        "classes": _class_colours(frames.values()),
        "without_labels": [METHODS[name].name for name, known in labels.items() if known is None],
        "examples": [_example(source, item, frames[item.row], labels) for item in choice.examples],
    }
    return Section(_NAME, _TITLE, values)


def _labels_of(source: Source, name: str, frames: Mapping[int, Frame]) -> Labels | None:
    """None if the method's model is not there."""
    model = first_model(source, name)
    labeller = None if model is None else model.contestant.labeller
    if labeller is None:
        return None
    return {
        row: PixelLabels(labeller.label_pixels(frame.depth, frame.camera), labeller.classes)
        for row, frame in frames.items()
    }


def _class_colours(frames: Iterable[Frame]) -> dict[str, str]:
    """CSS colours of the classes of objects that some frames show."""
    shown = {part.class_name for frame in frames for part in frame.info.objects}
    return {name: css_colour(CLASS_COLOURS[OCCLUDER_CODE[name]]) for name in OCCLUDER_CLASSES[1:] if name in shown}


def _example(source: Source, item: Example, frame: Frame, labels: Mapping[str, Labels | None]) -> ShownExample:
    window = example_window(frame)
    truths, row = source.truths, item.row
    truth = truth_image(frame, window, truths.joints, truths.xyz[row], truths.state[row])
    tiles = [
        Tile("depth", [depth_image(frame, window)]),
        Tile("truth", [truth, labels_image(true_labels(frame), window, "true labels")]),
    ]
    for name in source.rows:
        known = labels.get(name)
        tiles.append(_method_tile(source, name, row, frame, window, None if known is None else known[row]))
    objects = ", ".join(dict.fromkeys(part.class_name for part in frame.info.objects)) or "no object"
    seen = f"{100 * frame.info.visible_fraction:.0f}"
    return ShownExample(frame.info.index, item.words, objects, seen, number(item.gain_m, 100.0, sign=True), tiles)


def _method_tile(
    source: Source, name: str, row: int, frame: Frame, window: Window, labels: PixelLabels | None
) -> Tile:
    results, short = source.answers[name][0], METHODS[name].short
    truths, xyz = results.truths, results.proposals[row, :, 0]
    words = f"joints, {short}"
    shown = [errors_image(frame, window, truths.joints, truths.xyz[row], xyz, WITHIN_M, words)]
    if labels is not None:
        shown.append(labels_image(labels, window, f"labels, {short}"))
    error = number(float(frame_errors(results)[row]), 100.0)
    return Tile(f"{short}, {error}{SPACE}cm", shown)
