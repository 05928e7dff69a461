"""Numba kernels that draw a whole mesh into a packed buffer, clipping what crosses the near plane."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from synth.render.kernels import (
    CLIP_CORNERS,
    GUARD_PIXELS,
    INVERSE_DEPTH_MAX,
    View,
    Work,
    fill_faces,
    fill_triangle,
    plane_through,
    project_vertices,
    select_faces,
    split_faces,
)


@njit(cache=True, nogil=True, error_model="numpy")
def clip_polygon(polygon: NDArray[np.float64], n_corners: int, view: View) -> tuple[int, int]:
    """Cuts a convex polygon by the near plane and the guard band (Sutherland and Hodgman 1974).

    A side is always cut from its inner to its outer end, so that two faces share the point to the bit.

    Args:
        polygon: (2, CLIP_CORNERS, 3) float64, camera frame [m]; polygon[0] holds the corners.
        n_corners: Number of corners.
        view: The camera.

    Returns:
        Number of corners left, and which half of `polygon` holds them.
    """
    half = 0
    for plane in range(5):
        a, b, c, d = 0.0, 0.0, 1.0, -view.near
        if plane > 0:
            sign = 1.0 if plane % 2 else -1.0
            a = sign * view.fx if plane <= 2 else 0.0
            b = sign * view.fy if plane > 2 else 0.0
            c, d = float(GUARD_PIXELS), 0.0
        n_out = 0
        for i in range(n_corners):
            p = polygon[half, i]
            r = polygon[half, (i + 1) % n_corners]
            e = a * p[0] + b * p[1] + c * p[2] + d
            g = a * r[0] + b * r[1] + c * r[2] + d
            if e >= 0.0:
                polygon[1 - half, n_out] = p
                n_out += 1
            if (e >= 0.0) != (g >= 0.0):
                for axis in range(3):
                    if e >= 0.0:
                        polygon[1 - half, n_out, axis] = p[axis] + (r[axis] - p[axis]) * (e / (e - g))
                    else:
                        polygon[1 - half, n_out, axis] = r[axis] + (p[axis] - r[axis]) * (g / (g - e))
                n_out += 1
        n_corners = n_out
        half = 1 - half
    return n_corners, half


@njit(cache=True, nogil=True, error_model="numpy")
def fill_cut_faces(
    buffer: NDArray[np.int32],
    vertices: NDArray[np.float32],
    faces: NDArray[np.int32],
    face_code: NDArray[np.int32],
    T: NDArray[np.float64],
    view: View,
    n_cut: int,
    work: Work,
) -> None:
    """Clips the faces listed in `work.cut` and fills what is left of them, both sides.

    Args:
        buffer: (height * width,) int32 packed pixels.
        vertices: (n_vertices, 3) float32, mesh frame [m].
        faces: (n, 3) int32.
        face_code: (n,) int32 label code a face.
        T: (4, 4) float64 T_camera_mesh.
        view: The camera.
        n_cut: Length of the list.
        work: The list, and room for the polygon.
    """
    x, y = np.empty(CLIP_CORNERS, np.int64), np.empty(CLIP_CORNERS, np.int64)
    u, v, q = np.empty(CLIP_CORNERS), np.empty(CLIP_CORNERS), np.empty(CLIP_CORNERS)
    for index in range(n_cut):
        f = work.cut[index]
        for corner in range(3):
            p = vertices[faces[f, corner]]
            for axis in range(3):
                moved = T[axis, 0] * p[0] + T[axis, 1] * p[1] + T[axis, 2] * p[2] + T[axis, 3]
                work.polygon[0, corner, axis] = moved
        n_corners, half = clip_polygon(work.polygon, 3, view)
        for i in range(n_corners):
            corner_xyz = work.polygon[half, i]
            inverse = 1.0 / max(corner_xyz[2], view.near)
            u[i] = view.fx * corner_xyz[0] * inverse + view.cx
            v[i] = view.fy * corner_xyz[1] * inverse + view.cy
            q[i] = view.near * INVERSE_DEPTH_MAX * inverse
            x[i], y[i] = np.int64(np.floor(u[i] * 256.0 + 0.5)), np.int64(np.floor(v[i] * 256.0 + 0.5))
        for i in range(1, n_corners - 1):
            j, k = i, i + 1
            area = (x[j] - x[0]) * (y[k] - y[0]) - (x[k] - x[0]) * (y[j] - y[0])
            if area == 0:
                continue
            if area < 0:
                j, k = k, j
            plane = plane_through(u[0], v[0], q[0], u[j], v[j], q[j], u[k], v[k], q[k])
            low, high = min(q[0], q[j], q[k]), max(q[0], q[j], q[k])
            fill_triangle(
                buffer, view.width, view.height, x[0], y[0], x[j], y[j], x[k], y[k], plane, low, high, face_code[f]
            )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def draw_mesh(
    buffer: NDArray[np.int32],
    vertices: NDArray[np.float32],
    faces: NDArray[np.int32],
    face_code: NDArray[np.int32],
    is_closed: bool,
    T: NDArray[np.float64],
    view: View,
    work: Work,
) -> None:
    """Draws one mesh into a packed buffer; `work.bounds` receives the box of what may have been drawn.

    Back faces are left out only where the mesh is closed and lies wholly before the near plane: cut open by
    that plane it shows its inside.

    Args:
        buffer: (height * width,) int32 packed pixels.
        vertices: (n_vertices, 3) float32, mesh frame [m].
        faces: (n_faces, 3) int32.
        face_code: (n_faces,) int32 label code a face.
        is_closed: Whether the mesh bounds a volume.
        T: (4, 4) float64 T_camera_mesh.
        view: The camera.
        work: Scratch arrays.
    """
    n = vertices.shape[0]
    n_front, n_invalid = project_vertices(vertices, T, view, work)
    work.bounds[:] = (0, -1, 0, -1)
    if n_front == 0 or faces.shape[0] == 0:
        return
    if n_invalid == 0:
        low_x, high_x, low_y, high_y = work.x[0], work.x[0], work.y[0], work.y[0]
        for i in range(n):
            low_x, high_x = min(low_x, work.x[i]), max(high_x, work.x[i])
            low_y, high_y = min(low_y, work.y[i]), max(high_y, work.y[i])
        work.bounds[0], work.bounds[1] = max((low_x + 255) >> 8, 0), min(high_x >> 8, view.width - 1)
        work.bounds[2], work.bounds[3] = max((low_y + 255) >> 8, 0), min(high_y >> 8, view.height - 1)
        n_kept = select_faces(faces, is_closed, view.width, view.height, work)
        fill_faces(buffer, faces, face_code, n_kept, view.width, view.height, work)
        return
    work.bounds[:] = (0, view.width - 1, 0, view.height - 1)
    n_kept, n_cut = split_faces(faces, work)
    fill_faces(buffer, faces, face_code, n_kept, view.width, view.height, work)
    fill_cut_faces(buffer, vertices, faces, face_code, T, view, n_cut, work)
