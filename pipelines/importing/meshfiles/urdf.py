"""Reads a URDF: its visual meshes and solids, its joints somewhere within their limits."""

import hashlib
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipelines.foreign import ForeignFileError
from pipelines.importing.meshfiles.joints import Joint, number, origin_of, positions, read_joint, triple
from pipelines.importing.meshfiles.parts import FaceBudget, placed, together
from pipelines.importing.meshfiles.primitives import box, capsule, cylinder, sphere
from pipelines.importing.meshfiles.reach import Reach
from pipelines.importing.meshfiles.xmlfile import Element, local_name, read_xml
from synth.occluders.imported.shape import Triangles

Array = NDArray[np.float64]
_MESH_NAME = re.compile(r"<\s*mesh\b[^>]*?\bfilename\s*=\s*(\"[^\"]*\"|'[^']*')", re.DOTALL)
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
    links = {link.get("name", ""): link for link in root.findall("link")}
    joints = {joint.name: joint for joint in (read_joint(item) for item in root.findall("joint"))}
    frames = _link_frames(list(links), joints, pose_key)
    budget = FaceBudget()
    parts = []
    for name, link in links.items():
        for visual in link.findall("visual"):
            part, T = _shape(path, visual, reach, read_part)
            budget.take(len(part.faces))
            parts.append(placed(part, frames[name] @ origin_of(visual) @ T))
    if not parts:
        has_hull = root.find("link/collision") is not None
        raise ValueError("it shows nothing" + (": its links have only collision shapes" if has_hull else ""))
    return together(parts)


def _check_no_macros(path: Path, root: Element) -> None:
    for element in root.iter():
        words = [str(element.tag), *element.attrib.values()]
        if any("ros.org/wiki/xacro" in word or "${" in word or "$(" in word for word in words):
            raise ForeignFileError(
                f"{path} holds xacro macros: write it as a URDF first (xacro in.xacro > out.urdf)"
            )


def _link_frames(links: list[str], joints: dict[str, Joint], pose_key: str) -> dict[str, Array]:
    """(4, 4) of each link in the frame of the one that hangs on nothing."""
    by_parent: dict[str, list[Joint]] = {}
    children: set[str] = set()
    for joint in joints.values():
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
    at = positions(joints, np.random.default_rng(int.from_bytes(digest[:8], "big")))
    frames = {roots[0]: np.eye(4)}
    todo = [roots[0]]
    while todo:
        parent = todo.pop()
        for joint in by_parent.get(parent, []):
            frames[joint.child] = frames[parent] @ joint.at(at[joint.name])
            todo.append(joint.child)
    if len(frames) < len(links):
        raise ValueError("its joints hang on one another in a circle")
    return frames


def _shape(
    path: Path, visual: Element, reach: Reach, read_part: Callable[[Path], Triangles]
) -> tuple[Triangles, Array]:
    """What a <visual> shows, and its scale (4, 4)."""
    for shape in visual.findall("geometry/*"):
        kind = local_name(shape)
        if kind == "mesh":
            name = shape.get("filename", "")
            scale = (shape.get("scale") or "1 1 1").split()
            shape.set("scale", " ".join(scale * 3 if len(scale) == 1 else scale))
            S = np.diag([*triple(shape, "scale", (1.0, 1.0, 1.0)), 1.0])
            return read_part(reach.open(path, name)), S
        solids = dict(_solids(shape))
        if kind in solids:
            return solids[kind](), np.eye(4)
        raise ValueError(f"it shows a <{kind}>, which is not read")
    raise ValueError("it has a visual without geometry")


def _solids(shape: Element) -> Iterator[tuple[str, Callable[[], Triangles]]]:
    yield "box", lambda: box(triple(shape, "size", (0.0, 0.0, 0.0)))
    yield "cylinder", lambda: cylinder(number(shape, "radius", 0.0), number(shape, "length", 0.0))
    yield "capsule", lambda: capsule(number(shape, "radius", 0.0), number(shape, "length", 0.0))
    yield "sphere", lambda: sphere(number(shape, "radius", 0.0))
