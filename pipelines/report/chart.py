"""Charts as inline SVG: axes, lines, and rows of bars or intervals."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from markupsafe import Markup, escape

from pipelines.report.methods import Method
from pipelines.report.text import MINUS

WIDTH = 380.0
"""Of every chart, in the units of its text's 12."""
_TOP, _RIGHT, _BOTTOM = 10.0, 14.0, 42.0
_DODGE = 4.0
"""Between whiskers at the same place."""


class Point(NamedTuple):
    """A value with its interval; None = there is nothing to show.

    Attributes:
        x: Where.
        y: The value.
        low: Lower end.
        high: Upper end.
    """

    x: float
    y: float | None
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Series:
    """Points of one method.

    Attributes:
        method: How they are drawn.
        points: By rising x.
        marker_step: A marker at every so many points.
    """

    method: Method
    points: tuple[Point, ...]
    marker_step: int = 1


@dataclass(frozen=True)
class Axis:
    """What a direction of a chart means.

    Attributes:
        label: Written beside it, with the unit.
        low: Value at its beginning.
        high: Value at its end.
        ticks: Values that are written.
        is_log: Equal ratios are equally long.
    """

    label: str
    low: float
    high: float
    ticks: tuple[float, ...]
    is_log: bool = False

    def share(self, value: float) -> float:
        """Where a value lies, 0..1; what is outside lies at the end."""
        low, high, at = (math.log(v) if self.is_log else v for v in (self.low, self.high, max(value, self.low)))
        return min(1.0, max(0.0, (at - low) / (high - low))) if high > low else 0.5


def round_axis(label: str, values: Iterable[float | None], least: tuple[float, float]) -> Axis:
    """An axis with round ticks that holds values.

    Args:
        label: Its label.
        values: What must fit; None is left out.
        least: What must fit besides.
    """
    known = [v for v in values if v is not None and math.isfinite(v)]
    low, high = min([*known, least[0]]), max([*known, least[1]])
    rough = (high - low) / 5.0
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(k * power for k in (1, 2, 5, 10) if k * power >= rough * (1.0 - 1e-9))
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    ticks = tuple(k * step for k in range(first, last + 1))
    return Axis(label, ticks[0], ticks[-1], ticks)


def line_chart(title: str, series: Sequence[Series], x: Axis, y: Axis, with_diagonal: bool = False) -> Markup:
    """Lines over a grid; whiskers where points have an interval.

    Args:
        title: Read out instead of the picture.
        series: The lines.
        x: Across.
        y: Upwards.
        with_diagonal: Draw the line from corner to corner.
    """
    left, height = 46.0, 270.0
    plot_width, plot_height = WIDTH - left - _RIGHT, height - _TOP - _BOTTOM

    def at(x_value: float, y_value: float) -> tuple[float, float]:
        return left + plot_width * x.share(x_value), _TOP + plot_height * (1.0 - y.share(y_value))

    parts = [_grid_line(*at(x.low, tick), *at(x.high, tick)) for tick in y.ticks]
    parts += [_text(left - 6, at(x.low, tick)[1] + 4, _plain(tick), "end") for tick in y.ticks]
    parts += _bottom_axis(x, left, plot_width, _TOP, height - _BOTTOM, height)
    parts.append(_text(13, _TOP + plot_height / 2, y.label, "middle", turned=True))
    if with_diagonal:
        parts.append(_line(*at(x.low, y.low), *at(x.high, y.high), 'class="axis" stroke-dasharray="1 4"'))
    for k, item in enumerate(series):
        shift = _DODGE * (k - (len(series) - 1) / 2) if any(p.low is not None for p in item.points) else 0.0
        parts += _drawn_series(item, at, shift)
    return _svg(title, height, parts)


def _drawn_series(series: Series, at: Callable[[float, float], tuple[float, float]], shift: float) -> list[str]:
    method = series.method
    places = ((point, at(point.x, point.y)) for point in series.points if point.y is not None)
    known = [(point, (px + shift, py)) for point, (px, py) in places]
    path = " ".join(f"{px:.1f},{py:.1f}" for _, (px, py) in known)
    parts = [
        f'<polyline points="{path}" fill="none" stroke="{method.colour}" stroke-width="2"'
        f' stroke-dasharray="{method.dash}"/>'
    ]
    for point, (px, _) in known:
        if point.low is not None and point.high is not None:
            ends = at(point.x, point.low)[1], at(point.x, point.high)[1]
            parts.append(_line(px, ends[0], px, ends[1], f'stroke="{method.colour}" stroke-width="1"'))
    return parts + [marker(method, *place) for _, place in known[:: series.marker_step]]


def row_chart(title: str, rows: Sequence[tuple[str, Sequence[Series]]], x: Axis, is_bar: bool) -> Markup:
    """Rows of values with their intervals: bars from the axis' beginning, or points beside a line at 0.

    Args:
        title: Read out instead of the picture.
        rows: Name, and series of a single point each; the point's y is the value, its x is nothing.
        x: Across.
        is_bar: Bars instead of points.
    """
    left, step = 118.0, 7.0 if is_bar else 13.0
    plot_width = WIDTH - left - _RIGHT
    heights = [step * max(1, len(series)) + 9.0 for _, series in rows]
    height = _TOP + sum(heights) + _BOTTOM
    parts = _bottom_axis(x, left, plot_width, _TOP, height - _BOTTOM, height)
    if x.low < 0.0 < x.high:
        zero = left + plot_width * x.share(0.0)
        parts.append(_line(zero, _TOP, zero, height - _BOTTOM, 'class="axis"'))
    top = _TOP
    for (name, series), row_height in zip(rows, heights, strict=True):
        parts.append(_text(left - 7, top + row_height / 2 + 4, name, "end"))
        for k, item in enumerate(series):
            middle = top + 4.5 + step * (k + 0.5)
            parts += _drawn_row(
                item.method, item.points[0], x, (left, plot_width), middle, step if is_bar else 0.0
            )
        top += row_height
    return _svg(title, height, parts)


def _drawn_row(
    method: Method, point: Point, x: Axis, plot: tuple[float, float], middle: float, thickness: float
) -> list[str]:
    """One value; its bar is `thickness` wide, 0 = a marker instead."""
    if point.y is None:
        return []
    left, width = plot
    end = left + width * x.share(point.y)
    parts = []
    if thickness:
        parts.append(
            f'<rect x="{left:.1f}" y="{middle - thickness / 2 + 0.5:.1f}" width="{end - left:.1f}"'
            f' height="{thickness - 1:.1f}" fill="{method.colour}" fill-opacity="0.75"/>'
        )
    if point.low is not None and point.high is not None:
        ends = (left + width * x.share(end) for end in (point.low, point.high))
        style = 'class="axis"' if thickness else f'stroke="{method.colour}" stroke-width="2"'
        parts.append(_line(*_across(ends, middle), style))
    return parts if thickness else [*parts, marker(method, end, middle)]


def _across(ends: Iterable[float], y: float) -> tuple[float, float, float, float]:
    first, last = ends
    return first, y, last, y


def _bottom_axis(x: Axis, left: float, width: float, top: float, bottom: float, height: float) -> list[str]:
    parts = []
    for tick in x.ticks:
        place = left + width * x.share(tick)
        parts.append(_grid_line(place, top, place, bottom))
        parts.append(_text(place, bottom + 15, _plain(tick), "middle"))
    parts.append(_line(left, bottom, left + width, bottom, 'class="axis"'))
    return [*parts, _text(left + width / 2, height - 6, x.label, "middle")]


def marker(method: Method, x: float, y: float) -> str:
    """A method's marker."""
    r = 3.6
    paths = {
        "square": f"M{x - r:.1f} {y - r:.1f}h{2 * r:.1f}v{2 * r:.1f}h{-2 * r:.1f}z",
        "diamond": f"M{x:.1f} {y - 1.4 * r:.1f}l{1.4 * r:.1f} {1.4 * r:.1f}l{-1.4 * r:.1f} {1.4 * r:.1f}"
        f"l{-1.4 * r:.1f} {-1.4 * r:.1f}z",
        "triangle": f"M{x:.1f} {y - 1.2 * r:.1f}l{1.2 * r:.1f} {2.1 * r:.1f}h{-2.4 * r:.1f}z",
        "cross": f"M{x - r:.1f} {y - r:.1f}l{2 * r:.1f} {2 * r:.1f}m0 {-2 * r:.1f}l{-2 * r:.1f} {2 * r:.1f}",
    }
    if method.marker == "disc":
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{r}" fill="{method.colour}"/>'
    style = f'fill="none" stroke="{method.colour}" stroke-width="2"'
    return f'<path d="{paths[method.marker]}" {style if method.marker == "cross" else _fill(method)}/>'


def _fill(method: Method) -> str:
    return f'fill="{method.colour}"'


def swatch(method: Method) -> Markup:
    """A method's line and marker for a legend."""
    line = _line(1, 7, 35, 7, f'stroke="{method.colour}" stroke-width="2" stroke-dasharray="{method.dash}"')
    return Markup(f'<svg viewBox="0 0 36 14" aria-hidden="true">{line}{marker(method, 18, 7)}</svg>')


def _svg(title: str, height: float, parts: Iterable[str]) -> Markup:
    head = f'<svg viewBox="0 0 {WIDTH:g} {height:g}" role="img" aria-label="{escape(title)}">'
    return Markup(f"{head}{''.join(parts)}</svg>")


def _line(x1: float, y1: float, x2: float, y2: float, style: str) -> str:
    return f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" {style}/>'


def _grid_line(x1: float, y1: float, x2: float, y2: float) -> str:
    return _line(x1, y1, x2, y2, 'class="grid"')


def _text(x: float, y: float, words: str, anchor: str, turned: bool = False) -> str:
    turn = f' transform="rotate(-90 {x:.1f} {y:.1f})"' if turned else ""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{turn}>{escape(words)}</text>'


def _plain(value: float) -> str:
    return f"{round(value, 6):,g}".replace("-", MINUS)
