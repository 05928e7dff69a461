"""Whether what a file holds can be the depth of a person in the unit and order that it is read in, and what can."""

from collections.abc import Callable
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from forests.frames import Pinhole
from pipelines.errors import UserError
from pipelines.recordings.layout import Layout

MAX_MM = 65535
"""What lies farther is nothing."""
NEAREST_MM, FARTHEST_MM = 300.0, 15000.0
"""Where a person's median depth must lie."""
FAR_MM = 8000.0
"""A median depth beyond this is told: few cameras see people there."""
TALLEST_M, SMALLEST_M = 4.0, 0.35
"""Nobody is taller, even with raised arms; what is smaller is told."""
_USUAL_MM = (500.0, 6500.0)
"""Median depths that make a unit worth proposing."""
_USUAL_M = (0.8, 2.7)
"""Heights, likewise."""
_SMALLEST_REGION = 0.0005
"""A person has at least this share of an image's pixels in one piece."""
_FEW_PAIRS = 50
_KINECT_NOTHING = 2047
_OF_INTEGERS = {
    0.1: "tenths of a millimetre",
    0.2: "1/5000 m, as in the data sets of TUM",
    0.25: "quarters of a millimetre",
    0.125: "eighths of a millimetre, as of depth shifted by three bits",
    1.0: "millimetres",
    10.0: "centimetres",
    1000.0: "metres",
}
_OF_FLOATS = {1.0: "millimetres", 10.0: "centimetres", 25.4: "inches", 304.8: "feet", 1000.0: "metres"}
"""Units that depth is stored in [mm], the usual ones first."""


class ImplausibleError(UserError):
    """Depth that cannot be a person's as it is read."""


class _Person(NamedTuple):
    """What was kept of an image, measured.

    Attributes:
        median_mm: Median depth.
        height_m: Of its largest piece, as far as the image shows it.
        is_whole: The image cuts that piece neither above nor below.
        share: Of the image's pixels in that piece.
    """

    median_mm: float
    height_m: float
    is_whole: bool
    share: float


def marked_as_nothing(values: NDArray) -> NDArray[np.bool_]:
    """(height, width) bool, which values stand for no depth: 0, negative, not finite, or the end of their type.

    Args:
        values: (height, width) integers or floats, as stored.
    """
    if values.dtype.kind == "f":
        with np.errstate(invalid="ignore"):
            return np.asarray(~(np.isfinite(values) & (values > 0)))
    ends = [int(np.iinfo(values.dtype).max)]
    if values.itemsize > 2 and values.size and int(values.max()) == MAX_MM:
        ends.append(MAX_MM)  # 16 bits, stored in more
    return np.asarray((values <= 0) | np.isin(values, ends))


def judge_values(source: str, values: NDArray, layout: Layout) -> None:
    """Refuses values that cannot be depth in the layout's unit and order of bytes.

    Args:
        source: Where they come from, for messages.
        values: (height, width) integers or floats, as stored.
        layout: How they are read.

    Raises:
        ImplausibleError: The bytes look swapped, the values look like disparities, or most are beyond 65 m.
    """
    unit = layout.unit_of(values.dtype)
    if _looks_swapped(values, unit):
        is_raw = layout.format == "raw"
        setting, now = ("big_endian", layout.big_endian) if is_raw else ("swap_bytes", layout.swap_bytes)
        raise ImplausibleError(
            f"{source}: the bytes look swapped: as they are, the median depth is {_metres(_median(values) * unit)}; "
            f"with the bytes of each value exchanged, it is {_metres(_median(values.byteswap()) * unit)} and "
            f"neighbouring pixels agree; set {setting} = {str(not now).lower()} in a layout"
        )
    if values.dtype.kind in "iu" and layout.mm_per_unit is None and values.max() == _KINECT_NOTHING:
        share = float((values == _KINECT_NOTHING).mean())
        if share > 0.005:
            raise ImplausibleError(
                f"{source}: {_percent(share)} of the pixels have the largest value 2047, the end of 11 bits; these "
                "look like raw disparities of a Kinect, which must be converted to depth first (if they are depth, say "
                "mm_per_unit in a layout)"
            )
    there = _without_backdrop(values)
    median = float(np.median(there)) if there.size else 0.0
    if median * unit > MAX_MM:
        kind = "floats" if values.dtype.kind == "f" else "integers"
        raise ImplausibleError(
            f"{source}: {kind} are read as {_called(unit)}, but the values go up to {float(there.max()):g} (median "
            f"{median:g}), and what is beyond 65 m is no depth; {_proposal(median * unit, unit, np.nan)[1]}"
        )


def judge_person(source: str, depth: NDArray[np.uint16], camera: Pinhole, unit_of: Callable[[], float]) -> str:
    """Refuses depth that cannot be a person's, and tells what is unlikely.

    Args:
        source: Where it comes from, for messages.
        depth: (height, width) uint16 [mm], what was kept of the image.
        camera: Intrinsics.
        unit_of: Gives the unit that it was stored in [mm]; asked only if something is told.

    Returns:
        One sentence about what is unlikely; empty if nothing is.

    Raises:
        ImplausibleError: Too few pixels, or a depth or a height that no person has.
    """
    person = _measured(depth, camera)
    if person.share < _SMALLEST_REGION:
        raise ImplausibleError(
            f"{source} shows no person: the largest piece of its depth has {_percent(person.share)} of the pixels"
        )
    is_tall = person.height_m > TALLEST_M and (person.share < 0.5 or person.median_mm > FAR_MM)
    is_small = person.height_m < SMALLEST_M and person.is_whole
    is_out = not NEAREST_MM <= person.median_mm <= FARTHEST_MM or (is_tall and person.is_whole)
    if not (is_out or is_tall or is_small or person.median_mm > FAR_MM):
        return ""
    said = f"{source}: what is kept of it has a median depth of {_metres(person.median_mm)}"
    if person.is_whole or is_tall:
        said += f" and a height of {person.height_m:.2g} m"
    fits, proposal = _proposal(person.median_mm, unit_of(), person.height_m if person.is_whole else np.nan)
    if is_out or (is_small and fits):
        raise ImplausibleError(
            f"{said}, so it is no person; {proposal}; or the camera or the range of depth is wrong"
        )
    return f"{said}, which is unlikely for a person; {proposal}"


def described(values_mm: NDArray[np.uint16]) -> str:
    """What an image in which nobody was found does hold, in words."""
    there = values_mm[values_mm > 0]
    if not there.size:
        return "it holds no depth at all"
    return f"its depth is {_metres(int(there.min()))} to {_metres(int(there.max()))}"


def _looks_swapped(values: NDArray, unit: float) -> bool:
    """Whether the values with their bytes exchanged are much smoother, or alone make sense."""
    if values.dtype.kind == "f":
        with np.errstate(invalid="ignore"):
            swapped = values.byteswap()
        return NEAREST_MM < _median(swapped) * unit < FARTHEST_MM and _spread(values) > 1e3 * _spread(swapped)
    if values.itemsize > 2:
        if values.min() < 0 or values.max() > MAX_MM:
            return False
        values = values.astype(np.uint16)
    swapped = values.byteswap()
    median = _median(swapped) * unit
    if not NEAREST_MM < median < FARTHEST_MM:
        return False
    as_is, otherwise = _roughness(values), _roughness(swapped)
    if as_is > max(3.0 * otherwise, 1e-3):
        return True
    return _median(values) * unit > FARTHEST_MM and _USUAL_MM[0] <= median <= _USUAL_MM[1] and otherwise <= as_is


def _roughness(values: NDArray) -> float:
    """Mean step between neighbouring pixels that both have depth, as a share of the mean depth."""
    depth = np.where(marked_as_nothing(values), 0, values).astype(np.float64)
    total, n = 0.0, 0
    for a, b in ((depth[1:], depth[:-1]), (depth[:, 1:], depth[:, :-1])):
        both = (a > 0) & (b > 0)
        total += float(np.abs(a - b)[both].sum())
        n += int(np.count_nonzero(both))
    return total / n / float(depth[depth > 0].mean()) if n >= _FEW_PAIRS else 0.0


def _median(values: NDArray) -> float:
    """Of the values that stand for depth; 0 if there are none."""
    there = values[~marked_as_nothing(values)]
    return float(np.median(there.astype(np.float64))) if there.size else 0.0


def _spread(values: NDArray) -> float:
    """How many times the 95th percentile is the 5th; floats in a wrong order have any magnitude."""
    there = _without_backdrop(values).astype(np.float64)
    if not there.size:
        return 1.0
    low, high = np.percentile(np.log(there), [5, 95])
    return float(np.exp(min(high - low, 700.0)))


def _without_backdrop(values: NDArray) -> NDArray:
    """Values other than the largest, if many are equal to it: renderers fill the background with a large number."""
    there = values[~marked_as_nothing(values)]
    if not there.size:
        return there
    is_largest = there == there.max()
    return there[~is_largest] if 0.1 < is_largest.mean() < 1.0 else there


def _measured(depth: NDArray[np.uint16], camera: Pinhole) -> _Person:
    _, regions = cv2.connectedComponents((depth > 0).view(np.uint8), connectivity=8)
    n_pixels = np.bincount(regions.ravel())
    n_pixels[0] = 0
    largest = regions == int(n_pixels.argmax())
    rows = np.flatnonzero(largest.any(axis=1))
    is_whole = bool(rows[0] > 0 and rows[-1] < len(depth) - 1)
    height_m = len(rows) * float(np.median(depth[largest])) / 1000.0 / camera.fy
    return _Person(float(np.median(depth[depth > 0])), height_m, is_whole, float(n_pixels.max() / depth.size))


def _proposal(median_mm: float, unit: float, height_m: float) -> tuple[bool, str]:
    """Which units would make a person of a median depth, in words; and whether they fit the height too.

    If any fits the height, only such are told; a height of NaN is not known.
    """
    known = _OF_FLOATS if unit >= 1000.0 else _OF_INTEGERS
    fits = [u for u in known if u != unit and _USUAL_MM[0] <= median_mm * u / unit <= _USUAL_MM[1]]
    tall = [u for u in fits if _USUAL_M[0] <= height_m * u / unit <= _USUAL_M[1]]
    if not fits:
        return False, "no usual unit makes sense of it (disparities must be converted to depth first)"
    said = [
        f"mm_per_unit = {u:g} ({known[u]}) would make it {_metres(median_mm * u / unit)}" for u in tall or fits
    ]
    return bool(tall), f"in a layout, {', or '.join(said)}"


def _called(unit: float) -> str:
    return _OF_INTEGERS.get(unit, f"units of {unit:g} mm")


def _metres(mm: float) -> str:
    return f"{mm / 1000.0:.3g} m"


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %"
