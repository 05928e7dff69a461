"""The section of example frames: what the camera saw, what is true, what each method answered."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from forests.calibration import WITHIN_M
from pipelines.report.examples import ERROR_CAP_M, PLACES, Choice, Example, choose_examples, frame_errors
from pipelines.report.markup import Section, left_out, paragraph
from pipelines.report.methods import METHODS
from pipelines.report.models import first_model
from pipelines.report.pictures import (
    View,
    class_colour,
    depth_picture,
    estimate_picture,
    image_tag,
    label_picture,
    true_label,
    truth_picture,
)
from pipelines.report.source import Source
from pipelines.report.text import SPACE, escape, number
from synth.frame import Frame
from synth.vocabulary import OCCLUDER_CLASSES, OCCLUDER_CODE

_TITLE = "Examples"
_NAME = "examples"


class Labels(NamedTuple):
    """A method's labels of the pixels of the examples.

    Attributes:
        by_row: (height, width) uint8 by the example's row: class + 1, 0 where there is no depth.
        tells_classes: Whether it tells classes of objects apart.
    """

    by_row: Mapping[int, NDArray[np.uint8]]
    tells_classes: bool


def examples_section(source: Source) -> Section:
    """Frames at the quantiles of the gain."""
    choice = choose_examples(source)
    if choice is None:
        return left_out(_NAME, _TITLE, "they need two methods that answered the same frames")
    if source.corpus is None:
        return left_out(_NAME, _TITLE, "the corpus is not there")
    sensor = source.document["settings"]["sensor"]
    truths = source.truths
    frames = {item.row: source.corpus.frame(int(truths.frame[item.row]), sensor) for item in choice.examples}
    labels = {name: _labels_of(source, name, frames) for name in source.rows}
    known = {name: item for name, item in labels.items() if item is not None}
    parts = [_example(source, item, frames[item.row], known) for item in choice.examples]
    return Section(_NAME, _TITLE, _rule(choice) + _legend(frames.values()) + _note(source, known) + "".join(parts))


def _rule(choice: Choice) -> str:
    first, second = (METHODS[name].name for name in choice.pair)
    quantiles = ", ".join(f"{place.quantile:g}" for place in PLACES)
    frames = "the test frames in which an object hides a joint" if choice.is_hiding else "all test frames"
    return paragraph(
        f"Chosen by rule: {frames} ({choice.n_frames:,}) are ordered by how much smaller the mean error over "
        f"joints is for {first} than for {second}, both of the first training; an error counts at most "
        f"{100 * ERROR_CAP_M:.0f} cm. Shown are the frames at the quantiles {quantiles} of that order."
    )


def _note(source: Source, known: Mapping[str, Labels]) -> str:
    """Why labels of pixels are missing, if they are."""
    lacking = [name for name in source.rows if name not in known and source.main["rows"][name]["pixels"][0]]
    if not lacking:
        return ""
    names = ", ".join(METHODS[name].name for name in lacking)
    return f'<p class="missing">Left out: labels of pixels of {escape(names)}; their models are not there.</p>'


def _labels_of(source: Source, name: str, frames: Mapping[int, Frame]) -> Labels | None:
    model = first_model(source, name) if source.main["rows"][name]["pixels"][0] else None
    if model is None or model.contestant.classes is None:
        return None
    predictor, classes = model.contestant.predictor, model.contestant.classes
    by_row = {
        row: predictor.label_pixels(frame.depth, frame.camera)  # type: ignore[attr-defined]
        for row, frame in frames.items()
    }
    return Labels(by_row, len(classes.names) - classes.n_parts > 1)


def _example(source: Source, item: Example, frame: Frame, labels: Mapping[str, Labels]) -> str:
    view = View.of(frame)
    truths = source.truths
    seen = image_tag(depth_picture(view), "depth", is_flat=False)
    names, row = truths.joints, item.row
    truth = image_tag(truth_picture(view, names, truths.xyz[row], truths.state[row]), "true joints", is_flat=True)
    tiles = [
        _tile("depth", [seen]),
        _tile("truth", [truth, image_tag(label_picture(view, true_label(frame)), "true labels", is_flat=True)]),
    ]
    for name in source.rows:
        tiles.append(_method_tile(source, name, row, view, labels.get(name)))
    objects = ", ".join(dict.fromkeys(part.class_name for part in frame.info.objects)) or "no object"
    words = (
        f"Frame {frame.info.index}, {objects}; {100 * frame.info.visible_fraction:.0f} % of the person seen. "
        f"Gain {number(item.gain_m, 100.0, sign=True)} cm."
    )
    return (
        f'<div class="example" id="frame-{frame.info.index}"><h3>{escape(item.words)}</h3>{paragraph(words)}'
        f'<div class="tiles">{"".join(tiles)}</div></div>\n'
    )


def _method_tile(source: Source, name: str, row: int, view: View, labels: Labels | None) -> str:
    results = source.answers[name][0]
    truths = results.truths
    joints = estimate_picture(view, truths.joints, truths.xyz[row], results.proposals[row, :, 0], WITHIN_M)
    shown = [image_tag(joints, f"joints, {METHODS[name].short}", is_flat=True)]
    if labels is not None:
        picture = label_picture(view, labels.by_row[row], labels.tells_classes)
        shown.append(image_tag(picture, f"labels, {METHODS[name].short}", is_flat=True))
    error = number(float(frame_errors(results)[row]), 100.0)
    return _tile(f"{METHODS[name].short}, {error}{SPACE}cm", shown)


def _tile(caption: str, images: list[str]) -> str:
    return f"<figure>{''.join(images)}<figcaption>{escape(caption)}</figcaption></figure>"


def _legend(frames: Iterable[Frame]) -> str:
    shown = {part.class_name for frame in frames for part in frame.info.objects}
    classes = "".join(
        f'<li><i style="background:repeating-linear-gradient(45deg,{class_colour(OCCLUDER_CODE[name])} 0 3px,'
        f'#555 3px 6px)"></i>{escape(name)}</li>'
        for name in OCCLUDER_CLASSES[1:]
        if name in shown
    )
    words = (
        "Upper pictures, truth: yellow ring = hidden by an object, blue dot = any other joint. Methods: green "
        "dot = within 10 cm, red cross = farther off, tied to the true place; the thin grey skeleton is the "
        "truth. Under the pictures, the mean error. Lower pictures: labels of pixels, body parts in plain colours "
        "(the person's left light, right deep), objects in stripes; grey stripes = an object, its class not told."
    )
    return paragraph(words) + (f'<ul class="legend">{classes}</ul>' if classes else "")
