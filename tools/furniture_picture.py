"""Draws every model of an object library with its anchors marked, and its boxes beside it.

    python tools/furniture_picture.py LIBRARY OUT.jpg [--only NAME ...]

The user looks along the red axis, that is from the lower left into the picture; green is their left. Tops, seats
and undersides are drawn as outlines, keys as crosses.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from synth.camera import Camera
from synth.geometry import LabelledMesh, inverse, look_at, transform_points
from synth.occluders.meshlib import MeshModel, read_library
from synth.occluders.model import Anchor
from synth.render import backends
from synth.render.records import RenderObject

CAMERA = Camera(260, 240, 420.0, 420.0, 129.5, 119.5)
COLUMNS = 4
_CUBE = [
    (0, 1, 3), (0, 3, 2), (4, 7, 5), (4, 6, 7), (0, 5, 1), (0, 4, 5),
    (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
]  # fmt: skip


def boxes_mesh(boxes: NDArray[np.float64]) -> LabelledMesh:
    """Boxes (n, 6) as one mesh."""
    corners = np.stack(np.meshgrid([0, 3], [1, 4], [2, 5], indexing="ij"), axis=-1).reshape(8, 3)
    vertices = boxes[:, corners].reshape(-1, 3).astype(np.float32)
    faces = (np.array(_CUBE)[None] + 8 * np.arange(len(boxes))[:, None, None]).reshape(-1, 3).astype(np.int32)
    return LabelledMesh(vertices, faces, np.zeros(len(faces), np.uint8), is_closed=False)


def shaded(mesh: LabelledMesh, T_camera_world: NDArray[np.float64]) -> NDArray[np.uint8]:
    """(height, width, 3) shaded by the slope of the depth."""
    depth = backends.renderer("numba", CAMERA).render(T_camera_world, None, [RenderObject(mesh, 7, 1)]).depth
    smooth = cv2.GaussianBlur(depth.astype(np.float32), (3, 3), 0.0)
    dx, dy = cv2.Sobel(smooth, cv2.CV_32F, 1, 0) / 8.0, cv2.Sobel(smooth, cv2.CV_32F, 0, 1) / 8.0
    mm = np.median(depth[depth > 0]) / CAMERA.fx
    slope = np.sqrt(dx**2 + dy**2) / mm
    grey = 60.0 + 160.0 / np.sqrt(1.0 + slope**2) + 40.0 * np.clip(-dx / mm, -1.0, 1.0)
    return np.repeat(np.where(depth > 0, grey, 25.0)[..., None], 3, axis=2).clip(0, 255).astype(np.uint8)


def outline(anchor: Anchor) -> NDArray[np.float64]:
    """(n, 3) corners of an anchor's surface, object frame [m]."""
    if anchor.shape == "ellipse":
        angle = np.linspace(0.0, 2.0 * np.pi, 32)
        flat = np.column_stack([np.cos(angle), np.sin(angle)])
    else:
        flat = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    points = np.column_stack([0.5 * flat * np.array(anchor.size), np.zeros(len(flat))])
    return transform_points(anchor.T_object_anchor, points)


def picture(model: MeshModel) -> NDArray[np.uint8]:
    """(height, 2 width, 3) the model with its anchors, and its boxes."""
    low, high = model.vertices.min(axis=0), model.vertices.max(axis=0)
    middle = 0.5 * (low + high)
    reach = 2.2 * float(np.linalg.norm(high - low))
    T_camera_world = inverse(look_at(middle + reach * np.array([-0.75, -0.45, 0.5]), middle))

    def pixels(points: NDArray[np.float64]) -> NDArray[np.int32]:
        return np.rint(CAMERA.project(transform_points(T_camera_world, points))).astype(np.int32)

    left = shaded(model.occluder.mesh, T_camera_world)
    for anchor in model.anchors:
        cv2.polylines(left, [pixels(outline(anchor))], True, (60, 200, 255), 1, cv2.LINE_AA)
    length = 0.3 * float(max(high - low))
    for axis, colour in ((0, (80, 80, 255)), (1, (80, 220, 80))):
        ends = pixels(np.stack([middle * (1, 1, 0), middle * (1, 1, 0) + length * np.eye(3)[axis]]))
        cv2.arrowedLine(left, ends[0].tolist(), ends[1].tolist(), colour, 2, cv2.LINE_AA)
    lines = (f"{model.class_name} {model.name}", f"{model.role}, {model.split}")
    for k, line in enumerate(lines):
        cv2.putText(left, line, (3, 11 + 12 * k), cv2.FONT_HERSHEY_SIMPLEX, 0.36, (255, 255, 255), 1, cv2.LINE_AA)
    return np.hstack([left, shaded(boxes_mesh(model.boxes), T_camera_world)])


def main() -> None:
    """Writes the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("library", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", nargs="*", default=[])
    args = parser.parse_args()
    models = [m for m in read_library(args.library).models if not args.only or m.name in args.only]
    tiles = [picture(model) for model in models]
    tiles += [np.full_like(tiles[0], 25)] * (-len(tiles) % COLUMNS)
    cv2.imwrite(
        str(args.out), np.vstack([np.hstack(tiles[k : k + COLUMNS]) for k in range(0, len(tiles), COLUMNS)])
    )


if __name__ == "__main__":
    main()
