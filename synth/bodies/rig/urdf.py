"""Writes a body as URDF: its hinges with limits, masses by segment, and a skin piece for each link."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from synth.bodies.body import Body
from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.skeleton import DOFS, LINK_IDX, N_LINKS

# Segment masses as shares of the body's, female and male [%], de Leva (1996), J. Biomech. 29(9), table 4. The
# links that a segment is spread over share its mass by the size of their skin.
_SEGMENT_MASS: tuple[tuple[tuple[str, ...], float, float], ...] = (
    (("neck_rotation", "head_rotation"), 6.68, 6.94),
    (("thorax_rotation", "l_clavicle_protraction", "r_clavicle_protraction"), 15.45, 15.96),
    (("lumbar_rotation",), 14.65, 16.33),
    (("root",), 12.47, 11.17),
)
_SIDED_MASS: tuple[tuple[tuple[str, ...], float, float], ...] = (
    (("shoulder_abduction", "shoulder_rotation"), 2.55, 2.71),
    (("elbow_flexion", "forearm_pronation"), 1.38, 1.62),
    (("wrist_deviation", "fingers_flexion", "fingertips_flexion", "thumb_flexion"), 0.56, 0.61),
    (("hip_abduction", "hip_rotation"), 14.78, 14.16),
    (("knee_flexion",), 4.81, 4.33),
    (("ankle_inversion", "toes_extension"), 1.29, 1.37),
)
BARE_LINK_MASS = 1e-3
"""Mass of a link without skin, inside a ball joint [kg]; simulators refuse 0."""
BARE_LINK_INERTIA = 1e-6
JOINT_VELOCITY = 10.0
"""Velocity limit of every hinge [rad/s]."""
# Largest torques [N m] of an adult by the hinge's first word, rough upper ends of published isokinetic strength.
_EFFORT = {
    "lumbar": 250.0, "thorax": 200.0, "neck": 40.0, "head": 30.0, "clavicle": 80.0, "shoulder": 90.0,
    "elbow": 80.0, "forearm": 15.0, "wrist": 15.0, "fingers": 10.0, "fingertips": 5.0, "thumb": 5.0,
    "hip": 250.0, "knee": 250.0, "ankle": 180.0, "toes": 20.0,
}  # fmt: skip


def link_name(index: int) -> str:
    """Name of a link in the file: "root", or its hinge's with "_link" behind."""
    return "root" if index == 0 else f"{DOFS[index - 1].name}_link"


def write_urdf(body: Body, folder: str | Path) -> Path:
    """Writes `body.urdf` and one OBJ a link that has skin.

    Args:
        body: The person.
        folder: Made if it is missing; files of the same names are replaced.

    Returns:
        Path of the URDF file.
    """
    folder = Path(folder)
    meshes = folder / "meshes"
    meshes.mkdir(parents=True, exist_ok=True)
    pieces = skin_pieces(body)
    masses = _masses(body, pieces)
    robot = ElementTree.Element("robot", name="person")
    for i in range(N_LINKS):
        robot.append(_link_element(i, pieces.get(i), masses[i]))
        if i in pieces:
            _write_obj(meshes / f"{link_name(i)}.obj", *pieces[i])
    for i, dof in enumerate(DOFS):
        robot.append(_joint_element(i, body.skeleton.offsets[i], dof.parent))
    ElementTree.indent(robot)
    path = folder / "body.urdf"
    ElementTree.ElementTree(robot).write(path, encoding="utf-8", xml_declaration=True)
    return path


def skin_pieces(body: Body) -> dict[int, tuple[NDArray[np.float64], NDArray[np.int64]]]:
    """Cuts the bind-pose skin up by the link that moves each face the most.

    Args:
        body: The person.

    Returns:
        Link index to (n, 3) vertices in the link's frame [m] and (m, 3) faces; every face is in one piece.
    """
    weights = body.weights
    n = len(body.mesh.vertices)
    share = np.zeros((n, N_LINKS))
    np.add.at(share, (np.repeat(np.arange(n), np.diff(weights.indptr)), weights.link), weights.weight)
    owner = share[body.mesh.faces].sum(axis=1).argmax(axis=1)
    T_root_link = link_transforms(body.skeleton, body.bind_angles, np.eye(4))
    pieces = {}
    for i in np.unique(owner):
        used, faces = np.unique(body.mesh.faces[owner == i], return_inverse=True)
        T = T_root_link[i]
        local = (body.mesh.vertices[used].astype(np.float64) - T[:3, 3]) @ T[:3, :3]
        pieces[int(i)] = (local, faces.reshape(-1, 3))
    return pieces


def _masses(body: Body, pieces: dict[int, tuple[NDArray, NDArray]]) -> NDArray[np.float64]:
    """(n_links,) masses [kg] that sum to the body's."""
    rows = list(_SEGMENT_MASS)
    for side in "lr":
        rows += [(tuple(f"{side}_{link}" for link in links), f, m) for links, f, m in _SIDED_MASS]
    shares = np.zeros(N_LINKS)
    for links, female, male in rows:
        skinned = [LINK_IDX[link] for link in links if LINK_IDX[link] in pieces]
        size = np.array([np.prod(np.ptp(pieces[i][0], axis=0)) for i in skinned])
        # A segment without a piece of skin of its own still weighs: its first link takes the mass.
        if not skinned:
            skinned, size = [LINK_IDX[links[0]]], np.ones(1)
        shares[skinned] += (female + (male - female) * float(body.spec.sex)) * size / size.sum()
    bare = shares == 0.0
    masses = shares / shares.sum() * (body.spec.mass - BARE_LINK_MASS * np.count_nonzero(bare))
    masses[bare] = BARE_LINK_MASS
    return masses


def _link_element(index: int, piece: tuple[NDArray, NDArray] | None, mass: float) -> ElementTree.Element:
    """A link with the inertia of a solid ellipsoid as large as its skin."""
    link = ElementTree.Element("link", name=link_name(index))
    inertial = ElementTree.SubElement(link, "inertial")
    centre, moments = np.zeros(3), np.full(3, BARE_LINK_INERTIA)
    if piece is not None:
        low, high = piece[0].min(axis=0), piece[0].max(axis=0)
        centre, half2 = 0.5 * (low + high), (0.5 * (high - low)) ** 2
        moments = np.maximum(mass / 5.0 * (half2.sum() - half2), BARE_LINK_INERTIA)
    ElementTree.SubElement(inertial, "origin", xyz=_numbers(centre), rpy="0 0 0")
    ElementTree.SubElement(inertial, "mass", value=repr(float(mass)))
    inertia = dict(zip(("ixx", "iyy", "izz"), (repr(float(value)) for value in moments), strict=True))
    ElementTree.SubElement(inertial, "inertia", inertia | {"ixy": "0", "ixz": "0", "iyz": "0"})
    if piece is not None:
        for kind in ("visual", "collision"):
            shape = ElementTree.SubElement(link, kind)
            ElementTree.SubElement(shape, "origin", xyz="0 0 0", rpy="0 0 0")
            geometry = ElementTree.SubElement(shape, "geometry")
            ElementTree.SubElement(geometry, "mesh", filename=f"meshes/{link_name(index)}.obj")
    return link


def _joint_element(index: int, offset: NDArray[np.float64], parent: str) -> ElementTree.Element:
    dof = DOFS[index]
    joint = ElementTree.Element("joint", name=dof.name, type="revolute")
    ElementTree.SubElement(joint, "origin", xyz=_numbers(offset), rpy="0 0 0")
    ElementTree.SubElement(joint, "parent", link=link_name(LINK_IDX[parent]))
    ElementTree.SubElement(joint, "child", link=link_name(index + 1))
    ElementTree.SubElement(joint, "axis", xyz=_numbers(dof.axis))
    effort = _EFFORT[dof.name.removeprefix("l_").removeprefix("r_").split("_")[0]]
    limits = {"lower": repr(float(dof.lower)), "upper": repr(float(dof.upper))}
    ElementTree.SubElement(joint, "limit", limits | {"effort": str(effort), "velocity": str(JOINT_VELOCITY)})
    return joint


def _numbers(values: NDArray[np.float64] | tuple[float, ...]) -> str:
    return " ".join(repr(float(value)) for value in values)


def _write_obj(path: Path, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in faces + 1]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
