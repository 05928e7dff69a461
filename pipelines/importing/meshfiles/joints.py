"""Joints of a URDF: how they are linked, what they mimic, and where a seed sets them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipelines.importing.meshfiles.xmlfile import Element, numbers

Array = NDArray[np.float64]
_DRAWN = ("revolute", "prismatic", "continuous")
_KINDS = (*_DRAWN, "fixed", "floating", "planar")


@dataclass(frozen=True)
class Joint:
    """A joint.

    Attributes:
        name: Its name.
        kind: "revolute", "prismatic", "continuous", "fixed", "floating" or "planar".
        parent: Name of the link it hangs on.
        child: Name of the link that it moves.
        origin: (4, 4) its place in the parent's frame.
        axis: (3,) unit vector that it turns about or moves along.
        limits: Lowest and highest position [rad or m].
        mimics: Name of the joint whose position gives its own, with multiplier and offset; None if it has its own.
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: Array
    axis: Array
    limits: tuple[float, float]
    mimics: tuple[str, float, float] | None

    def at(self, position: float) -> Array:
        """(4, 4) the child's frame in the parent's at a position."""
        T = np.eye(4)
        if self.kind == "prismatic":
            T[:3, 3] = position * self.axis
        elif self.kind in ("revolute", "continuous"):
            x, y, z = self.axis
            K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
            T[:3, :3] += np.sin(position) * K + (1.0 - np.cos(position)) * K @ K
        return self.origin @ T


def read_joint(element: Element) -> Joint:
    """A <joint>; limits that are not given are 0, as the URDF specification says.

    Raises:
        ValueError: It is none.
    """
    name, kind = element.get("name", ""), element.get("type", "")
    if kind not in _KINDS:
        raise ValueError(f"joint {name!r} has type {kind!r}, known are {', '.join(_KINDS)}")
    ends = [element.find(end) for end in ("parent", "child")]
    parent, child = ("" if end is None else end.get("link", "") for end in ends)
    axis = np.array((1.0, 0.0, 0.0))
    if (found := element.find("axis")) is not None:
        axis = triple(found, "xyz", (1.0, 0.0, 0.0))
    length = float(np.linalg.norm(axis))
    if kind in _DRAWN and length == 0.0:
        raise ValueError(f"joint {name!r} has an axis without length")
    limit = element.find("limit")
    low, high = (0.0 if limit is None else number(limit, side, 0.0) for side in ("lower", "upper"))
    if kind in ("revolute", "prismatic") and low > high:
        raise ValueError(
            f"joint {name!r} has its lower limit {low:g} above its upper limit {high:g}; one that is not given is 0"
        )
    mimic = element.find("mimic")
    return Joint(
        name, kind, parent, child, origin_of(element), axis / (length or 1.0),
        (-np.pi, np.pi) if kind == "continuous" else (low, high),
        None if mimic is None
        else (mimic.get("joint", ""), number(mimic, "multiplier", 1.0), number(mimic, "offset", 0.0)),
    )  # fmt: skip


def positions(joints: Mapping[str, Joint], rng: np.random.Generator) -> dict[str, float]:
    """The position of every joint: drawn within its limits, or as the joint that it mimics.

    Floating and planar joints stay where their origin is.

    Raises:
        ValueError: A joint mimics one that is not there, or itself.
    """
    out: dict[str, float] = {}
    for joint in joints.values():
        if joint.mimics is None:
            out[joint.name] = float(rng.uniform(*joint.limits)) if joint.kind in _DRAWN else 0.0
    for joint in joints.values():
        chain = [joint]
        while chain[-1].mimics is not None:
            source = chain[-1].mimics[0]
            if source not in joints:
                raise ValueError(f"joint {chain[-1].name!r} mimics {source!r}, which is not there")
            if len(chain) > len(joints):
                raise ValueError(f"joint {joint.name!r} mimics itself")
            chain.append(joints[source])
        position = out[chain[-1].name]
        for link in reversed(chain[:-1]):
            assert link.mimics is not None
            position = link.mimics[1] * position + link.mimics[2]
        out[joint.name] = position
    return out


def origin_of(element: Element) -> Array:
    """(4, 4) of an element's <origin>, the identity if it has none; roll, pitch, yaw are about fixed axes."""
    T = np.eye(4)
    found = element.find("origin")
    if found is None:
        return T
    roll, pitch, yaw = triple(found, "rpy", (0.0, 0.0, 0.0))
    (a, b, c), (d, e, f) = (np.cos((roll, pitch, yaw)), np.sin((roll, pitch, yaw)))
    T[:3, :3] = np.array([
        [c * b, c * e * d - f * a, c * e * a + f * d],
        [f * b, f * e * d + c * a, f * e * a - c * d],
        [-e, b * d, b * a],
    ])  # fmt: skip
    T[:3, 3] = triple(found, "xyz", (0.0, 0.0, 0.0))
    return T


def triple(element: Element, name: str, default: tuple[float, float, float]) -> Array:
    """(3,) an attribute of three numbers.

    Raises:
        ValueError: It is none.
    """
    text = element.get(name)
    values = np.array(default if text is None else numbers(text))
    if values.shape != (3,) or not np.isfinite(values).all():
        raise ValueError(f"<{element.tag} {name}={text!r}> must hold three finite numbers")
    return values


def number(element: Element, name: str, default: float) -> float:
    """An attribute that is a number.

    Raises:
        ValueError: It is none.
    """
    text = element.get(name)
    try:
        value = default if text is None else float(text)
    except ValueError:
        value = float("nan")
    if not np.isfinite(value):
        raise ValueError(f"<{element.tag} {name}={text!r}> must be a finite number")
    return value
