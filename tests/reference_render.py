"""Slow, obvious twins of the renderer: a rasterizer in plain Python, ray casting by Open3D, joints by masks."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from synth.camera import Camera
from synth.geometry import LabelledMesh, transform_points
from synth.render.labels import (
    DISC_MIN_PIXELS,
    IS_PART_OF_JOINT,
    JOINT_RADIUS,
    OCCLUDED_ABOVE,
    REACH,
    SELF_OCCLUDED_BELOW,
)
from synth.render.records import RenderedPair, RenderObject
from synth.vocabulary import JointState


class Layer(NamedTuple):
    """Images of one layer: depth [m], 0 where nothing; part; instance."""

    depth: np.ndarray
    part: np.ndarray
    instance: np.ndarray


def cast_rays(
    camera: Camera,
    near: float,
    T_camera_world: np.ndarray,
    body: LabelledMesh | None,
    objects: Sequence[RenderObject],
) -> Layer:
    """Casts one ray a pixel centre from the near plane on; both sides of all faces are seen."""
    meshes = [] if body is None else [(body, T_camera_world, 0)]
    meshes += [(item.mesh, T_camera_world @ item.T_world_mesh, item.instance) for item in objects]
    shape = (camera.height, camera.width)
    layer = Layer(np.zeros(shape), np.zeros(shape, np.uint8), np.zeros(shape, np.uint8))
    meshes = [entry for entry in meshes if len(entry[0].faces)]
    if not meshes:
        return layer
    first_vertex = np.cumsum([0, *(len(mesh.vertices) for mesh, _, _ in meshes)])
    vertices = np.concatenate([transform_points(T, mesh.vertices) for mesh, T, _ in meshes])
    faces = np.concatenate([mesh.faces + start for (mesh, _, _), start in zip(meshes, first_vertex, strict=False)])
    face_label = np.concatenate([np.where(instance, 0, mesh.face_label) for mesh, _, instance in meshes])
    face_instance = np.concatenate([np.full(len(mesh.faces), instance) for mesh, _, instance in meshes])
    soup = trimesh.Trimesh(vertices, faces, process=False, validate=False)
    v, u = np.mgrid[: camera.height, : camera.width]
    direction = camera.backproject(np.stack([u, v], axis=-1), np.ones(shape)).reshape(-1, 3)
    embree = RayMeshIntersector(soup, scale_to_box=False)
    face, ray, point = embree.intersects_id(
        near * direction, direction, multiple_hits=False, return_locations=True
    )
    layer.depth.reshape(-1)[ray] = point[:, 2]
    layer.part.reshape(-1)[ray] = face_label[face]
    layer.instance.reshape(-1)[ray] = face_instance[face]
    return layer


def is_away_from_edges(layer: Layer, jump: float = 0.2) -> np.ndarray:
    """Pixels whose 3x3 neighbourhood has one label, one object and no jump in depth [m]; border left out."""
    code = layer.part.astype(np.int64) + 256 * layer.instance.astype(np.int64)
    code[layer.depth == 0] = -1
    shifts = [(dy, dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1)]
    codes = np.stack([np.roll(code, shift, (0, 1)) for shift in shifts])
    depths = np.stack([np.roll(layer.depth, shift, (0, 1)) for shift in shifts])
    is_inside = (codes == code).all(axis=0) & (np.ptp(depths, axis=0) < jump)
    is_inside[[0, -1], :] = False
    is_inside[:, [0, -1]] = False
    return is_inside


def rasterize_slow(camera: Camera, mesh: LabelledMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Draws one mesh that lies wholly before the camera, by loops over triangles and pixels.

    Corners are snapped to 1/256 px; a pixel centre is covered if it lies inside all three sides or on a left
    or top one. Both sides of a face are seen.

    Returns:
        Depth [m], label, and how many faces cover the pixel with their front; all (height, width).
    """
    shape = (camera.height, camera.width)
    depth, label, n_fronts = np.full(shape, np.inf), np.zeros(shape, np.uint8), np.zeros(shape, np.int64)
    uv = camera.project(mesh.vertices)
    snapped = np.floor(uv * 256.0 + 0.5).astype(np.int64)
    for face, code in zip(mesh.faces, mesh.face_label, strict=True):
        corner, z = snapped[face], mesh.vertices[face, 2].astype(np.float64)
        area = _cross(corner[0], corner[1], corner[2])
        if area == 0:
            continue
        plane = np.linalg.lstsq(np.column_stack([uv[face], np.ones(3)]), 1.0 / z, rcond=None)[0]
        ordered = corner if area > 0 else corner[[0, 2, 1]]
        low, high = corner.min(axis=0), corner.max(axis=0)
        for y in range(max(low[1] // 256, 0), min(high[1] // 256 + 1, camera.height - 1) + 1):
            for x in range(max(low[0] // 256, 0), min(high[0] // 256 + 1, camera.width - 1) + 1):
                if all(_is_inside(ordered[i], ordered[(i + 1) % 3], (256 * x, 256 * y)) for i in range(3)):
                    inverse = np.clip(plane @ (x, y, 1.0), 1.0 / z.max(), 1.0 / z.min())
                    n_fronts[y, x] += area < 0
                    if 1.0 / inverse < depth[y, x]:
                        depth[y, x], label[y, x] = 1.0 / inverse, code
    depth[np.isinf(depth)] = 0.0
    return depth, label, n_fronts


def _cross(a: np.ndarray, b: np.ndarray, p: Sequence[int]) -> int:
    return (b[0] - a[0]) * (p[1] - a[1]) - (p[0] - a[0]) * (b[1] - a[1])


def _is_inside(a: np.ndarray, b: np.ndarray, p: Sequence[int]) -> bool:
    side = _cross(a, b, p)
    is_left_or_top = b[1] < a[1] or (b[1] == a[1] and b[0] > a[0])
    return side > 0 or (side == 0 and is_left_or_top)


def measure_joints_slow(
    pair: RenderedPair, joints: np.ndarray, camera: Camera, near: float
) -> tuple[np.ndarray, np.ndarray]:
    """(15,) states and visible fractions of joints, with masks over the whole image."""
    state, fraction = np.zeros(15, np.uint8), np.zeros(15)
    y, x = np.mgrid[: camera.height, : camera.width]
    for j, (joint, limb) in enumerate(zip(joints, JOINT_RADIUS, strict=True)):
        if joint[2] <= near:
            state[j] = JointState.OUTSIDE
            continue
        u, v = camera.project(joint)
        if not (-0.5 <= u < camera.width - 0.5 and -0.5 <= v < camera.height - 0.5):
            state[j] = JointState.OUTSIDE
            continue
        radius = max(limb * camera.fx / joint[2], DISC_MIN_PIXELS)
        is_body = ((x - u) ** 2 + (y - v) ** 2 <= radius**2) & (pair.body_part > 0)
        is_near = np.abs(pair.body_depth * 1e-3 - joint[2]) <= limb + REACH
        is_own = is_body & is_near & IS_PART_OF_JOINT[j][pair.body_part]
        if not is_own.any() or is_own.sum() < SELF_OCCLUDED_BELOW * is_body.sum():
            is_covered = (pair.occluder > 0)[is_body].sum() > OCCLUDED_ABOVE * is_body.sum()
            state[j] = JointState.OCCLUDED if is_covered else JointState.SELF_OCCLUDED
            continue
        fraction[j] = (pair.occluder == 0)[is_own].mean()
        state[j] = JointState.OCCLUDED if 1 - fraction[j] > OCCLUDED_ABOVE else JointState.VISIBLE
    return state, fraction
