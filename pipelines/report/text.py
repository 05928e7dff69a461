"""Numbers as a reader wants them; whatever cannot be told is a dash."""

from collections.abc import Mapping, Sequence

NOTHING = "\N{EN DASH}"
MINUS = "\N{MINUS SIGN}"
SPACE = "\N{NO-BREAK SPACE}"
"""Inside intervals and p-values: a narrow cell breaks between them."""

UNITS: Mapping[str, float] = {
    "map_10cm": 100.0,
    "accuracy_10cm": 100.0,
    "accuracy_2d": 100.0,
    "auc_20cm": 100.0,
    "mean_error_cm": 1.0,
    "median_error_cm": 1.0,
    "missing": 100.0,
}
"""What a measure is multiplied by to be shown: shares in percent, lengths in centimetres."""


def number(value: float | None, scale: float = 1.0, sign: bool = False) -> str:
    """A number with one decimal."""
    if value is None:
        return NOTHING
    shown = f"{scale * value:+.1f}" if sign else f"{scale * value:.1f}"
    return "0.0" if float(shown) == 0.0 else shown.replace("-", MINUS)


def with_interval(
    value: float | None, ends: Sequence[float | None] | None, scale: float = 1.0, sign: bool = False
) -> str:
    """A number with its interval: "44.0 [41.2, 46.9]"; an end that is infinite is a dash."""
    if value is None or ends is None:
        return number(value, scale, sign)
    low, high = (number(end, scale, sign) for end in ends)
    return f"{number(value, scale, sign)} [{low},{SPACE}{high}]"


def measured(scores: Mapping, measure: str) -> str:
    """A measure of a group of the ablation's document, with its interval."""
    return with_interval(scores[measure], scores[f"{measure}_ci"], UNITS[measure])


def difference(values: Mapping, measure: str) -> str:
    """A paired difference of the ablation's document, with interval and p-value."""
    gap = values[measure]
    if gap["estimate"] is None:
        return NOTHING
    return f"{with_interval(gap['estimate'], gap['ci'], UNITS[measure], sign=True)}, {p_value(gap['p_value'])}"


def p_value(p: float | None) -> str:
    """A p-value."""
    if p is None:
        return f"p {NOTHING}"
    return f"p{SPACE}<{SPACE}0.001" if p < 0.001 else f"p{SPACE}={SPACE}{p:.3f}"


def counted(n: int, one: str, many: str) -> str:
    """A number of things: "1 frame", "1,110 frames"."""
    return f"{n:,} {one if n == 1 else many}"
