"""Body and Pose: the records that shape, poses, kinematics and scenes share."""

import functools
import weakref
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from synth.bodies.skeleton import N_DOFS, Skeleton
from synth.bodies.spec import BodySpec
from synth.geometry import LabelledMesh

Value = TypeVar("Value")


@dataclass(frozen=True)
class Pose:
    """Joint angles and where the root stands; any source (sampler, mocap) can make one.

    Attributes:
        angles: (n_dofs,) float64 [rad], in the order of `DOFS`.
        T_world_root: (4, 4) float64.
        family: Name of the pose family it was drawn from.
        source_id: Identifier in the library it was taken from; empty if it was drawn.
    """

    angles: NDArray[np.float64]
    T_world_root: NDArray[np.float64]
    family: str = "custom"
    source_id: str = ""

    def __post_init__(self) -> None:
        if self.angles.shape != (N_DOFS,):
            raise ValueError(f"angles have shape {self.angles.shape}, must be ({N_DOFS},)")
        if self.T_world_root.shape != (4, 4):
            raise ValueError(f"T_world_root has shape {self.T_world_root.shape}, must be (4, 4)")


@dataclass(frozen=True)
class SkinWeights:
    """Which links move a vertex and how much, in CSR order; the weights of a vertex sum to 1.

    Attributes:
        indptr: (n_vertices + 1,) int32.
        link: (n_weights,) int32 link index (`LINK_IDX`).
        weight: (n_weights,) float32.
    """

    indptr: NDArray[np.int32]
    link: NDArray[np.int32]
    weight: NDArray[np.float32]


@dataclass(frozen=True)
class Body:
    """One person, ready to be posed.

    Attributes:
        spec: What it was made from.
        skeleton: Hinges with this person's lengths.
        mesh: Closed skin in the bind pose, root frame [m]; face_label holds body parts 1..31.
        bind_angles: (n_dofs,) float64, angles of the bind pose (arms and legs spread a little) [rad].
        weights: Skin weights.
    """

    spec: BodySpec
    skeleton: Skeleton
    mesh: LabelledMesh
    bind_angles: NDArray[np.float64]
    weights: SkinWeights


def kept_with_body(make: Callable[[Body], Value]) -> Callable[[Body], Value]:
    """Decorates a function of a body alone: it is called once a body, and its value kept as long as the body lives."""
    kept: dict[int, Value] = {}

    @functools.wraps(make)
    def value_of(body: Body) -> Value:
        key = id(body)
        if key not in kept:
            kept[key] = make(body)
            weakref.finalize(body, kept.pop, key, None)
        return kept[key]

    return value_of
