"""The page of statistics: one HTML file without outside parts, bars drawn as SVG."""

import html

from pipelines.corpus import Corpus
from pipelines.inspect.statistics import Histogram, Statistics

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 64rem; padding: 0 1rem;
       color: #222; background: #fff }
h1 { font-size: 1.5rem } h2 { font-size: 1.1rem; margin: 2rem 0 .5rem }
.grid { display: grid; grid-template-columns: repeat(auto-fit, minmax(20rem, 1fr)); gap: 1rem 2rem }
table { border-collapse: collapse; width: 100% } td, th { text-align: left; padding: .1rem .4rem .1rem 0 }
td.n { text-align: right; font-variant-numeric: tabular-nums; width: 4rem }
.bar { display: flex; height: .9rem; background: #eee } .bar i { display: block; height: 100% }
img { max-width: 100% } .key i { display: inline-block; width: .8rem; height: .8rem; margin: 0 .3rem 0 1rem }
small { color: #666 }
@media (prefers-color-scheme: dark) { body { background: #181614; color: #ddd } .bar { background: #333 }
       small { color: #999 } svg text { fill: #aaa } }
"""
_STATE_COLOURS = {
    "visible": "#2dbe8e",
    "occluded": "#e16414",
    "self_occluded": "#e4d842",
    "outside": "#9a9a9a",
    "unknown": "#6e3c6e",
}


def statistics_page(corpus: Corpus, statistics: Statistics, sheets: list[str]) -> str:
    """The page's HTML.

    Args:
        corpus: For its name, seed and settings.
        statistics: What to show.
        sheets: File names of the contact sheets beside the page.
    """
    name = html.escape(corpus.path.resolve().name)
    objects = ", ".join(f"{n} {html.escape(kind)}" for kind, n in statistics.n_objects.items()) or "no objects"
    counts = "".join(
        f"<div><h2>{html.escape(title)}</h2>{_count_table(rows, statistics.n_frames)}</div>"
        for title, rows in statistics.counts.items()
    )
    return f"""<!doctype html>
<html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{name}</title><style>{_STYLE}</style>
<h1>{name}: {statistics.n_frames} frames</h1>
<p>Seed {corpus.header.seed}, {corpus.header.width}x{corpus.header.height} pixels,
{statistics.n_subjects} subjects,
{objects}. <small>Digest {corpus.digest[:16]}</small></p>
<h2>Joints by state</h2>{_joint_table(statistics)}
<div class="grid">
<div><h2>Share of the person that is seen</h2>{_svg(statistics.visible_fraction, "{:g}")}</div>
<div><h2>Distance camera to torso [m]</h2>{_svg(statistics.distance, "{:g}")}</div>
<div><h2>Camera's bearing seen from the person [deg]</h2>{_svg(statistics.azimuth, "{:.0f}")}
<small>0 is in front, positive to the person's left</small></div>
{counts}</div>
<h2>Frames</h2>{"".join(f'<p><img src="{html.escape(sheet)}" alt="contact sheet">' for sheet in sheets)}
</html>
"""


def _joint_table(statistics: Statistics) -> str:
    key = "".join(f'<i style="background:{c}"></i>{s.replace("_", "-")}' for s, c in _STATE_COLOURS.items())
    rows = []
    for joint, shares in statistics.joint_states.items():
        bars = "".join(
            f'<i style="width:{100 * shares[state]:.2f}%;background:{colour}"></i>'
            for state, colour in _STATE_COLOURS.items()
        )
        numbers = "".join(f'<td class="n">{100 * shares[state]:.1f} %' for state in _STATE_COLOURS)
        rows.append(f'<tr><td>{joint}<td style="width:45%"><div class="bar">{bars}</div>{numbers}')
    return f'<p class="key">{key}</p><table>{"".join(rows)}</table>'


def _count_table(counts: dict[str, int], n_frames: int) -> str:
    rows = []
    for name, count in counts.items():
        share = count / max(1, n_frames)
        bar = f'<div class="bar"><i style="width:{100 * share:.2f}%;background:#5b8def"></i></div>'
        rows.append(f'<tr><td>{html.escape(name)}<td style="width:45%">{bar}<td class="n">{count}')
    return f"<table>{''.join(rows)}</table>" if rows else "<p>none</p>"


def _svg(histogram: Histogram, form: str) -> str:
    width, height, foot = 360.0, 120.0, 16.0
    top = max(1, *histogram.counts)
    step = width / len(histogram.counts)
    bars = "".join(
        f'<rect x="{k * step + 0.5:.1f}" y="{height * (1 - n / top):.1f}" width="{step - 1:.1f}" '
        f'height="{height * n / top:.1f}" fill="#5b8def"><title>{n}</title></rect>'
        for k, n in enumerate(histogram.counts)
    )
    n_ticks = len(histogram.edges)
    every = max(1, (n_ticks - 1) // 4)
    ticks = "".join(
        f'<text x="{min(max(k * step, 8), width - 10):.1f}" y="{height + foot - 3}" font-size="11" '
        f'text-anchor="middle">{form.format(histogram.edges[k])}</text>'
        for k in range(0, n_ticks, every)
    )
    return f'<svg viewBox="0 0 {width} {height + foot}" width="100%" role="img">{bars}{ticks}</svg>'
