"""LifeModel: mixtures of Gaussians over the angles of recorded poses, by posture, and draws from them.

`tools/measure_poses.py` measures the shipped numbers on recorded motion capture. No recorded pose is part of them.
"""

import functools
import json
from dataclasses import dataclass
from importlib.resources import files
from io import BytesIO
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from synth.bodies.skeleton import DOF_IDX, DOFS, LOWER, MIRRORED_DOF, MIRRORED_SIGN, N_DOFS, UPPER
from synth.geometry import axis_angle

Array = NDArray[np.float64]
Posture = Literal["standing", "sitting"]
POSTURES: tuple[Posture, ...] = ("standing", "sitting")

_FREE = ("fingers_flexion", "fingertips_flexion", "thumb_flexion", "toes_extension")
"""Hinges that recordings do not tell, without the side."""
ANGLES: tuple[str, ...] = tuple(dof.name for dof in DOFS if not dof.name.endswith(_FREE))
"""Hinges that a model holds."""
ROOT_ANGLES = ("root_pitch", "root_roll", "root_yaw")
"""Leaning forward, leaning right, turning left."""
NAMES: tuple[str, ...] = (*ROOT_ANGLES, *ANGLES)
"""What a mixture is over, in order."""
N_ANGLES = len(NAMES)
_HINGES = np.array([DOF_IDX[name] for name in ANGLES])
_FIRST = len(ROOT_ANGLES)
N_FEET_STATES = 9
"""Left foot's state times 3, plus the right foot's (`FOOT_UP`, `FOOT_DOWN`, `FOOT_FLAT` of a pose library)."""


def _part(*beginnings: str) -> NDArray[np.int64]:
    return np.array([k for k, name in enumerate(NAMES) if name.startswith(beginnings)], dtype=np.int64)


_ARM = ("clavicle", "shoulder", "elbow", "forearm", "wrist")
ARMS = tuple(_part(*(f"{side}_{name}" for name in _ARM)) for side in "lr")
"""Places of the left and the right arm among `NAMES`."""
LEGS = tuple(_part(*(f"{side}_{name}" for name in ("hip", "knee", "ankle"))) for side in "lr")
"""Places of the left and the right leg among `NAMES`."""
HEAD = _part("neck", "head")
"""Places of neck and head among `NAMES`."""

OWN_ARMS_SHARE = 0.4
"""Share of the draws whose arms are those that go with the trunk and the legs. The others take one or both from
another draw: who bends or sits may do anything with the hands, and five people show only some of it."""
EVEN_ARMS_SHARE = 0.25
"""Share of the other draws whose arms mirror each other."""
OWN_HEAD_SHARE = 0.5
OWN_LEGS_SHARE = 0.5
"""Share of the seated draws whose legs go together; each leg of the others is drawn for itself."""
SPREAD = 1.0
"""Scale of the variation about the means; wider draws come near fewer poses of recordings that were left out."""


class Mixture(NamedTuple):
    """A mixture of Gaussians: a draw is mean + factor @ z + noise * e with standard normal z and e.

    Attributes:
        weight: (k,) share of the draws.
        mean: (k, n_angles) [rad].
        factor: (k, n_angles, rank) [rad].
        noise: (k, n_angles) [rad].
        feet: (k, 9) share of the poses by the state of the feet.
    """

    weight: Array
    mean: Array
    factor: Array
    noise: Array
    feet: Array

    def draw(self, rng: np.random.Generator, spread: float = SPREAD) -> tuple[Array, int]:
        """(n_angles,) angles [rad] and the state of the feet; mirrored in every other draw.

        Args:
            rng: Source of randomness.
            spread: Scale of the distance from the component's mean.
        """
        k = int(np.searchsorted(np.cumsum(self.weight), rng.random() * self.weight.sum(), side="right"))
        k = min(k, len(self.weight) - 1)
        varied = self.factor[k] @ rng.standard_normal(self.factor.shape[2])
        varied += self.noise[k] * rng.standard_normal(N_ANGLES)
        total = np.cumsum(self.feet[k])
        feet = int(np.searchsorted(total, rng.random() * total[-1], side="right"))
        angles = self.mean[k] + spread * varied
        return (mirrored(angles), mirrored_feet(feet)) if rng.random() < 0.5 else (angles, feet)


@dataclass(frozen=True)
class LifeDraw:
    """A pose out of the model; who places it puts the feet or the hips where they belong.

    Attributes:
        angles: (n_dofs,) within the limits; 0 where recordings tell nothing [rad].
        R_world_root: (3, 3) rotation of the root.
        feet: (left, right) states, as a pose library has them.
    """

    angles: Array
    R_world_root: Array
    feet: tuple[int, int]


@dataclass(frozen=True)
class LifeModel:
    """Mixtures by posture, and what they were measured on.

    Attributes:
        mixtures: By posture.
        source: Where the recordings come from.
        n_poses: Recorded poses by posture.
    """

    mixtures: dict[Posture, Mixture]
    source: str
    n_poses: dict[str, int]

    def draw(self, posture: Posture, rng: np.random.Generator, spread: float = SPREAD) -> LifeDraw:
        """Draws a pose.

        Args:
            posture: "standing" or "sitting".
            rng: Source of randomness.
            spread: Scale of the variation about typical poses.
        """
        mixture = self.mixtures[posture]
        angles, feet = mixture.draw(rng, spread)
        if rng.random() >= OWN_ARMS_SHARE:
            _take_arms(angles, mixture, rng, spread)
        if rng.random() >= OWN_HEAD_SHARE:
            angles[HEAD] = mixture.draw(rng, spread)[0][HEAD]
        if posture == "sitting" and rng.random() >= OWN_LEGS_SHARE:
            for leg in LEGS:
                angles[leg] = mixture.draw(rng, spread)[0][leg]
        return _drawn(angles, feet)


def _take_arms(angles: Array, mixture: Mixture, rng: np.random.Generator, spread: float) -> None:
    """Gives a pose one or both arms of others, or two that mirror each other."""
    other = mixture.draw(rng, spread)[0]
    kind = rng.random()
    if kind < EVEN_ARMS_SHARE:
        angles[ARMS[0]] = other[ARMS[0]]
        angles[ARMS[1]] = other[ARMS[0]]
        return
    angles[ARMS[0]] = other[ARMS[0]]
    if kind < 0.5 * (1.0 + EVEN_ARMS_SHARE):
        angles[ARMS[1]] = mixture.draw(rng, spread)[0][ARMS[1]]


def _drawn(angles: Array, feet: int) -> LifeDraw:
    full = np.zeros(N_DOFS)
    full[_HINGES] = np.clip(angles[_FIRST:], LOWER[_HINGES], UPPER[_HINGES])
    pitch, roll, yaw = angles[:_FIRST]
    R = axis_angle((0, 0, 1), yaw) @ axis_angle((0, 1, 0), pitch) @ axis_angle((1, 0, 0), roll)
    return LifeDraw(full, R, (feet // 3, feet % 3))


def vectors_of(angles: NDArray[np.floating], root: NDArray[np.floating]) -> Array:
    """What a model is over, of poses.

    Args:
        angles: (n, n_dofs) [rad].
        root: (n, 3, 3) rotation of the root.

    Returns:
        (n, n_angles) in the order of `NAMES` [rad].
    """
    R = np.asarray(root, dtype=np.float64)
    pitch = -np.arcsin(np.clip(R[:, 2, 0], -1.0, 1.0))
    roll = np.arctan2(R[:, 2, 1], R[:, 2, 2])
    yaw = np.arctan2(R[:, 1, 0], R[:, 0, 0])
    return np.concatenate(
        [np.stack([pitch, roll, yaw], axis=1), np.asarray(angles, np.float64)[:, _HINGES]], axis=1
    )


_AT = {int(hinge): k for k, hinge in enumerate(_HINGES)}
_OTHER = np.array([_FIRST + _AT[int(MIRRORED_DOF[hinge])] for hinge in _HINGES])
_SIGN = MIRRORED_SIGN[_HINGES]


def mirrored(angles: Array) -> Array:
    """(..., n_angles) the same with left and right swapped."""
    root = angles[..., :_FIRST] * (1.0, -1.0, -1.0)
    return np.concatenate([root, angles[..., _OTHER] * _SIGN], axis=-1)


def mirrored_feet(feet: int) -> int:
    """The state of the feet with left and right swapped."""
    return (feet % 3) * 3 + feet // 3


@functools.cache
def life_model() -> LifeModel:
    """The shipped model."""
    with np.load(BytesIO(files("synth.bodies").joinpath("data/life.npz").read_bytes())) as arrays:
        mixtures = {
            posture: Mixture(*(arrays[f"{posture}_{name}"].astype(np.float64) for name in Mixture._fields))
            for posture in POSTURES
        }
        about = json.loads(str(arrays["about"]))
    return LifeModel(mixtures, about["source"], about["n_poses"])
