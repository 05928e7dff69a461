"""Skinning: bends a body's bind-pose skin into a pose.

Each vertex is moved partly by linear and partly by dual-quaternion blending of the same weights (Kavan et
al. 2008, "Geometric skinning with approximate dual quaternion blending", ACM ToG 27(4)). Linear blending loses
volume at the inside of a bent joint, dual quaternions bulge at its outside; the errors have opposite signs.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.bodies.body import Body, Pose, kept_with_body
from synth.bodies.rig.kinematics import AXIS_IDX, AXIS_SIGN, link_transforms, place_links
from synth.bodies.rig.skinning_kernels import link_motions, skin_vertices
from synth.bodies.skeleton import N_LINKS, PARENT_LINK
from synth.geometry import LabelledMesh

DUAL_SHARE = 0.7
"""Share of the dual-quaternion position in a vertex; the rest is linear."""
_SHARE = np.float32(DUAL_SHARE)
ALL_VERTICES: NDArray[np.int64] = np.zeros(0, dtype=np.int64)


class Rig(NamedTuple):
    """What of a body does not depend on its pose, as the kernels take it.

    Attributes:
        offsets: (n_dofs, 3) of the hinges in their parents' frames [m].
        T_bind_link: (n_links, 4, 4) links in the bind pose, root frame.
        vertices: (n_vertices, 3) float32 skin in the bind pose, root frame [m].
        indptr: (n_vertices + 1,) CSR starts of the skin weights.
        link: (n_weights,) link of a weight.
        weight: (n_weights,) float32.
    """

    offsets: NDArray[np.float64]
    T_bind_link: NDArray[np.float64]
    vertices: NDArray[np.float32]
    indptr: NDArray[np.int32]
    link: NDArray[np.int32]
    weight: NDArray[np.float32]


@kept_with_body
def rig_of(body: Body) -> Rig:
    """The body's rig, made at the first call and kept as long as the body lives."""
    T_bind_link = link_transforms(body.skeleton, body.bind_angles, np.eye(4))
    weights = body.weights
    return Rig(
        body.skeleton.offsets, T_bind_link, body.mesh.vertices, weights.indptr, weights.link, weights.weight
    )


@njit(cache=True, nogil=True)
def place_rig(
    offsets: NDArray[np.float64],
    T_bind_link: NDArray[np.float64],
    angles: NDArray[np.float64],
    T_world_root: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
    """Places the links of a rig, as `link_transforms`, and tells how each has moved, as `link_motions`.

    Args:
        offsets: Of the rig.
        T_bind_link: Of the rig.
        angles: (n_dofs,) [rad].
        T_world_root: (4, 4).

    Returns:
        (n_links, 4, 4) T_world_link and (n_links, 20) float32 motions.
    """
    T_world_link = np.empty((N_LINKS, 4, 4))
    place_links(offsets, PARENT_LINK, AXIS_IDX, AXIS_SIGN, angles, T_world_root, T_world_link)
    motion = np.empty((N_LINKS, 20), dtype=np.float32)
    link_motions(T_world_link, T_bind_link, motion)
    return T_world_link, motion


@njit(cache=True, nogil=True)
def lowest_before(skin: NDArray[np.float32], front: float) -> float:
    """Smallest z of the points (n, 3) whose x is below `front`; +inf if there are none."""
    low = np.float32(np.inf)
    for k in range(skin.shape[0]):
        if skin[k, 0] < front:
            low = min(low, skin[k, 2])
    return float(low)


def pose_links(body: Body, angles: NDArray[np.float64], T_world_root: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n_links, 4, 4) T_world_link of angles (n_dofs,) [rad] and a root (4, 4): `link_transforms` without checks."""
    out = np.empty((N_LINKS, 4, 4))
    angles, T_world_root = np.ascontiguousarray(angles), np.ascontiguousarray(T_world_root)
    place_links(body.skeleton.offsets, PARENT_LINK, AXIS_IDX, AXIS_SIGN, angles, T_world_root, out)
    return out


def pose_skin(
    body: Body,
    angles: NDArray[np.float64],
    T_world_root: NDArray[np.float64],
    chosen: NDArray[np.int64] = ALL_VERTICES,
) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
    """Places a body's links and skins it.

    Args:
        body: The person.
        angles: (n_dofs,) float64 [rad].
        T_world_root: (4, 4) float64.
        chosen: (m,) vertex indices to skin alone; all when empty.

    Returns:
        (n_links, 4, 4) T_world_link and (n_vertices or m, 3) float32 skin, world [m].
    """
    rig = rig_of(body)
    T_world_link, motion = place_rig(
        rig.offsets, rig.T_bind_link, np.ascontiguousarray(angles), np.ascontiguousarray(T_world_root)
    )
    out = np.empty((len(chosen) if len(chosen) else len(rig.vertices), 3), dtype=np.float32)
    # Called from here alone: a copy compiled into another kernel may round in another order.
    skin_vertices(rig.vertices, rig.indptr, rig.link, rig.weight, motion, chosen, _SHARE, out)
    return T_world_link, out


def pose_vertices(body: Body, pose: Pose, chosen: NDArray[np.int64] = ALL_VERTICES) -> NDArray[np.float32]:
    """Skins a body.

    Args:
        body: The person.
        pose: Angles and root.
        chosen: (m,) vertex indices to skin alone; all when empty.

    Returns:
        (n_vertices or m, 3) float32 world [m].
    """
    return pose_skin(body, pose.angles, pose.T_world_root, chosen)[1]


def posed_mesh(body: Body, pose: Pose) -> LabelledMesh:
    """The body's labelled skin in a pose, world frame.

    Args:
        body: The person.
        pose: Angles and root.
    """
    mesh = body.mesh
    return LabelledMesh(pose_vertices(body, pose), mesh.faces, mesh.face_label, mesh.is_closed)
