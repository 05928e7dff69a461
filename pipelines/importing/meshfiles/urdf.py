"""Reads a URDF: its visual meshes and solids, its joints somewhere within their limits.

yourdfpy parses it. Not left to it are the meshes that it opens (it draws no line around a folder, and leaves out what
it does not find), limits that are not given (the specification says 0, it says nothing), joints that mimic a joint
that mimics another, axes that are not unit vectors, and capsules, which it refuses.
"""

import hashlib
import io
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from lxml import etree
from numpy.typing import NDArray

from pipelines.foreign import ForeignFileError
from pipelines.importing.meshfiles.joints import check_joint, child_frame, finite, origin, positions
from pipelines.importing.meshfiles.parts import FaceBudget, placed, together
from pipelines.importing.meshfiles.reach import Reach
from pipelines.importing.meshfiles.xmlfile import Element, local_name, read_xml
from synth.occluders.imported.shape import Triangles

if TYPE_CHECKING:
    from yourdfpy import Geometry, Joint, Robot, Visual

Array = NDArray[np.float64]
_MESH_NAME = re.compile(r"<\s*mesh\b[^>]*?\bfilename\s*=\s*(\"[^\"]*\"|'[^']*')", re.DOTALL)
_READ = {
    "robot": ("link", "joint"),
    "link": ("visual",),
    "visual": ("origin", "geometry"),
    "joint": ("parent", "child", "origin", "axis", "limit", "mimic"),
}
"""What counts of each element; damage elsewhere does no harm."""
_AROUND = 32
"""Corners around a cylinder or capsule."""
_ESCAPES = {"&amp;": "&", "&apos;": "'", "&quot;": '"', "&lt;": "<", "&gt;": ">"}


def part_names(path: Path) -> list[str]:
    """Names of all meshes that a URDF shows or collides with, as written; also of one that is damaged.

    Raises:
        OSError: It cannot be opened.
    """
    text = re.sub(r"<!--.*?-->", "", path.read_bytes().decode("utf-8", "replace"), flags=re.DOTALL)
    names = [found[1:-1] for found in _MESH_NAME.findall(text)]
    return [re.sub("&(amp|apos|quot|lt|gt);", lambda m: _ESCAPES[m[0]], name) for name in names]


def read_urdf(path: Path, reach: Reach, pose_key: str, read_part: Callable[[Path], Triangles]) -> Triangles:
    """What a URDF shows, in metres, z up.

    Args:
        path: The file.
        reach: Which of the meshes that it names may be opened.
        pose_key: Joints are set at random by this.
        read_part: Reads a mesh in metres.

    Raises:
        ValueError: It is damaged, or shows nothing.
        ForeignFileError: It names a mesh that is not there, may not be opened, or is damaged.
    """
    root = read_xml(path)
    if local_name(root) != "robot":
        raise ValueError(f"its root is <{local_name(root)}>, not <robot>")
    _check_no_macros(path, root)
    has_hull = root.find("link/collision") is not None
    _reduce(root)
    capsules = _take_capsules(root)
    robot = _parsed(root)
    frames = _link_frames([link.name for link in robot.links], robot.joints, pose_key)
    budget = FaceBudget()
    parts = []
    visuals = ((link.name, visual) for link in robot.links for visual in link.visuals)
    for (name, visual), is_capsule in zip(visuals, capsules, strict=True):
        part, T = _shape(path, visual, is_capsule, reach, read_part)
        budget.take(len(part.faces))
        parts.append(placed(part, frames[name] @ origin(visual) @ T))
    if not parts:
        raise ValueError("it shows nothing" + (": its links have only collision shapes" if has_hull else ""))
    return together(parts)


def _check_no_macros(path: Path, root: Element) -> None:
    for element in root.iter():
        words = [str(element.tag), *element.attrib.values(), *element.nsmap.values()]
        if any("ros.org/wiki/xacro" in word or "${" in word or "$(" in word for word in words):
            raise ForeignFileError(
                f"{path} holds xacro macros: write it as a URDF first (xacro in.xacro > out.urdf)"
            )


def _reduce(root: Element) -> None:
    """Takes away all that does not count, and names what has no name.

    Raises:
        ValueError: A visual has no geometry.
    """
    for element in [*root.iter(*_READ)]:
        for child in [*element]:
            if child.tag not in _READ[element.tag]:
                element.remove(child)
    for element in root.iter("robot", "link", "joint"):
        element.set("name", element.get("name", ""))
    for joint in root.iter("joint"):
        for end in ("parent", "child"):
            if joint.find(end) is None:
                etree.SubElement(joint, end, link="")  # told later, by the joint's name
    for limit in root.iter("limit"):
        for name in ("effort", "velocity"):
            limit.attrib.pop(name, None)
    for visual in root.iter("visual"):
        if visual.find("geometry/*") is None:
            raise ValueError("it has a visual without geometry")


def _take_capsules(root: Element) -> list[bool]:
    """Turns capsules into cylinders; tells of each visual whether it is one."""
    shapes = [visual.find("geometry/*") for link in root.findall("link") for visual in link.findall("visual")]
    capsules = [shape.tag == "capsule" for shape in shapes]
    for capsule in root.iter("capsule"):
        capsule.tag = "cylinder"
    return capsules


def _parsed(root: Element) -> "Robot":
    from yourdfpy import URDF

    try:
        robot = URDF.load(io.BytesIO(etree.tostring(root)), build_scene_graph=False, load_meshes=False).robot
    except (AttributeError, IndexError, KeyError, TypeError) as error:
        raise ValueError(f"something lacks what it must have: {error}") from None
    for joint in robot.joints:
        check_joint(joint)
    return robot


def _link_frames(links: list[str], joints: "list[Joint]", pose_key: str) -> dict[str, Array]:
    """(4, 4) of each link in the frame of the one that hangs on nothing."""
    by_parent: dict[str, list[Joint]] = {}
    children: set[str] = set()
    for joint in joints:
        for end in (joint.parent, joint.child):
            if end not in links:
                raise ValueError(f"joint {joint.name!r} names the link {end!r}, which is not there")
        if joint.child in children:
            raise ValueError(f"link {joint.child!r} hangs on two joints")
        children.add(joint.child)
        by_parent.setdefault(joint.parent, []).append(joint)
    roots = [name for name in links if name not in children]
    if len(roots) != 1:
        raise ValueError(f"{len(roots)} links hang on nothing, must be one: {', '.join(roots[:5]) or 'none does'}")
    digest = hashlib.sha256(pose_key.encode()).digest()
    rng = np.random.default_rng(int.from_bytes(digest[:8], "big"))
    at = positions({joint.name: joint for joint in joints}, rng)
    frames = {roots[0]: np.eye(4)}
    todo = [roots[0]]
    while todo:
        parent = todo.pop()
        for joint in by_parent.get(parent, []):
            frames[joint.child] = frames[parent] @ child_frame(joint, at[joint.name])
            todo.append(joint.child)
    if len(frames) < len(links):
        raise ValueError("its joints hang on one another in a circle")
    return frames


def _shape(
    path: Path, visual: "Visual", is_capsule: bool, reach: Reach, read_part: Callable[[Path], Triangles]
) -> tuple[Triangles, Array]:
    """What a visual shows, and its scale (4, 4)."""
    mesh = visual.geometry.mesh
    if mesh is None:
        return _solid(visual.geometry, is_capsule), np.eye(4)
    scale = 1.0 if mesh.scale is None else mesh.scale
    S = np.diag([*finite([scale] * 3 if isinstance(scale, float) else scale, 3, "a mesh's scale"), 1.0])
    return read_part(reach.open(path, mesh.filename or "")), S


def _solid(geometry: "Geometry", is_capsule: bool) -> Triangles:
    """A solid about the origin; cylinders and capsules are along z."""
    from trimesh import creation

    if geometry.box is not None:
        made = creation.box(finite(geometry.box.size, 3, "the size of a box"))
    elif geometry.sphere is not None:
        made = creation.icosphere(subdivisions=3, radius=float(finite([geometry.sphere.radius], 1, "a radius")[0]))
    else:
        radius, length = finite([geometry.cylinder.radius, geometry.cylinder.length], 2, "a cylinder")
        if is_capsule:
            made = creation.capsule(length, radius, (_AROUND // 2, _AROUND))
        else:
            made = creation.cylinder(radius, length, sections=_AROUND)
    return Triangles(np.asarray(made.vertices, np.float64), np.asarray(made.faces, np.int64))
