"""Numba kernels of the z-buffer: projection, culling and filling of triangles; raw arrays only.

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
SMALL_WIDTH = 8
"""Triangles up to this many pixels wide test each pixel; wider ones compute the span of each row."""
CLIP_CORNERS = 9
"""A triangle cut by five planes has at most 8 corners; one more for safety."""

FAST = {"contract", "arcp", "nsz", "reassoc"}
"""LLVM's fast-math flags without nnan and ninf."""


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


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def project_vertices(
    vertices: NDArray[np.float32], T: NDArray[np.float64], view: View, work: Work
) -> tuple[int, int]:
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
        is_front = view.near <= Z
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
def select_faces(faces: NDArray[np.int32], is_culled: bool, width: int, height: int, work: Work) -> int:
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
        left = max(int((min(x0, x1, x2) + 255) >> 8), 0)
        right = min(int(max(x0, x1, x2) >> 8), width - 1)
        top = max(int((min(y0, y1, y2) + 255) >> 8), 0)
        bottom = min(int(max(y0, y1, y2) >> 8), height - 1)
        is_turned = (area < 0) | ((area > 0) & (not is_culled))
        work.kept[n_kept] = f
        n_kept += int(is_turned & (left <= right) & (top <= bottom))
    return n_kept


@njit(cache=True, nogil=True, error_model="numpy")
def split_faces(faces: NDArray[np.int32], work: Work) -> tuple[int, int]:
    """Takes out of `kept` the faces that must be clipped, and lists those in `cut`.

    Returns:
        Number of faces kept, number to clip.
    """
    n_kept = 0
    n_cut = 0
    for f in range(faces.shape[0]):
        q0, q1, q2 = work.q[faces[f, 0]], work.q[faces[f, 1]], work.q[faces[f, 2]]
        if min(q0, q1, q2) > 0.0:
            work.kept[n_kept] = f
            n_kept += 1
        elif q0 != 0.0 or q1 != 0.0 or q2 != 0.0:
            work.cut[n_cut] = f
            n_cut += 1
    return n_kept, n_cut


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def edge(xa: int, ya: int, xb: int, yb: int) -> tuple[int, int, int]:
    """Edge function of a side in whole pixels: a * px + b * py + c >= 0 inside, sides by the top-left rule.

    With corners in 1/256 px and p = 256 * pixel the exact test is 256 * (a px + b py) + c0 >= 0, or > 0 on
    right and bottom sides; a, b, px, py are integers, so c0 may be divided by 256 and floored.
    """
    a = ya - yb
    b = xb - xa
    is_in = (a > 0) | ((a == 0) & (b > 0))
    return a, b, (-(a * xa + b * ya) - (1 - int(is_in))) >> SUBPIXEL_BITS


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def fill_triangle(
    buffer: NDArray[np.int32],
    width: int,
    height: int,
    x0: int,
    y0: int,
    x1: int,
    y1: int,
    x2: int,
    y2: int,
    plane: tuple[float, float, float],
    q_low: float,
    q_high: float,
    code: int,
) -> None:
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
    left = max(int((min(x0, x1, x2) + 255) >> 8), 0)
    right = min(int(max(x0, x1, x2) >> 8), width - 1)
    top = max(int((min(y0, y1, y2) + 255) >> 8), 0)
    bottom = min(int(max(y0, y1, y2) >> 8), height - 1)
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
            q_here = q_start + q_v * y + q_u * left + 0.5
            base = y * width
            for x in range(left, right + 1):
                # no branch on the edges: it would be mispredicted in every other pixel
                q = min(max(np.int32(q_here), low), high)
                value = np.int32(np.int32(q << CODE_BITS) | code) if (e0 | e1 | e2) >= 0 else np.int32(0)
                index = np.uint64(base + x)
                buffer[index] = max(buffer[index], value)
                q_here += q_u
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
        q_first = np.float32(q_start + q_v * y + q_u * first + 0.5)
        base = y * width + first
        for step in range(last - first + 1):
            q = min(max(np.int32(q_first + slope * np.float32(np.int32(step))), low), high)
            index = np.uint64(base + step)
            buffer[index] = max(buffer[index], np.int32(np.int32(q << CODE_BITS) | code))


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST, inline="always")
def plane_through(
    u0: float, v0: float, q0: float, u1: float, v1: float, q1: float, u2: float, v2: float, q2: float
) -> tuple[float, float, float]:
    """Gives q as an affine function of the pixel: 1/z is affine in the image (q at (0, 0), dq/du, dq/dv)."""
    du1, dv1, dq1 = u1 - u0, v1 - v0, q1 - q0
    du2, dv2, dq2 = u2 - u0, v2 - v0, q2 - q0
    area = du1 * dv2 - du2 * dv1
    inverse = 1.0 / area if abs(area) > 1e-12 else 0.0
    q_u = (dq1 * dv2 - dq2 * dv1) * inverse
    q_v = (du1 * dq2 - du2 * dq1) * inverse
    return q0 - q_u * u0 - q_v * v0, q_u, q_v


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def fill_faces(
    buffer: NDArray[np.int32],
    faces: NDArray[np.int32],
    face_code: NDArray[np.int32],
    n_kept: int,
    width: int,
    height: int,
    work: Work,
) -> None:
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
        low, high = min(q0, q1, q2), max(q0, q1, q2)
        fill_triangle(buffer, width, height, x0, y0, x1, y1, x2, y2, plane, low, high, face_code[f])
