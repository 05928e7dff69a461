"""Articulated occluders as URDF with a mesh a link, for tools that read robots."""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

from synth.occluders.kit.linkage import Joint, Linkage
from synth.occluders.kit.parts import Part
from synth.occluders.kit.spec import Spec
from synth.occluders.registry import GENERATORS, kind_of

EFFORT = "10"
"""Effort and velocity limits that URDF asks of a joint with limits; nothing here reads them [N m, rad/s]."""


def linkage(spec: Spec) -> Linkage:
    """The links and joints of an articulated object.

    Raises:
        ValueError: The object has no joints; the message lists the kinds that have.
    """
    build = GENERATORS[kind_of(spec)].linkage
    if build is None:
        articulated = [kind for kind, g in GENERATORS.items() if g.linkage is not None]
        raise ValueError(f"{kind_of(spec)!r} has no joints, only {', '.join(articulated)} have")
    return build(spec)


def joint_values(spec: Spec) -> dict[str, float]:
    """The joints' values in the object that `make` builds, by joint name [rad or m]."""
    return {joint.name: joint.value for joint in linkage(spec).joints}


def write_urdf(spec: Spec, folder: Path) -> Path:
    """Writes an articulated object as NAME.urdf and meshes/NAME_LINK.obj.

    Args:
        spec: Of an articulated kind.
        folder: Made if it does not exist; files of the same names are overwritten.

    Returns:
        The URDF file's path.
    """
    tree = linkage(spec)
    meshes = Path(folder) / "meshes"
    meshes.mkdir(parents=True, exist_ok=True)
    robot = ET.Element("robot", name=tree.name)
    for name, part in tree.links:
        file_name = f"{tree.name}_{name}.obj"
        (meshes / file_name).write_text(_obj(part), encoding="utf-8")
        link = ET.SubElement(robot, "link", name=name)
        for role in ("visual", "collision"):
            geometry = ET.SubElement(ET.SubElement(link, role), "geometry")
            ET.SubElement(geometry, "mesh", filename=f"meshes/{file_name}")
    for joint in tree.joints:
        _add_joint(robot, joint)
    ET.indent(robot)
    path = Path(folder) / f"{tree.name}.urdf"
    path.write_text(ET.tostring(robot, encoding="unicode") + "\n", encoding="utf-8")
    return path


def _add_joint(robot: ET.Element, joint: Joint) -> None:
    element = ET.SubElement(robot, "joint", name=joint.name, type=joint.kind)
    ET.SubElement(element, "origin", xyz=_numbers(joint.origin), rpy="0 0 0")
    ET.SubElement(element, "parent", link=joint.parent)
    ET.SubElement(element, "child", link=joint.child)
    ET.SubElement(element, "axis", xyz=_numbers(joint.axis))
    if joint.kind in ("revolute", "prismatic"):
        lower, upper = repr(float(joint.lower)), repr(float(joint.upper))
        ET.SubElement(element, "limit", lower=lower, upper=upper, effort=EFFORT, velocity=EFFORT)


def _numbers(values: tuple[float, float, float]) -> str:
    return " ".join(repr(float(value)) for value in values)


def _obj(part: Part) -> str:
    """A Wavefront OBJ file's text; indices begin at 1."""
    vertices = "".join(f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in part.vertices)
    faces = "".join(f"f {a} {b} {c}\n" for a, b, c in (np.asarray(part.faces) + 1).tolist())
    return vertices + faces
