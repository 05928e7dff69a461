"""Computer monitors on their foot."""

from dataclasses import dataclass

import numpy as np

from synth.geometry import rotation_about, translation
from synth.occluders.kit.bars import rod
from synth.occluders.kit.parts import occluder
from synth.occluders.kit.shapes import box, cylinder, slab
from synth.occluders.kit.spec import Spec, choice, number, pick, uniform
from synth.occluders.model import Anchor, Occluder

FEET = ("plate", "disc", "v")
ASPECT = {"16:9": 16 / 9, "16:10": 16 / 10, "21:9": 21 / 9}
INCH = 0.0254
_UPRIGHT = rotation_about((0.0, 1.0, 0.0), np.pi / 2)


@dataclass(frozen=True)
class MonitorSpec(Spec):
    """A monitor; its user sits at -x and sees the screen.

    Attributes:
        diagonal: Of the visible screen [m].
        aspect: "16:9", "16:10" or "21:9".
        bezel: Frame round the screen [m].
        thickness: Of the panel [m].
        gap: From what it stands on to the panel's lower edge [m].
        tilt: Of the screen's upper edge away from the user [rad].
        foot: "plate", "disc" or "v".
        foot_size: Width of the foot [m].
    """

    diagonal: float = number(0.35, 1.3)
    aspect: str = choice(*ASPECT)
    bezel: float = number(0.002, 0.04)
    thickness: float = number(0.01, 0.08)
    gap: float = number(0.02, 0.4)
    tilt: float = number(-0.2, 0.5)
    foot: str = choice(*FEET)
    foot_size: float = number(0.12, 0.5)

    @property
    def width(self) -> float:
        """Outer size along y [m]."""
        ratio = ASPECT[self.aspect]
        return self.diagonal * ratio / np.hypot(ratio, 1.0) + 2 * self.bezel

    @property
    def height(self) -> float:
        """Outer height of the panel [m]."""
        return self.diagonal / np.hypot(ASPECT[self.aspect], 1.0) + 2 * self.bezel


def sample_monitor(rng: np.random.Generator) -> MonitorSpec:
    """Draws a desktop monitor of 21.5 to 34 inches."""
    aspect = pick(rng, tuple(ASPECT), (0.7, 0.15, 0.15))
    inches = (29.0, 34.0) if aspect == "21:9" else (21.5, 23.8, 24.0, 27.0, 32.0)
    return MonitorSpec(
        diagonal=round(INCH * float(rng.choice(inches)), 4),
        aspect=aspect,
        bezel=uniform(rng, 0.005, 0.018),
        thickness=uniform(rng, 0.02, 0.045),
        gap=uniform(rng, 0.06, 0.16),
        tilt=uniform(rng, np.deg2rad(-2), np.deg2rad(15)),
        foot=pick(rng, FEET),
        foot_size=uniform(rng, 0.2, 0.28),
    )


def make_monitor(spec: MonitorSpec) -> Occluder:
    """Builds the monitor; anchor "base" is the middle of its foot's underside, z upwards."""
    z = spec.gap + spec.height / 2
    panel = slab(spec.height, spec.width, spec.thickness, 0.006, 0.003).moved(_UPRIGHT)
    hub = box(0.05, 0.12, 0.12, 0.008).at(spec.thickness / 2 + 0.025, 0, 0)
    lean = translation(0, 0, z) @ rotation_about((0.0, 1.0, 0.0), spec.tilt)
    x = spec.thickness / 2 + 0.045
    neck = box(0.024, 0.06, z, 0.004).at(x, 0, z / 2)
    size = spec.foot_size
    if spec.foot == "plate":
        foot = [slab(0.75 * size, size, 0.012, 0.02, 0.003).at(x - 0.1 * size, 0, 0.006)]
    elif spec.foot == "disc":
        foot = [cylinder(size / 2, 0.014, 0.004).at(x - 0.15 * size, 0, 0.007)]
    else:
        foot = [rod((x + 0.02, 0, 0.009), (x - 0.7 * size, s * 0.6 * size, 0.009), 0.009) for s in (-1, 1)]
    parts = [panel.moved(lean), hub.moved(lean), neck, *foot]
    return occluder("monitor", parts, (Anchor("base", np.eye(4), (0.75 * size, size)),))
