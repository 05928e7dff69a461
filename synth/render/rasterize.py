"""The default renderer: a z-buffer in numba on one core."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from synth.camera import Camera
from synth.geometry import LabelledMesh
from synth.render import draw, kernels, layers
from synth.render.records import (
    DEPTH_MAX_MM,
    MAX_INSTANCES,
    NEAR,
    RenderedPair,
    RenderObject,
    check_body,
    check_mesh,
    check_near,
    check_objects,
)

__all__ = ["NEAR", "RenderObject", "RenderedPair", "Renderer"]


class Renderer:
    """Draws scenes with one camera; holds the buffers, so keep one for many frames (and one a thread).

    Depth is exact to 1 mm up to 30 m (1/z has 22 bits; the rounding to millimetres is half of that). Pixel
    centres lie at integers and take the label of the nearest face there; on shared sides each pixel belongs
    to one face (top-left rule). Images do not depend on the order of meshes and faces: where two surfaces are
    equally far, the object wins over the person, the higher instance over the lower, the higher part label
    over the lower. Back faces of closed meshes are left out, but for those that the near plane cuts open.

    Attributes:
        camera: Its intrinsics.
        near: Near plane [m].
    """

    description: str = "numba z-buffer on the CPU, one core"

    def __init__(self, camera: Camera, near: float = NEAR) -> None:
        check_near(near)
        self.camera = camera
        self.near = near
        self._view = kernels.View(
            camera.width,
            camera.height,
            float(camera.fx),
            float(camera.fy),
            float(camera.cx),
            float(camera.cy),
            float(near),
        )
        n_pixels = camera.width * camera.height
        self._body = np.zeros(n_pixels, np.int32)
        self._composite = np.zeros(n_pixels, np.int32)
        self._alone = np.zeros(n_pixels, np.int32)
        self._whole = np.array([0, camera.width - 1, 0, camera.height - 1], np.int64)
        self._drawn = self._empty_bounds()
        self._work = kernels.allocate_work(1, 1)
        self._metres = near * kernels.INVERSE_DEPTH_MAX
        q_least = math.ceil(self._metres * 1000.0 / (DEPTH_MAX_MM + 0.49))
        self._least = np.int32(q_least << kernels.CODE_BITS)

    def render(
        self,
        T_camera_world: NDArray[np.float64],
        body: LabelledMesh | None,
        objects: Sequence[RenderObject] = (),
    ) -> RenderedPair:
        """Draws both layers of a scene.

        Args:
            T_camera_world: (4, 4).
            body: The person, world frame, faces labelled 1..31; None for a scene without one.
            objects: The objects.

        Returns:
            New arrays, not views of the buffers.
        """
        check_objects(objects)
        T_camera_world = np.asarray(T_camera_world, dtype=np.float64)
        self._box(self._body, self._drawn)[...] = 0
        self._box(self._composite, self._drawn)[...] = 0
        self._drawn = self._whole  # should an error end this half-way, all is cleared next time
        body_bounds = self._empty_bounds()
        if body is not None:
            check_body(body)
            body_bounds = self._draw(self._body, body, body.face_label.astype(np.int32), T_camera_world)
        self._box(self._composite, body_bounds)[...] = self._box(self._body, body_bounds)
        bounds = body_bounds
        object_pixels = np.zeros(1 + max((item.instance for item in objects), default=0), np.int64)
        class_of_instance = np.zeros(MAX_INSTANCES + 1, np.uint8)
        for item in objects:
            check_mesh(item.mesh, f"mesh of object {item.instance}")
            code = np.full(len(item.mesh.faces), kernels.OBJECT_CODE + item.instance, np.int32)
            drawn = self._draw(self._alone, item.mesh, code, T_camera_world @ item.T_world_mesh)
            object_pixels[item.instance] = layers.merge_object(
                self._composite, self._alone, self.camera.width, drawn, self._least
            )
            class_of_instance[item.instance] = item.class_code
            bounds = _union(bounds, drawn)
        self._drawn = bounds
        depth, part, occluder, instance = self._unpack(self._composite, bounds, class_of_instance)
        body_depth, body_part = self._unpack_body(body_bounds)
        return RenderedPair(depth, part, occluder, instance, body_depth, body_part, object_pixels)

    def depth_metres(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Composite and body-alone depth of the last scene before the rounding to millimetres.

        Returns:
            Two (height, width) float32 [m], 0 = nothing.
        """
        images = []
        for packed in (self._composite, self._body):
            depth = np.empty(packed.size, np.float32)
            layers.unpack_metres(packed, self._metres, self._least, depth)
            images.append(depth.reshape(self.camera.height, self.camera.width))
        return images[0], images[1]

    @staticmethod
    def _empty_bounds() -> NDArray[np.int64]:
        return np.array([0, -1, 0, -1], np.int64)

    def _box(self, buffer: NDArray[np.int32], bounds: NDArray[np.int64]) -> NDArray[np.int32]:
        """View of the part of a buffer that bounds enclose."""
        left, right, top, bottom = bounds.tolist()
        image = buffer.reshape(self.camera.height, self.camera.width)
        return image[top : max(bottom + 1, top), left : max(right + 1, left)]

    def _draw(
        self,
        buffer: NDArray[np.int32],
        mesh: LabelledMesh,
        face_code: NDArray[np.int32],
        T_camera_mesh: NDArray[np.float64],
    ) -> NDArray[np.int64]:
        n_vertices, n_faces = len(mesh.vertices), len(mesh.faces)
        if n_vertices > len(self._work.x) or n_faces > len(self._work.kept):
            self._work = kernels.allocate_work(
                max(n_vertices, len(self._work.x)), max(n_faces, len(self._work.kept))
            )
        draw.draw_mesh(
            buffer,
            np.ascontiguousarray(mesh.vertices, dtype=np.float32),
            np.ascontiguousarray(mesh.faces, dtype=np.int32),
            face_code,
            mesh.is_closed,
            np.ascontiguousarray(T_camera_mesh),
            self._view,
            self._work,
        )
        return self._work.bounds.copy()

    def _unpack(
        self, packed: NDArray[np.int32], bounds: NDArray[np.int64], class_of_instance: NDArray[np.uint8]
    ) -> tuple[NDArray[np.uint16], NDArray[np.uint8], NDArray[np.uint8], NDArray[np.uint8]]:
        shape = (self.camera.height, self.camera.width)
        depth = np.zeros(shape, np.uint16)
        part, occluder, instance = (np.zeros(shape, np.uint8) for _ in range(3))
        layers.unpack(
            packed,
            bounds,
            self.camera.width,
            self._metres * 1000.0,
            self._least,
            class_of_instance,
            depth.reshape(-1),
            part.reshape(-1),
            occluder.reshape(-1),
            instance.reshape(-1),
        )
        return depth, part, occluder, instance

    def _unpack_body(self, bounds: NDArray[np.int64]) -> tuple[NDArray[np.uint16], NDArray[np.uint8]]:
        shape = (self.camera.height, self.camera.width)
        depth, part = np.zeros(shape, np.uint16), np.zeros(shape, np.uint8)
        layers.unpack_body(
            self._body,
            bounds,
            self.camera.width,
            self._metres * 1000.0,
            self._least,
            depth.reshape(-1),
            part.reshape(-1),
        )
        return depth, part


def _union(a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.int64]:
    if b[1] < b[0] or b[3] < b[2]:
        return a
    if a[1] < a[0] or a[3] < a[2]:
        return b
    return np.array([min(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), max(a[3], b[3])], np.int64)
