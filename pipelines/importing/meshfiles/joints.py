"""Joints of a URDF as yourdfpy parses them: their limits, what they mimic, and where a seed sets them."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from yourdfpy import Joint

Array = NDArray[np.float64]
_DRAWN = ("revolute", "prismatic", "continuous")
_KINDS = (*_DRAWN, "fixed", "floating", "planar")


def check_joint(joint: "Joint") -> None:
    """Checks a joint.

    Raises:
        ValueError: Its type is unknown, its axis has no length, its limits exclude all, or a number is not finite.
    """
    name = joint.name
    if joint.type not in _KINDS:
        raise ValueError(f"joint {name!r} has type {joint.type or ''!r}, known are {', '.join(_KINDS)}")
    finite(joint.axis, 3, f"the axis of joint {name!r}")
    if joint.type in _DRAWN and not np.any(joint.axis):
        raise ValueError(f"joint {name!r} has an axis without length")
    low, high = limits(joint)
    finite([low], 1, f"the lower limit of joint {name!r}")
    finite([high], 1, f"the upper limit of joint {name!r}")
    if low > high:
        raise ValueError(
            f"joint {name!r} has its lower limit {low:g} above its upper limit {high:g}; one that is not given is 0"
        )
    if joint.mimic is not None:
        finite([joint.mimic.multiplier], 1, f"the multiplier of joint {name!r}")
        finite([joint.mimic.offset], 1, f"the offset of joint {name!r}")


def limits(joint: "Joint") -> tuple[float, float]:
    """Lowest and highest position [rad or m]; one that is not given is 0, as the URDF specification says."""
    if joint.type == "continuous":
        return -np.pi, np.pi
    if joint.type not in _DRAWN or joint.limit is None:
        return 0.0, 0.0
    return joint.limit.lower or 0.0, joint.limit.upper or 0.0


def positions(joints: Mapping[str, "Joint"], rng: np.random.Generator) -> dict[str, float]:
    """The position of every joint: drawn within its limits, or as the joint that it mimics.

    Floating and planar joints stay where their origin is.

    Raises:
        ValueError: A joint mimics one that is not there, or itself.
    """
    out: dict[str, float] = {}
    for joint in joints.values():
        if joint.mimic is None:
            out[joint.name] = float(rng.uniform(*limits(joint))) if joint.type in _DRAWN else 0.0
    for joint in joints.values():
        chain = [joint]
        while chain[-1].mimic is not None:
            source = chain[-1].mimic.joint
            if source not in joints:
                raise ValueError(f"joint {chain[-1].name!r} mimics {source!r}, which is not there")
            if len(chain) > len(joints):
                raise ValueError(f"joint {joint.name!r} mimics itself")
            chain.append(joints[source])
        position = out[chain[-1].name]
        for link in reversed(chain[:-1]):
            position = link.mimic.multiplier * position + link.mimic.offset
        out[joint.name] = position
    return out


def child_frame(joint: "Joint", position: float) -> Array:
    """(4, 4) the child's frame in the parent's at a position.

    Raises:
        ValueError: The joint's origin is not finite.
    """
    from trimesh import transformations

    T = np.eye(4)
    if joint.type == "prismatic":
        T[:3, 3] = position * np.asarray(joint.axis) / np.linalg.norm(joint.axis)
    elif joint.type in ("revolute", "continuous"):
        T = transformations.rotation_matrix(position, joint.axis)
    return origin(joint) @ T


def origin(placed: Any) -> Array:
    """(4, 4) where a joint or visual is, the identity if it does not say.

    Raises:
        ValueError: It is not finite.
    """
    if placed.origin is None:
        return np.eye(4)
    return finite(placed.origin, 16, "an origin").reshape(4, 4)


def finite(values: Any, n: int, what: str) -> Array:
    """N numbers as an array, shaped as they are.

    Raises:
        ValueError: There are more or fewer, or one is not finite.
    """
    array = np.asarray(values, dtype=np.float64)
    if array.size != n or not np.isfinite(array).all():
        wanted = "be a finite number" if n == 1 else f"hold {'three' if n == 3 else n} finite numbers"
        raise ValueError(f"{what} must {wanted}, not {' '.join(f'{x:g}' for x in array.ravel()[:20])}")
    return array
