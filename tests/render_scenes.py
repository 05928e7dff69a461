"""Random scenes for tests of the renderers: blobs as a person; closed, open and near-crossing objects."""

from typing import NamedTuple

import numpy as np
import trimesh

from synth.camera import Camera
from synth.geometry import LabelledMesh, inverse, look_at, rotation_about, translation
from synth.render.records import RenderObject

NEAR = 0.25


class RandomScene(NamedTuple):
    camera: Camera
    T_camera_world: np.ndarray
    body: LabelledMesh
    objects: list[RenderObject]


def labelled(mesh: trimesh.Trimesh, label: int | np.ndarray, is_closed: bool) -> LabelledMesh:
    face_label = np.broadcast_to(np.asarray(label, np.uint8), (len(mesh.faces),)).copy()
    return LabelledMesh(np.array(mesh.vertices, np.float32), np.array(mesh.faces, np.int32), face_label, is_closed)


def random_camera(rng: np.random.Generator) -> Camera:
    width, height = int(rng.integers(180, 330)), int(rng.integers(150, 250))
    fx = width * rng.uniform(0.6, 1.1)
    centre = (width / 2 + rng.uniform(-9, 9), height / 2 + rng.uniform(-9, 9))
    return Camera(width, height, fx, fx * rng.uniform(0.95, 1.05), *centre)


def random_turn(rng: np.random.Generator) -> np.ndarray:
    axis = rng.normal(size=3)
    return rotation_about(axis / np.linalg.norm(axis), rng.uniform(0, 2 * np.pi))


def random_person(rng: np.random.Generator) -> LabelledMesh:
    """Ellipsoids that overlap, each of two parts."""
    vertices, faces, labels = [], [], []
    for _ in range(8):
        ball = trimesh.creation.icosphere(subdivisions=int(rng.integers(1, 4)))
        ball.apply_transform(np.diag([*rng.uniform(0.05, 0.3, 3), 1.0]))
        ball.apply_transform(random_turn(rng))
        ball.apply_translation(rng.uniform((-0.3, -0.3, 0.2), (0.3, 0.3, 1.7)))
        two = rng.choice(np.arange(1, 32), 2, replace=False)
        labels.append(two[(ball.triangles_center[:, 2] > ball.centroid[2]).astype(int)])
        faces.append(ball.faces + sum(len(v) for v in vertices))
        vertices.append(ball.vertices)
    mesh = trimesh.Trimesh(np.concatenate(vertices), np.concatenate(faces), process=False)
    return labelled(mesh, np.concatenate(labels), is_closed=True)


def sheet(rng: np.random.Generator) -> trimesh.Trimesh:
    """An open, curved rectangle, or a flat one of two triangles."""
    n = int(rng.integers(2, 12))
    s, t = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n))
    bend = rng.uniform(0, 0.5)
    vertices = np.column_stack([s.ravel(), t.ravel(), bend * (s**2).ravel()]) * rng.uniform(0.1, 1.0)
    corner = np.arange(n * n).reshape(n, n)
    a, b, c, d = (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1])
    quads = np.stack([a, b, c, d], axis=-1).reshape(-1, 4)
    return trimesh.Trimesh(vertices, np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]]), process=False)


def random_object(rng: np.random.Generator, instance: int, eye: np.ndarray) -> RenderObject:
    kind = rng.choice(["box", "sheet", "dome", "rod", "floor"])
    if kind == "box":
        mesh, is_closed = labelled(trimesh.creation.box(rng.uniform(0.05, 0.8, 3)), 0, True), True
    elif kind == "rod":
        rod = trimesh.creation.cylinder(radius=rng.uniform(0.004, 0.04), height=rng.uniform(0.3, 2.0), sections=8)
        mesh, is_closed = labelled(rod, 0, True), True
    elif kind == "dome":
        ball = trimesh.creation.icosphere(subdivisions=2, radius=rng.uniform(0.1, 0.4))
        ball.update_faces(ball.triangles_center[:, 2] > 0)
        mesh, is_closed = labelled(ball, 0, False), False
    elif kind == "floor":
        quad = trimesh.Trimesh(
            4.0 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]), [[0, 1, 2], [0, 2, 3]]
        )
        mesh, is_closed = labelled(quad, 0, False), False
    else:
        mesh, is_closed = labelled(sheet(rng), 0, False), False
    if kind == "floor":
        T = translation(*rng.uniform(-0.5, 0.5, 2), rng.uniform(-0.3, 0.1))
    elif rng.random() < 0.3:  # about the camera, through its near plane
        T = translation(*(eye + rng.uniform(-0.6, 0.6, 3))) @ random_turn(rng)
    else:
        T = translation(*rng.uniform((-1, -1, 0), (1, 1, 1.6))) @ random_turn(rng)
    assert mesh.is_closed == is_closed
    return RenderObject(mesh, int(rng.integers(1, 8)), instance, T)


def random_scene(seed: int) -> RandomScene:
    rng = np.random.default_rng((seed, 20))
    angle, distance = rng.uniform(0, 2 * np.pi), rng.uniform(1.0, 5.0)
    eye = np.array([np.cos(angle) * distance, np.sin(angle) * distance, rng.uniform(0.3, 2.2)])
    T_world_camera = look_at(eye, (*rng.uniform(-0.2, 0.2, 2), rng.uniform(0.6, 1.2)), roll=rng.normal(0, 0.1))
    numbers = rng.choice(np.arange(1, 256), int(rng.integers(1, 7)), replace=False)
    objects = [random_object(rng, int(number), eye) for number in numbers]
    return RandomScene(random_camera(rng), inverse(T_world_camera), random_person(rng), objects)
