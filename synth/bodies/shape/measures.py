"""Measured corner phenotypes and how a person's lengths and radii are mixed from them."""

from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from synth.bodies.shape.segments import FINGERS

LENGTH_NAMES: tuple[str, ...] = (
    "hip_half_width", "pelvis_to_lumbar", "lumbar_to_thorax", "thorax_to_neck", "neck_to_head", "head_up",
    "clavicle_up", "clavicle_in", "clavicle", "upper_arm", "forearm", "palm", "fingers", "thigh", "shank", "foot",
    "ankle_height",
)  # fmt: skip
"""Fields of `Lengths`."""
MEASURES: tuple[str, ...] = (
    *LENGTH_NAMES,
    "neck_forward", "head_forward", "shoulder_forward", "skull_forward", "crotch_down",
    *(f"{name}_{c}" for name in ("heel", "ball", "toe") for c in "xyz"),
    *(f"{finger}_{k}_{c}" for finger in FINGERS for k in range(4) for c in "xyz"),
)  # fmt: skip
"""Names of the measured lengths. Foot points are relative to the ankle in the body's axes; finger points to the
wrist in the hand's (x toward the index finger, z up the forearm)."""
MEASURE_IDX: dict[str, int] = {name: i for i, name in enumerate(MEASURES)}


@dataclass(frozen=True)
class Corner:
    """A reference phenotype that was measured.

    Attributes:
        sex: "female" or "male".
        age: "baby" (1 year), "child" (9), "young" (25) or "old" (75).
        muscle: "minmuscle", "averagemuscle" or "maxmuscle".
        weight: "minweight", "averageweight" or "maxweight".
        cup: "mincup", "averagecup" or "maxcup".
    """

    sex: str
    age: str
    muscle: str = "averagemuscle"
    weight: str = "averageweight"
    cup: str = "averagecup"


def _corners() -> tuple[Corner, ...]:
    out = []
    for sex in ("female", "male"):
        for age in ("baby", "child", "young", "old"):
            out.append(Corner(sex, age))
        for age in ("child", "young", "old"):
            out.append(Corner(sex, age, "minmuscle", "maxweight"))
            out.append(Corner(sex, age, "minmuscle", "minweight"))
        out.append(Corner(sex, "young", "maxmuscle"))
        out.append(Corner(sex, "young", "minmuscle"))
    out.append(Corner("female", "young", cup="maxcup"))
    out.append(Corner("female", "young", cup="mincup"))
    return tuple(out)


CORNERS: tuple[Corner, ...] = _corners()
CORNER_IDX: dict[Corner, int] = {corner: i for i, corner in enumerate(CORNERS)}
AGES: tuple[tuple[str, float], ...] = (("baby", 1.0), ("child", 9.0), ("young", 20.0), ("old", 78.0))
"""Age in years that each of the reference's ages is taken for; between them proportions go linearly."""


class Profiles(NamedTuple):
    """The measured corners, all over stature.

    Attributes:
        radii: (n_corners, table_size) float32.
        lengths: (n_corners, n_measures) float32.
    """

    radii: NDArray[np.float32]
    lengths: NDArray[np.float32]


@cache
def profiles() -> Profiles:
    """The measured corners, from the package's data."""
    with np.load(str(files("synth.bodies") / "data" / "profiles.npz")) as data:
        return Profiles(data["radii"].astype(np.float32) * np.float32(1e-5), data["lengths"])


def age_mix(age: float) -> dict[str, float]:
    """Weights of the reference ages, summing to 1.

    Args:
        age: [years]; clipped to the first and last.
    """
    for (low, a), (high, b) in pairwise(AGES):
        if age <= b:
            t = min(max((age - a) / (b - a), 0.0), 1.0)
            return {low: 1.0 - t, high: t}
    return {AGES[-1][0]: 1.0}


class Mix(NamedTuple):
    """A person's place among the corners, linear in heaviness on each side of the average.

    Attributes:
        base: (n_corners,) weights at average heaviness.
        heavy: (n_corners,) added per unit of heaviness above 0; sums to 0.
        light: (n_corners,) added per unit of heaviness below 0; sums to 0.
    """

    base: NDArray[np.float64]
    heavy: NDArray[np.float64]
    light: NDArray[np.float64]


def mix_of(sex: float, age: float, muscle: float, bust: float) -> Mix:
    """Weights of the corners.

    Args:
        sex: 0 = female .. 1 = male.
        age: [years].
        muscle: -1 .. 1, 0 is average.
        bust: -1 .. 1, 0 is average; for women and in part for what lies between.
    """
    out = Mix(np.zeros(len(CORNERS)), np.zeros(len(CORNERS)), np.zeros(len(CORNERS)))
    for name, sex_share in (("female", 1.0 - sex), ("male", sex)):
        for stage, age_share in age_mix(age).items():
            share = sex_share * age_share
            plain = CORNER_IDX[Corner(name, stage)]
            out.base[plain] += share
            grown = "child" if stage == "baby" else stage
            middle = CORNER_IDX[Corner(name, grown)]
            for weights, weight, sign in ((out.heavy, "maxweight", 1.0), (out.light, "minweight", -1.0)):
                weights[CORNER_IDX[Corner(name, grown, "minmuscle", weight)]] += sign * share
                weights[middle] -= sign * share
        adult = sex_share * min(max((age - 12.0) / 8.0, 0.0), 1.0)
        strong = Corner(name, "young", "maxmuscle" if muscle > 0 else "minmuscle")
        out.base[CORNER_IDX[strong]] += adult * abs(muscle)
        out.base[CORNER_IDX[Corner(name, "young")]] -= adult * abs(muscle)
        if name == "female":
            cup = Corner(name, "young", cup="maxcup" if bust > 0 else "mincup")
            out.base[CORNER_IDX[cup]] += adult * abs(bust)
            out.base[CORNER_IDX[Corner(name, "young")]] -= adult * abs(bust)
    return out
