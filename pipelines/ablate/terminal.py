"""An ablation's document as lines for the terminal."""

from collections.abc import Iterator, Mapping

_GROUPS = {"": "all", "non_occluded": "non-occluded", "occluded": "occluded"}


def table_lines(document: Mapping) -> Iterator[str]:
    """The main table, the differences, then each question's conditions."""
    main = document["main"]
    n_frames = next(iter(main["rows"].values()))["n_frames"]
    yield f"mean average precision of joints at 10 cm, {n_frames} test frames, 95 % intervals over frames"
    yield ""
    yield from _row_lines(main["rows"], document["paper_map_10cm"])
    yield ""
    yield from _difference_lines(main["differences"])
    for question, conditions in document["questions"].items():
        yield ""
        yield f"question: {question}"
        for condition in conditions:
            words = ", ".join(f"{name} {value}" for name, value in condition["settings"].items())
            yield ""
            yield f"  {words}"
            yield from (f"  {line}" for line in _row_lines(condition["rows"], {}))
            yield from (f"  {line}" for line in _difference_lines(condition["differences"]))


def _row_lines(rows: Mapping, paper: Mapping[str, float]) -> Iterator[str]:
    headings = "".join(f"{heading:>22}" for heading in _GROUPS.values())
    yield f"{'':<12}{headings}{'sd of seeds':>14}" + (f"{'paper':>8}" if paper else "")
    for name, row in rows.items():
        cells = "".join(f"{_cell(row[group] if group else row):>22}" for group in _GROUPS)
        spread = "-" if row["map_10cm_sd"] is None else f"{100 * row['map_10cm_sd']:.1f}"
        told = f"{100 * paper[name]:.0f}" if name in paper else ""
        yield f"{name:<12}{cells}{spread:>8} of {row['n_seeds']}" + (f"{told:>9}" if paper else "").rstrip()


def _cell(values: Mapping) -> str:
    if values["map_10cm"] is None:
        return "-"
    low, high = values["map_10cm_ci"]
    return f"{100 * values['map_10cm']:.1f} [{100 * low:.1f}, {100 * high:.1f}]"


def _difference_lines(differences: Mapping) -> Iterator[str]:
    for name, difference in differences.items():
        cells = "".join(f"{_gap(difference[group] if group else difference):>32}" for group in _GROUPS)
        yield f"{name:<22}{cells}"


def _gap(values: Mapping) -> str:
    gap = values["map_10cm"]
    if gap["estimate"] is None or None in gap["ci"]:
        return "-"
    low, high = gap["ci"]
    p_value = "p < 0.001" if gap["p_value"] < 0.001 else f"p = {gap['p_value']:.3f}"
    return f"{100 * gap['estimate']:+.1f} [{100 * low:+.1f}, {100 * high:+.1f}] {p_value}"
