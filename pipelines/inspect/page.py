"""The page of statistics: one HTML file without outside parts, bars drawn as SVG."""

from typing import NamedTuple

from pipelines.corpus import Corpus
from pipelines.drawing.html import templates_of
from pipelines.drawing.palette import STATE_MARKS, css_colour
from pipelines.inspect.coverage import Grid
from pipelines.inspect.statistics import Histogram, Statistics
from synth.vocabulary import JointState

_TEMPLATES = templates_of("pipelines.inspect")
_WIDTH, _HEIGHT, _FOOT = 360.0, 120.0, 16.0
"""Of a chart: its bars, and its ticks below them."""
_LEFT = 34.0
"""Of the grid of views: its ticks on the left."""


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
        *(_chart(f"{name} [deg]", bends, "{:.0f}", "0 is straight") for name, bends in statistics.bends.items()),
    )
    return _TEMPLATES.get_template("page.html").render(
        name=corpus.path.resolve().name,
        header=corpus.header,
        digest=corpus.digest[:16],
        statistics=statistics,
        state_colours={
            name: css_colour(STATE_MARKS[JointState(code)].colour)
            for code, name in enumerate(corpus.header.labels["joint_states"])
        },
        charts=charts,
        grid=_drawn_grid(statistics.views),
        sheets=sheets,
    )


class Cell(NamedTuple):
    """A cell of the grid of views.

    Attributes:
        x: Its left end.
        y: Its upper end.
        opacity: How full it is drawn, 0 = a hole.
        told: What it shows, in words.
    """

    x: float
    y: float
    opacity: float
    told: str


class DrawnGrid(NamedTuple):
    """The grid of views as it is drawn.

    Attributes:
        width: Of the picture.
        height: Of the picture.
        cell: Width and height of a cell.
        cells: All of them.
        across: Place and words of the ticks below.
        down: Place and words of the ticks on the left.
    """

    width: float
    height: float
    cell: tuple[float, float]
    cells: tuple[Cell, ...]
    across: tuple[tuple[float, str], ...]
    down: tuple[tuple[float, str], ...]


def _drawn_grid(grid: Grid) -> DrawnGrid:
    n_down, n_across = len(grid.distances) - 1, len(grid.bearings) - 1
    width, height, left = (_WIDTH - _LEFT) / n_across, 14.0, _LEFT
    top = max(1, *map(max, grid.counts))
    cells = tuple(
        Cell(
            left + k * width,
            row * height,
            0.15 + 0.85 * count / top if count else 0.0,
            f"{count} frames at {grid.bearings[k]:.0f} to {grid.bearings[k + 1]:.0f} deg, "
            f"{grid.distances[row]:g} to {grid.distances[row + 1]:g} m",
        )
        for row, counts in enumerate(grid.counts)
        for k, count in enumerate(counts)
    )
    across = tuple((left + k * width, f"{grid.bearings[k]:.0f}") for k in range(0, n_across + 1, 3))
    down = tuple((row * height + 4.0, f"{grid.distances[row]:g} m") for row in range(1, n_down + 1, 2))
    return DrawnGrid(_WIDTH + 12.0, n_down * height + _FOOT, (width - 1.0, height - 1.0), cells, across, down)


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
