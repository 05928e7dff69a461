"""Skinning: bends a body's bind-pose skin into a pose.

Each vertex is moved partly by linear and partly by dual-quaternion blending of the same weights (Kavan et
al. 2008, "Geometric skinning with approximate dual quaternion blending", ACM ToG 27(4)). Linear blending loses
volume at the inside of a bent joint, dual quaternions bulge at its outside; the errors have opposite signs.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.bodies.body import Body, Pose
from synth.bodies.rig.kinematics import link_transforms
from synth.bodies.skeleton import N_LINKS
from synth.geometry import LabelledMesh

DUAL_SHARE = 0.7
"""Share of the dual-quaternion position in a vertex; the rest is linear."""


@njit(cache=True, nogil=True)
def _quaternion(R: NDArray[np.float64], q: NDArray[np.float64]) -> None:
    """Unit quaternion (w, x, y, z) of a rotation, by the largest component (Shepperd 1978)."""
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    largest = 0
    if trace < max(R[0, 0], R[1, 1], R[2, 2]):
        largest = 1
        for k in range(1, 3):
            if R[k, k] > R[largest - 1, largest - 1]:
                largest = k + 1
    if largest == 0:
        s = 2.0 * np.sqrt(1.0 + trace)
        q[0] = 0.25 * s
        q[1] = (R[2, 1] - R[1, 2]) / s
        q[2] = (R[0, 2] - R[2, 0]) / s
        q[3] = (R[1, 0] - R[0, 1]) / s
        return
    i = largest - 1
    j = (i + 1) % 3
    k = (i + 2) % 3
    s = 2.0 * np.sqrt(1.0 + R[i, i] - R[j, j] - R[k, k])
    q[0] = (R[k, j] - R[j, k]) / s
    q[1 + i] = 0.25 * s
    q[1 + j] = (R[j, i] + R[i, j]) / s
    q[1 + k] = (R[k, i] + R[i, k]) / s


@njit(cache=True, nogil=True)
def link_motions(
    T_world_link: NDArray[np.float64], T_bind_link: NDArray[np.float64], motion: NDArray[np.float32]
) -> None:
    """How each link has moved since the bind pose, as a matrix and as a dual quaternion.

    Args:
        T_world_link: (n_links, 4, 4) in the pose.
        T_bind_link: (n_links, 4, 4) in the bind pose, root frame.
        motion: (n_links, 20) float32, overwritten: the (3, 4) matrix by rows, then the real part (w, x, y, z) and
            the dual part.
    """
    R = np.empty((3, 3))
    t = np.empty(3)
    q = np.empty(4)
    for link in range(T_world_link.shape[0]):
        posed = T_world_link[link]
        bind = T_bind_link[link]
        for row in range(3):
            t[row] = posed[row, 3]
            for col in range(3):
                # R = R_posed R_bind^T
                R[row, col] = (
                    posed[row, 0] * bind[col, 0] + posed[row, 1] * bind[col, 1] + posed[row, 2] * bind[col, 2]
                )
                t[row] -= R[row, col] * bind[col, 3]
        _quaternion(R, q)
        for row in range(3):
            for col in range(3):
                motion[link, 4 * row + col] = R[row, col]
            motion[link, 4 * row + 3] = t[row]
        for k in range(4):
            motion[link, 12 + k] = q[k]
        # dual part = 0.5 * (0, t) * q
        motion[link, 16] = -0.5 * (t[0] * q[1] + t[1] * q[2] + t[2] * q[3])
        motion[link, 17] = 0.5 * (t[0] * q[0] + t[1] * q[3] - t[2] * q[2])
        motion[link, 18] = 0.5 * (-t[0] * q[3] + t[1] * q[0] + t[2] * q[1])
        motion[link, 19] = 0.5 * (t[0] * q[2] - t[1] * q[1] + t[2] * q[0])


@njit(cache=True, nogil=True, fastmath={"contract", "arcp", "nsz", "reassoc"})
def skin_vertices(
    vertices: NDArray[np.float32],
    indptr: NDArray[np.int32],
    link: NDArray[np.int32],
    weight: NDArray[np.float32],
    motion: NDArray[np.float32],
    chosen: NDArray[np.int64],
    share: np.float32,
    out: NDArray[np.float32],
) -> None:
    """Moves the chosen vertices by their links.

    Args:
        vertices: (n, 3) bind pose.
        indptr: (n + 1,) CSR row starts.
        link: (n_weights,) link of a weight.
        weight: (n_weights,).
        motion: (n_links, 20) from `link_motions`.
        chosen: (m,) vertex indices; empty means all.
        share: Share of the dual quaternion.
        out: (m, 3), overwritten.
    """
    blend = np.empty(20, dtype=np.float32)
    for k in range(out.shape[0]):
        v = chosen[k] if chosen.shape[0] else k
        x = vertices[v, 0]
        y = vertices[v, 1]
        z = vertices[v, 2]
        start = indptr[v]
        first = link[start]
        if indptr[v + 1] - start == 1:
            for a in range(3):
                out[k, a] = (
                    motion[first, 4 * a] * x
                    + motion[first, 4 * a + 1] * y
                    + motion[first, 4 * a + 2] * z
                    + motion[first, 4 * a + 3]
                )
            continue
        for c in range(20):
            blend[c] = np.float32(0.0)
        for e in range(start, indptr[v + 1]):
            w = weight[e]
            j = link[e]
            dot = np.float32(0.0)
            for c in range(12, 16):
                dot += motion[j, c] * motion[first, c]
            signed = w if dot >= np.float32(0.0) else -w
            for c in range(12):
                blend[c] += w * motion[j, c]
            for c in range(12, 20):
                blend[c] += signed * motion[j, c]
        norm2 = np.float32(0.0)
        for c in range(12, 16):
            norm2 += blend[c] * blend[c]
        qw, qx, qy, qz = blend[12], blend[13], blend[14], blend[15]
        dw, dx, dy, dz = blend[16], blend[17], blend[18], blend[19]
        scale = np.float32(2.0) / norm2
        # rotated = p + 2 q x (q x p + w p); moved by 2 (w d - dw q + q x d), all over |q|^2.
        ax = qy * z - qz * y + qw * x + dx
        ay = qz * x - qx * z + qw * y + dy
        az = qx * y - qy * x + qw * z + dz
        bx = x + scale * (qy * az - qz * ay + qw * dx - dw * qx)
        by = y + scale * (qz * ax - qx * az + qw * dy - dw * qy)
        bz = z + scale * (qx * ay - qy * ax + qw * dz - dw * qz)
        rest = np.float32(1.0) - share
        out[k, 0] = share * bx + rest * (blend[0] * x + blend[1] * y + blend[2] * z + blend[3])
        out[k, 1] = share * by + rest * (blend[4] * x + blend[5] * y + blend[6] * z + blend[7])
        out[k, 2] = share * bz + rest * (blend[8] * x + blend[9] * y + blend[10] * z + blend[11])


ALL_VERTICES: NDArray[np.int64] = np.zeros(0, dtype=np.int64)


def pose_vertices(body: Body, pose: Pose, chosen: NDArray[np.int64] = ALL_VERTICES) -> NDArray[np.float32]:
    """Skins a body.

    Args:
        body: The person.
        pose: Angles and root.
        chosen: (m,) vertex indices to skin alone; all when empty.

    Returns:
        (n_vertices or m, 3) float32 world [m].
    """
    T_world_link = link_transforms(body.skeleton, pose.angles, pose.T_world_root)
    return skin_placed(body, T_world_link, chosen)


def skin_placed(
    body: Body, T_world_link: NDArray[np.float64], chosen: NDArray[np.int64] = ALL_VERTICES
) -> NDArray[np.float32]:
    """Skins a body whose links are placed already.

    Args:
        body: The person.
        T_world_link: (n_links, 4, 4) from `link_transforms`.
        chosen: (m,) vertex indices to skin alone; all when empty.

    Returns:
        (n_vertices or m, 3) float32 world [m].
    """
    T_bind_link = link_transforms(body.skeleton, body.bind_angles, np.eye(4))
    motion = np.empty((N_LINKS, 20), dtype=np.float32)
    link_motions(T_world_link, T_bind_link, motion)
    n_out = len(chosen) if len(chosen) else len(body.mesh.vertices)
    out = np.empty((n_out, 3), dtype=np.float32)
    weights = body.weights
    skin_vertices(
        body.mesh.vertices,
        weights.indptr,
        weights.link,
        weights.weight,
        motion,
        chosen,
        np.float32(DUAL_SHARE),
        out,
    )
    return out


def posed_mesh(body: Body, pose: Pose) -> LabelledMesh:
    """The body's labelled skin in a pose, world frame.

    Args:
        body: The person.
        pose: Angles and root.
    """
    mesh = body.mesh
    return LabelledMesh(pose_vertices(body, pose), mesh.faces, mesh.face_label, mesh.is_closed)
