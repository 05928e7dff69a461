"""Slow, obvious twins of the body kernels."""

import numpy as np
from scipy.spatial.transform import Rotation

from synth.bodies.body import Body
from synth.bodies.skeleton import DOFS, LINK_IDX, N_LINKS, Skeleton
from synth.geometry import inverse, rotation_about, translation


def link_transforms_slow(skeleton: Skeleton, angles: np.ndarray, T_world_root: np.ndarray) -> np.ndarray:
    """(n_links, 4, 4) by multiplying one translation and one rotation a hinge."""
    T = np.empty((N_LINKS, 4, 4))
    T[0] = T_world_root
    for i, dof in enumerate(DOFS):
        T[i + 1] = (
            T[LINK_IDX[dof.parent]] @ translation(*skeleton.offsets[i]) @ rotation_about(dof.axis, angles[i])
        )
    return T


def skin_slow(body: Body, angles: np.ndarray, T_world_root: np.ndarray, share: float) -> np.ndarray:
    """(n, 3) skin by one loop over vertices; share of dual quaternions, the rest linear."""
    posed = link_transforms_slow(body.skeleton, angles, T_world_root)
    bind = link_transforms_slow(body.skeleton, body.bind_angles, np.eye(4))
    M = [p @ inverse(b) for p, b in zip(posed, bind, strict=True)]
    real = [Rotation.from_matrix(m[:3, :3]) for m in M]
    out = []
    w = body.weights
    for v, point in enumerate(body.mesh.vertices.astype(np.float64)):
        own = range(w.indptr[v], w.indptr[v + 1])
        linear = sum(w.weight[e] * (M[w.link[e]][:3, :3] @ point + M[w.link[e]][:3, 3]) for e in own)
        q_sum, d_sum = np.zeros(4), np.zeros(4)
        first = real[w.link[w.indptr[v]]].as_quat()
        for e in own:
            q = real[w.link[e]].as_quat()  # x y z w
            t = M[w.link[e]][:3, 3]
            d = 0.5 * np.append(q[3] * t + np.cross(t, q[:3]), -t @ q[:3])
            sign = 1.0 if q @ first >= 0 else -1.0
            q_sum += w.weight[e] * sign * q
            d_sum += w.weight[e] * sign * d
        norm = np.linalg.norm(q_sum)
        q, d = q_sum / norm, d_sum / norm
        moved = 2 * (q[3] * d[:3] - d[3] * q[:3] + np.cross(q[:3], d[:3]))
        dual = Rotation.from_quat(q).apply(point) + moved
        out.append(share * dual + (1 - share) * linear)
    return np.array(out)
