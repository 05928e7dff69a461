"""Milliseconds a rendered pair on one core: the numba z-buffer against pyrender (EGL), interleaved in one run.

Run: python benchmarks/bench_render.py [--repeats 30]
"""

import argparse
import os
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from synth.camera import Camera
from synth.geometry import LabelledMesh, inverse, look_at, translation
from synth.render.gl import GLRenderer
from synth.render.labels import measure_visibility
from synth.render.rasterize import Renderer
from synth.render.records import RenderObject
from synth.vocabulary import OCCLUDER_CODE

CAMERA = Camera(512, 424, 365.0, 365.0, 255.5, 211.5, "kinect_v2")
DISTANCES = (1.2, 2.4, 4.0)
BLOBS = (  # part label, centre [m], radii [m]; x is forward, y the person's left
    (1, (0.0, 0.03, 1.66), (0.09, 0.06, 0.10)),
    (2, (0.0, -0.03, 1.66), (0.09, 0.06, 0.10)),
    (5, (0.0, 0.0, 1.50), (0.06, 0.06, 0.10)),
    (18, (0.0, 0.08, 1.27), (0.12, 0.13, 0.22)),
    (19, (0.0, -0.08, 1.27), (0.12, 0.13, 0.22)),
    (20, (0.0, 0.08, 1.00), (0.13, 0.13, 0.16)),
    (21, (0.0, -0.08, 1.00), (0.13, 0.13, 0.16)),
    (8, (0.0, 0.26, 1.30), (0.05, 0.05, 0.17)),
    (9, (0.0, -0.26, 1.30), (0.05, 0.05, 0.17)),
    (10, (0.12, 0.26, 1.08), (0.16, 0.04, 0.05)),
    (11, (0.12, -0.26, 1.08), (0.16, 0.04, 0.05)),
    (16, (0.32, 0.24, 1.08), (0.09, 0.05, 0.03)),
    (17, (0.32, -0.24, 1.08), (0.09, 0.05, 0.03)),
    (22, (0.0, 0.11, 0.70), (0.09, 0.08, 0.25)),
    (23, (0.0, -0.11, 0.70), (0.09, 0.08, 0.25)),
    (24, (0.0, 0.11, 0.28), (0.06, 0.06, 0.25)),
    (25, (0.0, -0.11, 0.28), (0.06, 0.06, 0.25)),
)


def make_person() -> LabelledMesh:
    """17 ellipsoids of 1280 triangles each."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    n_blobs, n_vertices = len(BLOBS), len(ball.vertices)
    vertices = np.concatenate([ball.vertices * np.array(radii) + np.array(c) for _, c, radii in BLOBS])
    faces = np.concatenate([ball.faces + i * n_vertices for i in range(n_blobs)])
    label = np.repeat(np.array([part for part, _, _ in BLOBS], np.uint8), len(ball.faces))
    return LabelledMesh(vertices.astype(np.float32), faces.astype(np.int32), label, is_closed=True)


def as_mesh(mesh: Any, is_closed: bool) -> LabelledMesh:
    """An object's mesh."""
    label = np.zeros(len(mesh.faces), np.uint8)
    return LabelledMesh(mesh.vertices.astype(np.float32), mesh.faces.astype(np.int32), label, is_closed)


def make_objects() -> list[RenderObject]:
    """A table, a finely meshed tube frame and an open canopy before the person, 5k triangles."""
    parts = [trimesh.creation.box((0.7, 1.2, 0.03), translation(0.0, 0.0, 0.73))]
    parts += [
        trimesh.creation.box((0.05, 0.05, 0.72), translation(x, y, 0.36))
        for x in (-0.3, 0.3)
        for y in (-0.55, 0.55)
    ]
    tube = trimesh.creation.torus(0.25, 0.02, major_sections=72, minor_sections=16)
    dome = trimesh.creation.icosphere(subdivisions=4, radius=0.25)
    dome.update_faces(dome.triangles_center[:, 2] > 0.0)
    return [
        RenderObject(
            as_mesh(trimesh.util.concatenate(parts), True), OCCLUDER_CODE["table"], 1, translation(0.6, 0, 0)
        ),
        RenderObject(as_mesh(tube, True), OCCLUDER_CODE["other"], 2, translation(0.6, 0.35, 0.8)),
        RenderObject(as_mesh(dome, False), OCCLUDER_CODE["stroller"], 3, translation(0.5, -0.5, 0.9)),
    ]


def camera_at(distance: float) -> NDArray[np.float64]:
    """T_camera_world of a camera before the person [m]."""
    return inverse(look_at((distance, 0.3, 1.3), (0.0, 0.0, 0.95)))


def timed(call: Callable[[], object]) -> float:
    """Milliseconds of one call."""
    start = time.perf_counter()
    call()
    return (time.perf_counter() - start) * 1e3


def peer(camera: Camera) -> GLRenderer | None:
    """The renderer that ours is held against, if this machine has it."""
    try:
        return GLRenderer(camera)
    except RuntimeError as error:
        print(f"no pyrender: {error}")
        return None


def keep_to_one_core() -> None:
    """Binds the process to one core where the system can: OpenGL in software takes all it finds."""
    if hasattr(os, "sched_setaffinity"):
        core = max(os.sched_getaffinity(0))
        os.sched_setaffinity(0, {core})
        print(f"all on core {core}")


def compare(
    fast: Renderer,
    slow: GLRenderer | None,
    T: NDArray[np.float64],
    body: LabelledMesh,
    objects: list[RenderObject],
    repeats: int,
) -> None:
    """Times both on one view, in turns, and prints the medians."""
    joints = np.tile(np.array((0.0, 0.0, 2.0)), (15, 1))
    pair = fast.render(T, body, objects)
    times: dict[str, list[float]] = {"numba": [], "labels": [], "pyrender": []}
    for _ in range(repeats):
        times["numba"] += [timed(lambda: fast.render(T, body, objects)) for _ in range(10)]
        times["labels"] += [timed(lambda: measure_visibility(pair, joints, CAMERA)) for _ in range(10)]
        if slow is not None:
            # two layers only, without the passes that count each object alone, which numba's time includes
            times["pyrender"].append(timed(lambda: slow.render_layers(T, body, objects)))
    medians = {name: float(np.median(values)) for name, values in times.items() if values}
    line = ", ".join(f"{name} {value:.2f} ms" for name, value in medians.items())
    n_pixels = np.count_nonzero(pair.body_part)
    print(f"person on {n_pixels / pair.body_part.size:.0%} of the image, medians of {repeats}: {line}")
    if slow is not None:
        print(f"    numba is {medians['pyrender'] / medians['numba']:.1f} times as fast as pyrender")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=30)
    repeats = parser.parse_args().repeats
    keep_to_one_core()
    body, objects = make_person(), make_objects()
    n_object_faces = sum(len(item.mesh.faces) for item in objects)
    print(f"body {len(body.faces)} triangles, objects {n_object_faces}, {CAMERA.width}x{CAMERA.height}")
    fast, slow = Renderer(CAMERA), peer(CAMERA)
    T = camera_at(DISTANCES[0])
    print(f"numba first call (compiles, or reads the cache) {timed(lambda: fast.render(T, body, objects)):.0f} ms")
    if slow is not None:
        print(slow.description)
        slow.render_layers(T, body, objects)
    for distance in DISTANCES:
        compare(fast, slow, camera_at(distance), body, objects, repeats)


if __name__ == "__main__":
    main()
