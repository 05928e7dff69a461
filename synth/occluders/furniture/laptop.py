"""Laptops: a keyboard deck and a screen on a hinge."""

from dataclasses import dataclass

import numpy as np

from synth.geometry import rotation_about, translation
from synth.occluders.kit.linkage import Joint, Linkage
from synth.occluders.kit.parts import joined, occluder
from synth.occluders.kit.shapes import box, cylinder, slab
from synth.occluders.kit.spec import Spec, choice, number, pick, uniform
from synth.occluders.model import Anchor, Occluder

INCH = 0.0254
KEY_PITCH = 0.019
"""Distance of key centres [m] (ISO 9241-410: 19 mm +- 1 mm)."""
ASPECT = {"16:9": 16 / 9, "16:10": 16 / 10, "3:2": 3 / 2}
NUMBER_PAD_WIDTH = 0.36
"""Laptops wider than this carry a number pad, which moves the letters to the left [m]."""


@dataclass(frozen=True)
class LaptopSpec(Spec):
    """A laptop; its deck lies on z = 0, its hinge is at +x.

    The outer size follows from the screen: its diagonal and aspect plus the bezels.

    Attributes:
        diagonal: Of the visible screen [m]; 11.6 to 17.3 inches on the market.
        aspect: "16:9", "16:10" or "3:2".
        bezel: Frame beside and above the screen [m].
        chin: Frame below the screen, hinge included [m].
        deck_thickness: Of the keyboard half [m].
        screen_thickness: Of the lid [m].
        corner: Radius of the outer corners [m].
        hinge_angle: Between deck and screen, 0 when shut [rad].
    """

    diagonal: float = number(0.25, 0.47)
    aspect: str = choice(*ASPECT)
    bezel: float = number(0.003, 0.03)
    chin: float = number(0.01, 0.05)
    deck_thickness: float = number(0.008, 0.04)
    screen_thickness: float = number(0.003, 0.015)
    corner: float = number(0.002, 0.025)
    hinge_angle: float = number(0.0, np.pi)

    @property
    def width(self) -> float:
        """Outer size along y [m]."""
        ratio = ASPECT[self.aspect]
        return self.diagonal * ratio / np.hypot(ratio, 1.0) + 2 * self.bezel

    @property
    def depth(self) -> float:
        """Outer size along x of the deck, and height of the lid [m]."""
        return self.diagonal / np.hypot(ASPECT[self.aspect], 1.0) + self.bezel + self.chin


def sample_laptop(rng: np.random.Generator) -> LaptopSpec:
    """Draws a laptop; screens lean back by 0 to 45 degrees, as a seated user sets them."""
    inches = (11.6, 12.4, 13.3, 13.5, 14.0, 15.6, 16.0, 17.3)
    return LaptopSpec(
        diagonal=round(INCH * float(rng.choice(inches)), 4),
        aspect=pick(rng, tuple(ASPECT), (0.55, 0.35, 0.1)),
        bezel=uniform(rng, 0.004, 0.016),
        chin=uniform(rng, 0.015, 0.035),
        deck_thickness=uniform(rng, 0.011, 0.026),
        screen_thickness=uniform(rng, 0.004, 0.009),
        corner=uniform(rng, 0.004, 0.014),
        hinge_angle=uniform(rng, np.deg2rad(88), np.deg2rad(135)),
    )


def laptop_linkage(spec: LaptopSpec) -> Linkage:
    """The laptop's two links and its hinge."""
    width, depth, thick = spec.width, spec.depth, spec.deck_thickness
    key_x, key_y = _letters(spec)
    key_width = min(15 * KEY_PITCH if key_y == 0 else 19 * KEY_PITCH, 0.94 * width)
    keys = [
        box(0.8 * KEY_PITCH, key_width, 0.002, 0.0008).at(key_x + row * KEY_PITCH, 0, thick + 0.0005)
        for row in (-2, -1, 0, 1, 2)
    ]
    pad = box(0.26 * depth, 0.3 * width, 0.001, 0.0).at(-0.33 * depth, key_y, thick + 0.0002)
    hinge = (depth / 2, 0.0, thick + 0.002)
    barrel = cylinder(0.004, 0.16 * width, 0.001).moved(rotation_about((1.0, 0.0, 0.0), np.pi / 2))
    barrels = [barrel.at(hinge[0] - 0.002, s * 0.3 * width, hinge[2] - 0.002) for s in (-1, 1)]
    deck = joined([slab(depth, width, thick, spec.corner, 0.003).at(0, 0, thick / 2), *keys, pad, *barrels])
    lid_thick = spec.screen_thickness
    lid = slab(depth, width, lid_thick, spec.corner, 0.002).at(-depth / 2, 0, lid_thick / 2)
    # At angle 0 the lid lies on the deck; a positive turn about +y lifts its far edge.
    joint = Joint("hinge", "revolute", "deck", "screen", hinge, (0.0, 1.0, 0.0), 0.0, np.pi, spec.hinge_angle)
    return Linkage("laptop", (("deck", deck), ("screen", lid)), (joint,))


def _letters(spec: LaptopSpec) -> tuple[float, float]:
    """X and y of the middle of the letter keys [m]; the keyboard's five rows end 35 mm before the hinge."""
    y = 1.9 * KEY_PITCH if spec.width > NUMBER_PAD_WIDTH else 0.0
    return 0.5 * spec.depth - 0.035 - 2.5 * KEY_PITCH, y


def make_laptop(spec: LaptopSpec) -> Occluder:
    """Builds the laptop.

    Anchors "keyboard_left" and "keyboard_right" lie under the four fingers of each hand in the home row, whose
    middle is three keys from the middle between F and J; "base" is the middle of the underside, its z upwards.
    """
    x, y = _letters(spec)
    z = spec.deck_thickness + 0.0015
    patch = (3 * KEY_PITCH, 4 * KEY_PITCH)
    anchors = (
        Anchor("base", np.eye(4), (spec.depth, spec.width)),
        Anchor("keyboard_left", translation(x, y + 3 * KEY_PITCH, z), patch),
        Anchor("keyboard_right", translation(x, y - 3 * KEY_PITCH, z), patch),
    )
    return occluder("laptop", laptop_linkage(spec).posed(), anchors)
