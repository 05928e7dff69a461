"""Kernels of skinning: how links have moved since the bind pose, and vertices that follow them."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


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
