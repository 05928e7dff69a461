"""BodySpec: a person's measures and clothes; drawn from published statistics."""

from dataclasses import dataclass, fields
from typing import Literal

import numpy as np

from synth.bodies.population import draw_adult, draw_child

TOPS: tuple[str, ...] = ("bare", "tight", "shirt", "long_shirt", "jacket", "pullover")
BOTTOMS: tuple[str, ...] = (
    "bare", "tight", "trousers", "loose", "shorts", "skirt", "long_skirt", "straight", "wide", "coat",
)  # fmt: skip
SKIRTS: tuple[str, ...] = ("skirt", "long_skirt", "coat")
"""Bottoms that hang about both thighs and are not sat in; a coat hangs over straight trousers."""
Wardrobe = Literal["plain", "everyday"]
WARDROBES: tuple[Wardrobe, ...] = ("plain", "everyday")
HAIRS: tuple[str, ...] = ("bald", "short", "medium", "long", "bun")
HEADWEARS: tuple[str, ...] = ("none", "beanie", "cap", "brim", "hood")
SHOES: tuple[str, ...] = ("bare", "shoe", "boot")
SHAPE_FIELDS: tuple[str, ...] = ("muscle", "bust", "belly", "shoulders", "hips", "legs", "arms", "head")
_CHOICES = {"top": TOPS, "bottom": BOTTOMS, "hair": HAIRS, "headwear": HEADWEARS, "shoes": SHOES}
_RANGES: dict[str, tuple[float, float]] = {
    "stature": (0.9, 2.15),
    "mass": (10.0, 220.0),
    "sex": (0.0, 1.0),
    "age": (3.0, 100.0),
    "top_ease": (0.0, 0.06),
    "bottom_ease": (0.0, 0.06),
    "hem_width": (0.0, 0.4),
    "slack": (0.0, 0.04),
    "skirt_length": (0.45, 1.0),
    "skirt_flare": (0.0, 0.25),
    "hair_volume": (0.0, 0.06),
    "sole": (0.0, 0.08),
}

_LATER = ("hem_width", "slack")
"""Fields that the first records of people did not have."""


@dataclass(frozen=True)
class BodySpec:
    """A person's measures and clothes. Only the first four have no default: an undressed, bald, average figure.

    Attributes:
        stature: Standing height without shoes and hair [m].
        mass: Without clothes [kg]; the girths follow from it.
        sex: 0 = female .. 1 = male.
        age: [years].
        muscle: -1 .. 1, muscular build at the same mass; 0 is average. For adults.
        bust: -1 .. 1, for women.
        belly: -1 .. 1, share of the girth that sits at the front of the waist.
        shoulders: Shoulder breadth in standard deviations, -3 .. 3.
        hips: Hip breadth in standard deviations, -3 .. 3.
        legs: Leg length at the same stature in standard deviations, -3 .. 3.
        arms: Arm length in standard deviations, -3 .. 3.
        head: Head size in standard deviations, -3 .. 3.
        top: What covers trunk and arms, one of `TOPS`.
        bottom: What covers the legs, one of `BOTTOMS`.
        top_ease: Distance of the top's cloth from the skin [m].
        bottom_ease: Distance of the bottom's cloth from the skin [m].
        hem_width: Width of each leg of "straight" and "wide" trousers at the hem, for legs of an adult of 1.72 m [m].
        slack: How much farther the cloth of a "pullover" or "jacket" bags out around the elbows [m].
        skirt_length: Where the hem of a "skirt" or "coat" is, from hip (0) to knee (1); of a "long_skirt", knee to
            ankle.
        skirt_flare: How much wider the hem is than the legs ask for [m].
        hair: One of `HAIRS`.
        hair_volume: Thickness of the hair on the skull [m].
        headwear: One of `HEADWEARS`.
        shoes: One of `SHOES`.
        sole: Thickness of the soles [m]; adds to the standing height.
        fold_seed: Number of the pattern of folds in the cloth.
    """

    stature: float
    mass: float
    sex: float
    age: float
    muscle: float = 0.0
    bust: float = 0.0
    belly: float = 0.0
    shoulders: float = 0.0
    hips: float = 0.0
    legs: float = 0.0
    arms: float = 0.0
    head: float = 0.0
    top: str = "bare"
    bottom: str = "bare"
    top_ease: float = 0.0
    bottom_ease: float = 0.0
    skirt_length: float = 0.9
    skirt_flare: float = 0.05
    hair: str = "bald"
    hair_volume: float = 0.0
    headwear: str = "none"
    shoes: str = "bare"
    sole: float = 0.0
    fold_seed: int = 0
    hem_width: float = 0.0
    slack: float = 0.0

    def __post_init__(self) -> None:
        for name, (low, high) in _RANGES.items():
            if not low <= getattr(self, name) <= high:
                raise ValueError(f"{name}={getattr(self, name)} must be in [{low}, {high}]")
        for name in SHAPE_FIELDS:
            bound = 1.0 if name in ("muscle", "bust", "belly") else 3.0
            if not -bound <= getattr(self, name) <= bound:
                raise ValueError(f"{name}={getattr(self, name)} must be in [{-bound}, {bound}]")
        for name, known in _CHOICES.items():
            if getattr(self, name) not in known:
                raise ValueError(f"{name}={getattr(self, name)!r} is unknown, must be one of {', '.join(known)}")
        index = self.mass / self.stature**2
        if not 11.0 <= index <= 60.0:
            raise ValueError(
                f"mass={self.mass} at stature={self.stature} is a mass index of {index:.1f}, must be in [11, 60]"
            )

    def plain(self) -> dict[str, object]:
        """The fields as plain JSON values; those of `_LATER` only where they are not 0, as in older records."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: value for name, value in values.items() if name not in _LATER or value}


def sample_body(rng: np.random.Generator, child_share: float = 0.15, wardrobe: Wardrobe = "everyday") -> BodySpec:
    """Draws a dressed person; see `population` for the statistics.

    Args:
        rng: Source of randomness.
        child_share: Probability of a child of 4 to 17 years.
        wardrobe: "everyday", or "plain" for clothes that taper.
    """
    if not 0.0 <= child_share <= 1.0:
        raise ValueError(f"child_share={child_share} must be in [0, 1]")
    sex = "female" if rng.random() < 0.5 else "male"
    is_child = rng.random() < child_share
    age = float(rng.uniform(4.0, 18.0)) if is_child else float(18.0 + 62.0 * rng.beta(1.1, 1.6))
    stature, mass = draw_child(rng, sex, age) if is_child else draw_adult(rng, sex, age)
    spread = {
        name: float(np.clip(rng.standard_normal(), -2.2, 2.2)) for name in ("shoulders", "hips", "legs", "arms")
    }
    spread["head"] = float(np.clip(rng.standard_normal(), -2.0, 2.0))
    shape = {name: float(np.clip(0.45 * rng.standard_normal(), -1.0, 1.0)) for name in ("muscle", "bust", "belly")}
    manly = float(rng.beta(1.2, 12.0))
    values: dict[str, float] = {
        "stature": round(stature, 3),
        "mass": round(mass, 1),
        "sex": round(1.0 - manly if sex == "male" else manly, 3),
        "age": round(age, 1),
    }
    values |= {name: round(value, 3) for name, value in (spread | shape).items()}
    clothes = _sample_clothes(rng, sex)
    if wardrobe == "everyday":
        clothes |= _sample_everyday(rng, clothes)
    return BodySpec(**values, **clothes)  # type: ignore[arg-type]


def _sample_everyday(rng: np.random.Generator, clothes: dict[str, object]) -> dict[str, object]:
    """What replaces some of the plain clothes; shares are ours, widths cover those of two measured people."""
    changed: dict[str, object] = {}
    if clothes["bottom"] in ("trousers", "loose") or (clothes["bottom"] == "tight" and rng.random() < 0.4):
        is_wide = rng.random() < 0.25
        ease = rng.uniform(0.012, 0.026) if is_wide else rng.uniform(0.008, 0.02)
        hem = rng.uniform(0.19, 0.28) if is_wide else rng.uniform(0.14, 0.185)
        changed |= {"bottom": "wide" if is_wide else "straight"}
        changed |= {"bottom_ease": round(float(ease), 4), "hem_width": round(float(hem), 3)}
    if clothes["top"] in ("tight", "long_shirt") and rng.random() < 0.5:
        changed |= {"top": "pullover", "top_ease": round(float(rng.uniform(0.01, 0.03)), 4)}
    if changed.get("top", clothes["top"]) in ("pullover", "jacket"):
        changed |= {"slack": round(float(rng.uniform(0.0, 0.022)), 4)}
    if clothes["top"] == "jacket" and "hem_width" in changed and rng.random() < 0.4:
        changed |= {"bottom": "coat", "skirt_length": round(float(rng.uniform(0.55, 1.0)), 3)}
        changed |= {"skirt_flare": round(float(rng.uniform(0.02, 0.1)), 3)}
    return changed


def _sample_clothes(rng: np.random.Generator, sex: str) -> dict[str, object]:
    """Clothes, hair and shoes as one meets them indoors and in the street; shares are ours."""
    top = str(rng.choice(TOPS[:5], p=(0.0, 0.22, 0.36, 0.22, 0.20)))
    skirts = 0.26 if sex == "female" else 0.0
    shares = np.array([0.0, 0.28, 0.38, 0.16, 0.18, 0.0, 0.0]) * (1.0 - skirts)
    shares[5:] = (0.65 * skirts, 0.35 * skirts)
    bottom = str(rng.choice(BOTTOMS[:7], p=shares))
    ease = {"bare": (0.0, 0.0), "tight": (0.001, 0.004), "shirt": (0.006, 0.02), "long_shirt": (0.006, 0.022)}
    ease |= {
        "jacket": (0.015, 0.038),
        "trousers": (0.006, 0.014),
        "loose": (0.014, 0.028),
        "shorts": (0.008, 0.02),
    }
    ease |= {"skirt": (0.006, 0.02), "long_skirt": (0.008, 0.02)}
    hairs = (0.02, 0.20, 0.25, 0.40, 0.13) if sex == "female" else (0.14, 0.64, 0.14, 0.06, 0.02)
    hair = str(rng.choice(HAIRS, p=hairs))
    volume = {"bald": (0.0, 0.002), "short": (0.006, 0.022), "medium": (0.012, 0.035), "long": (0.01, 0.035)}
    volume |= {"bun": (0.006, 0.014)}
    shoes = str(rng.choice(SHOES, p=(0.12, 0.70, 0.18)))
    return {
        "top": top,
        "bottom": bottom,
        "top_ease": round(float(rng.uniform(*ease[top])), 4),
        "bottom_ease": round(float(rng.uniform(*ease[bottom])), 4),
        "skirt_length": round(float(rng.uniform(0.5, 1.0)), 3),
        "skirt_flare": round(float(rng.uniform(0.0, 0.14)), 3),
        "hair": hair,
        "hair_volume": round(float(rng.uniform(*volume[hair])), 4),
        "headwear": str(rng.choice(HEADWEARS, p=(0.80, 0.04, 0.06, 0.03, 0.07))),
        "shoes": shoes,
        "sole": 0.0 if shoes == "bare" else round(float(rng.uniform(0.015, 0.035)), 4),
        "fold_seed": int(rng.integers(1 << 31)),
    }
