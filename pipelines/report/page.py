"""The page and its parts, each a template that is filled with values."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from markupsafe import Markup

from pipelines.drawing.html import Image, templates_of
from pipelines.report.chart import swatch

_TEMPLATES = templates_of("pipelines.report")
_TEMPLATES.globals["swatch"] = swatch


@dataclass(frozen=True)
class Table:
    """A table that scrolls sideways where it is too wide.

    Attributes:
        name: Its id.
        caption: What it shows.
        headings: Of the columns.
        rows: Cells as plain words; the first names the row.
    """

    name: str
    caption: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]


class Chart(NamedTuple):
    """A chart.

    Attributes:
        caption: Under it.
        svg: The drawing.
    """

    caption: str
    svg: Markup


class Tile(NamedTuple):
    """Pictures above each other.

    Attributes:
        caption: Under them.
        images: From top to bottom.
    """

    caption: str
    images: Sequence[Image]


@dataclass(frozen=True)
class Section:
    """A part of the page, drawn by the template of its name.

    Attributes:
        name: Its anchor, and the name of its template.
        title: Its heading.
        values: What the template is filled with.
        missing: Why the data do not hold it; empty if they do.
    """

    name: str
    title: str
    values: Mapping[str, Any] = field(default_factory=dict)
    missing: str = ""

    @property
    def body(self) -> Markup:
        """The HTML under the heading."""
        return rendered(self.name, **self.values)


def rendered(template: str, **values: Any) -> Markup:
    """A template filled with values.

    Args:
        template: Its file's name, without the ending.
        values: By name.
    """
    return Markup(_TEMPLATES.get_template(f"{template}.html").render(**values))
