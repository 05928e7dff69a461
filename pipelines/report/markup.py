"""Parts of the page as HTML: tables, figures, legends, sections."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib.resources import files

from pipelines.report.chart import swatch
from pipelines.report.methods import Method
from pipelines.report.text import escape


@dataclass(frozen=True)
class Section:
    """A part of the page.

    Attributes:
        name: Its anchor.
        title: Its heading.
        body: HTML.
        is_left_out: The data do not hold it; the body says why.
    """

    name: str
    title: str
    body: str
    is_left_out: bool = False


def left_out(name: str, title: str, why: str) -> Section:
    """A section that the data do not hold, with one line that says so."""
    return Section(name, title, f'<p class="missing">Left out: {escape(why)}.</p>', is_left_out=True)


def paragraph(words: str) -> str:
    """A paragraph of plain words."""
    return f"<p>{escape(words)}</p>"


def items(lines: Iterable[str]) -> str:
    """A list of plain words."""
    return f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in lines)}</ul>"


def table(name: str, caption: str, headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table that scrolls sideways where it is too wide.

    Args:
        name: Its id.
        caption: What it shows.
        headings: Of the columns.
        rows: Cells as plain words; the first names the row.
    """
    head = "".join(f'<th scope="col">{escape(heading)}</th>' for heading in headings)
    body = "".join(f"<tr>{''.join(_cells(row))}</tr>\n" for row in rows)
    return (
        f'<p class="caption">{escape(caption)}</p>'
        f'<div class="scroll" role="region" tabindex="0" aria-label="{escape(caption)}">'
        f'<table id="{name}" aria-label="{escape(caption)}">\n'
        f"<thead><tr>{head}</tr></thead>\n<tbody>{body}</tbody></table></div>\n"
    )


def _cells(row: Sequence[str]) -> Iterable[str]:
    yield f'<th scope="row">{escape(row[0])}</th>'
    yield from (f"<td>{escape(cell)}</td>" for cell in row[1:])


def figures(charts: Iterable[tuple[str, str]], legend: str = "") -> str:
    """Charts side by side under a legend.

    Args:
        charts: Caption and SVG of each.
        legend: HTML.
    """
    drawn = "".join(f"<figure>{svg}<figcaption>{escape(caption)}</figcaption></figure>" for caption, svg in charts)
    return f'{legend}<div class="charts">{drawn}</div>\n'


def legend(methods: Iterable[Method]) -> str:
    """Names of a chart's series."""
    entries = "".join(f"<li>{swatch(method)}{escape(method.name)}</li>" for method in methods)
    return f'<ul class="legend">{entries}</ul>'


def document(title: str, lead: str, sections: Sequence[Section]) -> str:
    """The page.

    Args:
        title: Of the page.
        lead: HTML under the title.
        sections: In order.
    """
    style = files(__package__).joinpath("style.css").read_text(encoding="utf-8")
    links = "".join(f'<li><a href="#{s.name}">{escape(s.title)}</a></li>' for s in sections if not s.is_left_out)
    parts = "".join(f'<section id="{s.name}"><h2>{escape(s.title)}</h2>\n{s.body}</section>\n' for s in sections)
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<meta name="color-scheme" content="light dark">'
        f"<title>{escape(title)}</title>\n<style>\n{style}</style></head>\n"
        f"<body><header><h1>{escape(title)}</h1>\n{lead}<nav><ul>{links}</ul></nav></header>\n"
        f"<main>{parts}</main></body></html>\n"
    )
