"""Numba kernels of the z-buffer: projection, culling, clipping, filling and unpacking; raw arrays only.

A pixel is one int32: 1/z in 22 bits above a 9-bit label code, so that depth test and write are one integer
maximum, which does not depend on the order of the triangles. Equal depths go to the larger code. Codes:
0 nothing, 1..31 body part, 31 + n object number n.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

CODE_BITS = 9
CODE_MASK = (1 << CODE_BITS) - 1
OBJECT_CODE = 31
"""An object's code is its instance number (1..255) plus this."""
INVERSE_DEPTH_MAX = (1 << 22) - 2
"""The near plane's 1/z; one step is z**2 / (near * INVERSE_DEPTH_MAX): 24 um at 5 m, 95 um at 10 m."""
SUBPIXEL_BITS = 8
"""Vertices are snapped to 1/256 pixel (24.8 fixed point), so that the edge functions are exact integers."""
GUARD_PIXELS = 1 << 19
"""Triangles are clipped this far from the principal point, so that edge functions fit in int64."""
SMALL_WIDTH = 6
"""Triangles up to this many pixels wide test each pixel; wider ones compute the span of each row."""
CLIP_CORNERS = 9
"""A triangle cut by five planes has at most 8 corners; one more for safety."""

_FLAGS = {"contract", "arcp", "nsz", "reassoc"}


class View(NamedTuple):
    """Intrinsics of a pinhole camera with pixel centres at integers, and its near plane [m]."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    near: float


class Work(NamedTuple):
    """Scratch arrays, each long enough for the largest mesh.

    Attributes:
        x: (n_vertices,) int32 snapped u [1/256 px].
        y: (n_vertices,) int32 snapped v [1/256 px].
        u: (n_vertices,) float64 [px].
        v: (n_vertices,) float64 [px].
        q: (n_vertices,) float64 scaled 1/z; 0 behind the near plane, -1 before it but outside the guard band.
        kept: (n_faces,) int32 faces to fill.
        cut: (n_faces,) int32 faces to clip.
        polygon: (2, CLIP_CORNERS, 3) float64 corners while clipping, camera frame [m].
        bounds: (4,) int64 first and last column, first and last row that were drawn.
    """

    x: NDArray[np.int32]
    y: NDArray[np.int32]
    u: NDArray[np.float64]
    v: NDArray[np.float64]
    q: NDArray[np.float64]
    kept: NDArray[np.int32]
    cut: NDArray[np.int32]
    polygon: NDArray[np.float64]
    bounds: NDArray[np.int64]


def allocate_work(n_vertices: int, n_faces: int) -> Work:
    """Scratch arrays for meshes of up to so many vertices and faces."""
    return Work(
        np.empty(n_vertices, np.int32),
        np.empty(n_vertices, np.int32),
        np.empty(n_vertices, np.float64),
        np.empty(n_vertices, np.float64),
        np.empty(n_vertices, np.float64),
        np.empty(n_faces, np.int32),
        np.empty(n_faces, np.int32),
        np.empty((2, CLIP_CORNERS, 3), np.float64),
        np.empty(4, np.int64),
    )


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FLAGS)
def project_vertices(vertices, T, view, work):  # type: ignore[no-untyped-def]
    """Moves vertices to the camera frame, projects and snaps them.

    Args:
        vertices: (n, 3) float32, mesh frame [m].
        T: (4, 4) float64 T_camera_mesh.
        view: The camera.
        work: Receives x, y, u, v, q.

    Returns:
        Number of vertices before the near plane, and number that cannot be projected (behind, far aside).
    """
    n_front = 0
    n_invalid = 0
    scale = view.near * INVERSE_DEPTH_MAX
    for i in range(vertices.shape[0]):
        a, b, c = np.float64(vertices[i, 0]), np.float64(vertices[i, 1]), np.float64(vertices[i, 2])
        X = T[0, 0] * a + T[0, 1] * b + T[0, 2] * c + T[0, 3]
        Y = T[1, 0] * a + T[1, 1] * b + T[1, 2] * c + T[1, 3]
        Z = T[2, 0] * a + T[2, 1] * b + T[2, 2] * c + T[2, 3]
        inverse = 1.0 / max(Z, view.near)
        du = view.fx * X * inverse
        dv = view.fy * Y * inverse
        is_front = Z >= view.near
        is_inside = is_front and max(abs(du), abs(dv)) < GUARD_PIXELS
        n_front += is_front
        n_invalid += not is_inside
        u = du + view.cx if is_inside else 0.0
        v = dv + view.cy if is_inside else 0.0
        work.u[i] = u
        work.v[i] = v
        work.x[i] = np.int32(np.floor(u * 256.0 + 0.5))
        work.y[i] = np.int32(np.floor(v * 256.0 + 0.5))
        work.q[i] = scale * inverse if is_inside else (-1.0 if is_front else 0.0)
    return n_front, n_invalid


@njit(cache=True, nogil=True, error_model="numpy")
def select_faces(faces, is_culled, width, height, work):  # type: ignore[no-untyped-def]
    """Lists the faces whose box holds a pixel centre of the image and whose front is turned to the camera.

    Args:
        faces: (n, 3) int32, counter-clockwise from outside: with v downwards their area in pixels is negative.
        is_culled: Whether back faces are left out.
        width: Image width [px].
        height: Image height [px].
        work: Holds the projected vertices; receives `kept`.

    Returns:
        Number of faces kept.
    """
    n_kept = 0
    for f in range(faces.shape[0]):
        i, j, k = np.uint32(faces[f, 0]), np.uint32(faces[f, 1]), np.uint32(faces[f, 2])
        x0, x1, x2 = np.int64(work.x[i]), np.int64(work.x[j]), np.int64(work.x[k])
        y0, y1, y2 = np.int64(work.y[i]), np.int64(work.y[j]), np.int64(work.y[k])
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        left = max((min(x0, min(x1, x2)) + 255) >> 8, 0)
        right = min(max(x0, max(x1, x2)) >> 8, width - 1)
        top = max((min(y0, min(y1, y2)) + 255) >> 8, 0)
        bottom = min(max(y0, max(y1, y2)) >> 8, height - 1)
        is_turned = (area < 0) | ((area > 0) & (not is_culled))
        work.kept[n_kept] = f
        n_kept += np.int64(is_turned & (left <= right) & (top <= bottom))
    return n_kept


@njit(cache=True, nogil=True, error_model="numpy")
def split_faces(faces, work):  # type: ignore[no-untyped-def]
    """Takes out of `kept` the faces that must be clipped, and lists those in `cut`.

    Returns:
        Number of faces kept, number to clip.
    """
    n_kept = 0
    n_cut = 0
    for f in range(faces.shape[0]):
        q0, q1, q2 = work.q[faces[f, 0]], work.q[faces[f, 1]], work.q[faces[f, 2]]
        if min(q0, min(q1, q2)) > 0.0:
            work.kept[n_kept] = f
            n_kept += 1
        elif q0 != 0.0 or q1 != 0.0 or q2 != 0.0:
            work.cut[n_cut] = f
            n_cut += 1
    return n_kept, n_cut


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def edge(xa, ya, xb, yb):  # type: ignore[no-untyped-def]
    """Edge function of a side in whole pixels: a * px + b * py + c >= 0 inside, sides by the top-left rule.

    With corners in 1/256 px and p = 256 * pixel the exact test is 256 * (a px + b py) + c0 >= 0, or > 0 on
    right and bottom sides; a, b, px, py are integers, so c0 may be divided by 256 and floored.
    """
    a = ya - yb
    b = xb - xa
    is_in = (a > 0) | ((a == 0) & (b > 0))
    return a, b, (-(a * xa + b * ya) - (1 - np.int64(is_in))) >> SUBPIXEL_BITS


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FLAGS)
def fill_triangle(buffer, width, height, x0, y0, x1, y1, x2, y2, plane, q_low, q_high, code):  # type: ignore[no-untyped-def]
    """Fills one triangle of positive area.

    Args:
        buffer: (height * width,) int32 packed pixels.
        width: Image width [px].
        height: Image height [px].
        x0: Corners [1/256 px], int64; likewise y0 to y2.
        y0: See x0.
        x1: See x0.
        y1: See x0.
        x2: See x0.
        y2: See x0.
        plane: (q at pixel (0, 0), dq/du, dq/dv) float64.
        q_low: Least q of the corners; q is kept between the two.
        q_high: Greatest q of the corners.
        code: int32 label code.
    """
    left = max((min(x0, min(x1, x2)) + 255) >> 8, 0)
    right = min(max(x0, max(x1, x2)) >> 8, width - 1)
    top = max((min(y0, min(y1, y2)) + 255) >> 8, 0)
    bottom = min(max(y0, max(y1, y2)) >> 8, height - 1)
    a0, b0, c0 = edge(x0, y0, x1, y1)
    a1, b1, c1 = edge(x1, y1, x2, y2)
    a2, b2, c2 = edge(x2, y2, x0, y0)
    q_start, q_u, q_v = plane
    low, high = np.int32(q_low + 0.5), np.int32(q_high + 0.5)
    if right - left < SMALL_WIDTH:
        for y in range(top, bottom + 1):
            e0 = a0 * left + b0 * y + c0
            e1 = a1 * left + b1 * y + c1
            e2 = a2 * left + b2 * y + c2
            q_row = q_start + q_v * y + 0.5
            for x in range(left, right + 1):
                if (e0 | e1 | e2) >= 0:
                    q = min(max(np.int32(q_row + q_u * x), low), high)
                    index = np.uint64(y * width + x)
                    buffer[index] = max(buffer[index], np.int32(np.int32(q << CODE_BITS) | code))
                e0 += a0
                e1 += a1
                e2 += a2
        return
    slope = np.float32(q_u)
    for y in range(top, bottom + 1):
        first, last = left, right
        for a, e in ((a0, b0 * y + c0), (a1, b1 * y + c1), (a2, b2 * y + c2)):
            if a > 0:
                first = max(first, -(e // a))
            elif a < 0:
                last = min(last, e // -a)
            elif e < 0:
                last = first - 1
        q_row = np.float32(q_start + q_v * y + q_u * first + 0.5)
        base = y * width + first
        for step in range(last - first + 1):
            q = min(max(np.int32(q_row + slope * np.float32(np.int32(step))), low), high)
            index = np.uint64(base + step)
            buffer[index] = max(buffer[index], np.int32(np.int32(q << CODE_BITS) | code))


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FLAGS, inline="always")
def plane_through(u0, v0, q0, u1, v1, q1, u2, v2, q2):  # type: ignore[no-untyped-def]
    """q as an affine function of the pixel: 1/z is affine in the image (q at (0, 0), dq/du, dq/dv)."""
    du1, dv1, dq1 = u1 - u0, v1 - v0, q1 - q0
    du2, dv2, dq2 = u2 - u0, v2 - v0, q2 - q0
    area = du1 * dv2 - du2 * dv1
    inverse = 1.0 / area if abs(area) > 1e-12 else 0.0
    q_u = (dq1 * dv2 - dq2 * dv1) * inverse
    q_v = (du1 * dq2 - du2 * dq1) * inverse
    return q0 - q_u * u0 - q_v * v0, q_u, q_v


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FLAGS)
def fill_faces(buffer, faces, face_code, n_kept, width, height, work):  # type: ignore[no-untyped-def]
    """Fills the faces listed in `work.kept` whose corners are all projected.

    Args:
        buffer: (height * width,) int32 packed pixels.
        faces: (n, 3) int32.
        face_code: (n,) int32 label code a face.
        n_kept: Length of the list.
        width: Image width [px].
        height: Image height [px].
        work: Projected vertices and the list.
    """
    for index in range(n_kept):
        f = work.kept[index]
        i, j, k = np.uint32(faces[f, 0]), np.uint32(faces[f, 1]), np.uint32(faces[f, 2])
        x0, y0 = np.int64(work.x[i]), np.int64(work.y[i])
        area = (np.int64(work.x[j]) - x0) * (np.int64(work.y[k]) - y0)
        area -= (np.int64(work.x[k]) - x0) * (np.int64(work.y[j]) - y0)
        if area < 0:
            j, k = k, j
        q0, q1, q2 = work.q[i], work.q[j], work.q[k]
        plane = plane_through(
            work.u[i], work.v[i], q0, work.u[j], work.v[j], q1, work.u[k], work.v[k], q2
        )  # fmt: skip
        x1, y1 = np.int64(work.x[j]), np.int64(work.y[j])
        x2, y2 = np.int64(work.x[k]), np.int64(work.y[k])
        low, high = min(q0, min(q1, q2)), max(q0, max(q1, q2))
        fill_triangle(buffer, width, height, x0, y0, x1, y1, x2, y2, plane, low, high, face_code[f])


@njit(cache=True, nogil=True, error_model="numpy")
def clip_polygon(polygon, n_corners, view):  # type: ignore[no-untyped-def]
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
def fill_cut_faces(buffer, vertices, faces, face_code, T, view, n_cut, work):  # type: ignore[no-untyped-def]
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
            low, high = min(q[0], min(q[j], q[k])), max(q[0], max(q[j], q[k]))
            fill_triangle(
                buffer, view.width, view.height, x[0], y[0], x[j], y[j], x[k], y[k], plane, low, high, face_code[f]
            )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def draw_mesh(buffer, vertices, faces, face_code, is_closed, T, view, work):  # type: ignore[no-untyped-def]
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


@njit(cache=True, nogil=True, error_model="numpy")
def merge_object(composite, alone, width, bounds, least):  # type: ignore[no-untyped-def]
    """Puts an object's own buffer into the composite, and empties it.

    Args:
        composite: (height * width,) int32 packed pixels, changed.
        alone: (height * width,) int32 packed pixels of the object, zero again afterwards.
        width: Image width [px].
        bounds: (4,) int64 box of the object.
        least: Packed pixels below this are beyond the greatest depth.

    Returns:
        Number of pixels that the object covers alone.
    """
    n_pixels = 0
    n_columns = bounds[1] - bounds[0] + 1
    for row in range(bounds[2], bounds[3] + 1):
        base = row * width + bounds[0]
        for column in range(n_columns):
            index = np.uint64(base + column)
            value = alone[index]
            n_pixels += np.int64(value >= least)
            composite[index] = max(composite[index], value)
            alone[index] = 0
    return n_pixels


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FLAGS)
def unpack(packed, bounds, width, millimetres, least, class_of_instance, depth, part, occluder, instance):  # type: ignore[no-untyped-def]
    """Splits packed pixels into images; outputs start as zeros.

    Args:
        packed: (height * width,) int32.
        bounds: (4,) int64 box that holds all that was drawn.
        width: Image width [px].
        millimetres: Depth times q [mm].
        least: Packed pixels below this are beyond the greatest depth and stay 0.
        class_of_instance: (256,) uint8 class code of each object number.
        depth: (height * width,) uint16 [mm].
        part: (height * width,) uint8.
        occluder: (height * width,) uint8.
        instance: (height * width,) uint8.
    """
    n_columns = bounds[1] - bounds[0] + 1
    scale = np.float32(millimetres)
    for row in range(bounds[2], bounds[3] + 1):
        base = row * width + bounds[0]
        for column in range(n_columns):
            index = np.uint64(base + column)
            value = packed[index] if packed[index] >= least else np.int32(0)
            q = np.float32(np.int32(max(value >> CODE_BITS, 1)))
            depth[index] = np.uint16(np.int32(scale / q + np.float32(0.5))) if value > 0 else np.uint16(0)
            code = np.int32(value & CODE_MASK)
            part[index] = np.uint8(code if code <= OBJECT_CODE else 0)
            instance[index] = np.uint8(max(code - OBJECT_CODE, 0))
        for column in range(n_columns):
            index = np.uint64(base + column)
            occluder[index] = class_of_instance[instance[index]]


@njit(cache=True, nogil=True, error_model="numpy")
def unpack_metres(packed, metres, least, depth):  # type: ignore[no-untyped-def]
    """Depth of packed pixels as float32 [m], 0 where nothing.

    Args:
        packed: (n,) int32.
        metres: Depth times q [m].
        least: Packed pixels below this are beyond the greatest depth.
        depth: (n,) float32, receives the depth.
    """
    for i in range(packed.size):
        value = packed[i]
        depth[i] = np.float32(metres / (value >> CODE_BITS)) if value >= least else np.float32(0.0)
