"""Published statistics of stature, body mass index and proportions, as draws.

Sources:
    Adults, United States: Fryar, Carroll, Gu, Afful, Ogden 2021, "Anthropometric reference data for children and
    adults: United States, 2015-2018", Vital Health Stat 3(46): mean stature 175.4 and 161.3 cm, body mass index
    about log-normal with medians 28.4 and 28.2.
    Adults, world: NCD-RisC 2016, "A century of trends in adult human height", eLife 5:e13410 (171 and 159 cm);
    NCD-RisC 2017, Lancet 390:2627 (mean body mass index 24.5 and 24.8).
    Children: Kuczmarski et al. 2002, "2000 CDC growth charts", Vital Health Stat 11(246): medians of stature and
    body mass index by year of age, rounded; index by Cole's LMS method (X = M (1 + L S z)^(1/L)).
    Proportions: coefficients of variation after ANSUR II (Gordon et al. 2014): crotch height over stature 3.3 %,
    biacromial breadth over stature 4 %, hip breadth over stature 5 %, head circumference 2.7 %.
"""

import numpy as np
from numpy.typing import NDArray

CHILD_AGES: NDArray[np.float64] = np.arange(4.0, 19.0)
CHILD_STATURE: dict[str, NDArray[np.float64]] = {
    "female": np.array(
        [101.0, 107.9, 115.0, 121.8, 127.8, 133.1, 138.2, 144.4, 151.5, 157.1, 160.4, 161.9, 162.5, 162.9, 163.1]
    ),
    "male": np.array(
        [102.3, 109.2, 115.5, 121.9, 128.0, 133.7, 138.8, 143.7, 149.3, 156.4, 164.1, 170.1, 173.6, 175.3, 176.2]
    ),
}
"""Median stature at `CHILD_AGES` [cm]."""
CHILD_BMI: dict[str, NDArray[np.float64]] = {
    "female": np.array([15.3, 15.2, 15.2, 15.4, 15.8, 16.3, 16.9, 17.5, 18.1, 18.7, 19.4, 19.9, 20.5, 20.9, 21.3]),
    "male": np.array([15.6, 15.4, 15.4, 15.5, 15.8, 16.2, 16.6, 17.2, 17.8, 18.5, 19.2, 19.9, 20.6, 21.2, 21.8]),
}
"""Median body mass index at `CHILD_AGES` [kg/m^2]."""
CHILD_BMI_L = -2.3
CHILD_BMI_S: NDArray[np.float64] = np.interp(CHILD_AGES, (4.0, 8.0, 12.0, 18.0), (0.080, 0.105, 0.130, 0.135))
CHILD_STATURE_S = 0.044
ADULT_STATURE: dict[tuple[str, str], tuple[float, float]] = {
    ("us", "female"): (161.3, 6.9),
    ("us", "male"): (175.4, 7.5),
    ("world", "female"): (159.5, 7.0),
    ("world", "male"): (171.3, 7.6),
}
"""Mean and standard deviation [cm] by population and sex."""
ADULT_BMI: dict[tuple[str, str], tuple[float, float]] = {
    ("us", "female"): (28.2, 0.235),
    ("us", "male"): (28.4, 0.195),
    ("world", "female"): (24.2, 0.19),
    ("world", "male"): (24.1, 0.165),
}
"""Median [kg/m^2] and standard deviation of the logarithm by population and sex."""
BMI_RANGE = (15.5, 46.0)
SECULAR_LOSS = 0.06
"""Stature lost by year after 40 [cm]: shrinking and earlier birth cohorts (Sorkin et al. 1999)."""


def draw_adult(rng: np.random.Generator, sex: str, age: float) -> tuple[float, float]:
    """Stature [m] and mass [kg] of an adult.

    Args:
        rng: Source of randomness.
        sex: "female" or "male".
        age: [years].
    """
    population = "us" if rng.random() < 0.5 else "world"
    mean, deviation = ADULT_STATURE[population, sex]
    stature = mean + deviation * np.clip(rng.standard_normal(), -2.8, 2.8) - SECULAR_LOSS * max(age - 40.0, 0.0)
    median, log_deviation = ADULT_BMI[population, sex]
    # The index rises by about a tenth from 20 to 50 years and falls after 70 (Fryar et al. 2021, tables 9, 11).
    trend = np.interp(age, (18.0, 50.0, 65.0, 85.0), (0.90, 1.04, 1.04, 0.95))
    index = median * trend * np.exp(log_deviation * np.clip(rng.standard_normal(), -2.8, 2.8))
    index = float(np.clip(index, *BMI_RANGE))
    return float(0.01 * stature), float(index * (0.01 * stature) ** 2)


def draw_child(rng: np.random.Generator, sex: str, age: float) -> tuple[float, float]:
    """Stature [m] and mass [kg] of a child.

    Args:
        rng: Source of randomness.
        sex: "female" or "male".
        age: 4..18 [years].
    """
    median = np.interp(age, CHILD_AGES, CHILD_STATURE[sex])
    stature = 0.01 * median * (1.0 + CHILD_STATURE_S * np.clip(rng.standard_normal(), -2.5, 2.5))
    z = np.clip(rng.standard_normal(), -2.2, 2.0)
    spread = np.interp(age, CHILD_AGES, CHILD_BMI_S)
    index = np.interp(age, CHILD_AGES, CHILD_BMI[sex]) * (1.0 + CHILD_BMI_L * spread * z) ** (1.0 / CHILD_BMI_L)
    return float(stature), float(index * stature**2)
