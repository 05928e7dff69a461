"""The page of statistics: one HTML file without outside parts, bars drawn as SVG."""

from typing import NamedTuple

from pipelines.corpus import Corpus
from pipelines.drawing.html import templates_of
from pipelines.drawing.palette import STATE_MARKS, css_colour
from pipelines.inspect.statistics import Histogram, Statistics

_TEMPLATES = templates_of("pipelines.inspect")
_WIDTH, _HEIGHT, _FOOT = 360.0, 120.0, 16.0
"""Of a chart: its bars, and its ticks below them."""


class Bar(NamedTuple):
    """A bar of a chart.

    Attributes:
        x: Its left end.
        y: Its upper end.
        width: Its width.
        height: Its height.
        n: What it shows.
    """

    x: float
    y: float
    width: float
    height: float
    n: int


class Chart(NamedTuple):
    """A histogram as it is drawn.

    Attributes:
        title: What is counted.
        note: Said below.
        width: Of the picture.
        height: Of the picture.
        bars: From left to right.
        ticks: Place across, and words, of some edges.
    """

    title: str
    note: str
    width: float
    height: float
    bars: tuple[Bar, ...]
    ticks: tuple[tuple[float, str], ...]


def statistics_page(corpus: Corpus, statistics: Statistics, sheets: list[str]) -> str:
    """The page's HTML.

    Args:
        corpus: For its name, seed and settings.
        statistics: What to show.
        sheets: File names of the contact sheets beside the page.
    """
    charts = (
        _chart("Share of the person that is seen", statistics.visible_fraction, "{:g}"),
        _chart("Distance camera to torso [m]", statistics.distance, "{:g}"),
        _chart(
            "Camera's bearing seen from the person [deg]",
            statistics.azimuth,
            "{:.0f}",
            "0 is in front, positive to the person's left",
        ),
    )
    return _TEMPLATES.get_template("page.html").render(
        name=corpus.path.resolve().name,
        header=corpus.header,
        digest=corpus.digest[:16],
        statistics=statistics,
        state_colours={state.name.lower(): css_colour(mark.colour) for state, mark in STATE_MARKS.items()},
        charts=charts,
        sheets=sheets,
    )


def _chart(title: str, histogram: Histogram, form: str, note: str = "") -> Chart:
    top = max(1, *histogram.counts)
    step = _WIDTH / len(histogram.counts)
    bars = tuple(
        Bar(k * step + 0.5, _HEIGHT * (1 - n / top), step - 1, _HEIGHT * n / top, n)
        for k, n in enumerate(histogram.counts)
    )
    n_edges = len(histogram.edges)
    ticks = tuple(
        (min(max(k * step, 14), _WIDTH - 12), form.format(histogram.edges[k]))
        for k in range(0, n_edges, max(1, (n_edges - 1) // 4))
    )
    return Chart(title, note, _WIDTH, _HEIGHT + _FOOT, bars, ticks)
