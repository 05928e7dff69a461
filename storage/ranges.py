"""Ranges of settings: one sentence for whatever lies outside, NaN and infinity included."""

from collections.abc import Mapping

MAX_SEED = 2**63 - 1
"""Seeds fit into a signed 64-bit integer."""
MAX_FRAMES = 10**8
"""Of a corpus, and of whatever is counted in frames."""
MAX_THREADS = 1024
"""Of threads and processes."""


def check_number(name: str, value: float, least: float, most: float, unit: str = "") -> None:
    """Makes sure that a number lies in a range; NaN lies in none.

    Args:
        name: What the number is called.
        value: The number.
        least: The lowest that is allowed.
        most: The highest that is allowed; finite.
        unit: Said after the range.

    Raises:
        ValueError: It does not.
    """
    if not least <= value <= most:
        raise ValueError(f"{name}={_shown(value)} must be in {least}..{most}{f' {unit}' if unit else ''}")


def check_fields(settings: object, ranges: Mapping[str, tuple[float, float]]) -> None:
    """Makes sure that fields of settings lie in their ranges; None is not checked, of a tuple every number.

    Args:
        settings: What has the fields.
        ranges: Lowest and highest that is allowed, by name.

    Raises:
        ValueError: One does not.
    """
    for name, (least, most) in ranges.items():
        value = getattr(settings, name)
        for number in value if isinstance(value, tuple) else () if value is None else (value,):
            check_number(name, number, least, most)


def check_span(name: str, span: tuple[float, float] | None, least: float, most: float) -> None:
    """Makes sure that a span (lowest, highest) lies in a range and is in order; None is not checked.

    Raises:
        ValueError: It does not, or is not.
    """
    if span is not None and not least <= span[0] <= span[1] <= most:
        ends = ", ".join(map(_shown, span))
        raise ValueError(f"{name}=({ends}) must be (lowest, highest) within {least}..{most}")


def _shown(value: float) -> str:
    """A number as a message has it; Python writes no integers of thousands of digits."""
    return f"{value}" if isinstance(value, float) or abs(value) < 10**30 else "a number of more than 30 digits"
