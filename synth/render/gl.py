"""The second renderer: OpenGL by pyrender, without a window (EGL); the same images, for machines with a GPU."""

import os
from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synth.camera import Camera
from synth.geometry import LabelledMesh, transform_points
from synth.render.kernels import OBJECT_CODE
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

FAR = (DEPTH_MAX_MM + 0.49) / 1000.0
INSTALL_HINT = (
    "the pyrender back end needs the extra gl (pip install 'undergrowth[gl]') and EGL "
    "(Debian: apt-get install libegl1 libgl1-mesa-dri)"
)
T_OPENCV_OPENGL = np.diag((1.0, -1.0, -1.0, 1.0))

_offscreen: list[Any] = []
"""The one OffscreenRenderer of the process: once one is deleted, EGL fails for the next (EGL_BAD_DISPLAY)."""


def load_pyrender() -> ModuleType:
    """Imports pyrender for EGL, unless PYOPENGL_PLATFORM already names another platform.

    Raises:
        RuntimeError: pyrender or the EGL library is missing; the message says what to install.
    """
    os.environ.setdefault("PYOPENGL_PLATFORM", "egl")
    try:
        import pyrender
    except (ImportError, AttributeError, OSError) as error:
        raise RuntimeError(f"{INSTALL_HINT}: {error}") from error
    return pyrender


def offscreen_renderer(pyrender: ModuleType, width: int, height: int) -> Any:
    """The process's OffscreenRenderer, set to a size; made on the first call.

    Raises:
        RuntimeError: No EGL device gives a context.
    """
    if not _offscreen:
        try:
            _offscreen.append(pyrender.OffscreenRenderer(width, height))
        except Exception as error:  # PyOpenGL raises whatever it met: ImportError, GLError, AssertionError, ...
            reason = f"{type(error).__name__} {error}".strip()
            raise RuntimeError(f"no OpenGL context could be made; {INSTALL_HINT}: {reason}") from error
    _offscreen[0].viewport_width = width
    _offscreen[0].viewport_height = height
    return _offscreen[0]


class GLRenderer:
    """Draws scenes with one camera through OpenGL; same call and same images as the numba renderer.

    Where two surfaces are equally far, OpenGL's own order decides. One thread only, and not across a fork.
    Faces are drawn in flat colours that spell their label (pyrender's segmentation mode). That mode always
    culls back faces, so open meshes, and those that the near plane cuts, are drawn with both windings.

    Attributes:
        camera: Its intrinsics.
        near: Near plane [m].
        description: Names the device.
    """

    def __init__(self, camera: Camera, near: float = NEAR) -> None:
        check_near(near)
        self.camera = camera
        self.near = near
        self._pyrender = load_pyrender()
        offscreen_renderer(self._pyrender, camera.width, camera.height)
        from OpenGL.GL import GL_RENDERER, GL_VERSION, glGetString

        device, version = (glGetString(name).decode() for name in (GL_RENDERER, GL_VERSION))
        self.description = f"pyrender on {device}, OpenGL {version}"

    def render(
        self,
        T_camera_world: NDArray[np.float64],
        body: LabelledMesh | None,
        objects: Sequence[RenderObject] = (),
    ) -> RenderedPair:
        """Draws both layers of a scene, and each object alone to count its pixels.

        Args:
            T_camera_world: (4, 4).
            body: The person, world frame, faces labelled 1..31; None for a scene without one.
            objects: The objects.
        """
        return self._render(T_camera_world, body, objects, is_counted=True)

    def render_layers(
        self,
        T_camera_world: NDArray[np.float64],
        body: LabelledMesh | None,
        objects: Sequence[RenderObject] = (),
    ) -> RenderedPair:
        """As `render` without the passes that count: `object_pixels` is zero."""
        return self._render(T_camera_world, body, objects, is_counted=False)

    def _render(
        self,
        T_camera_world: NDArray[np.float64],
        body: LabelledMesh | None,
        objects: Sequence[RenderObject],
        is_counted: bool,
    ) -> RenderedPair:
        check_objects(objects)
        scene = self._empty_scene()
        colours: dict[Any, tuple[int, int, int]] = {}
        body_nodes = []
        if body is not None:
            check_body(body)
            T = np.asarray(T_camera_world, dtype=np.float64)
            body_nodes = self._add_parts(scene, body, T, colours)
        object_nodes = {}
        for item in objects:
            check_mesh(item.mesh, f"mesh of object {item.instance}")
            T = np.asarray(T_camera_world, dtype=np.float64) @ item.T_world_mesh
            node = self._add(scene, item.mesh, item.mesh.faces, T, OBJECT_CODE + item.instance, colours)
            if node is not None:
                object_nodes[item.instance] = node
        class_of_code = np.zeros(OBJECT_CODE + MAX_INSTANCES + 1, np.uint8)
        class_of_code[[OBJECT_CODE + item.instance for item in objects]] = [item.class_code for item in objects]

        depth, code = self._draw(scene, [*body_nodes, *object_nodes.values()], colours)
        body_depth, body_code = self._draw(scene, body_nodes, colours) if objects else (depth, code)
        object_pixels = np.zeros(1 + max((item.instance for item in objects), default=0), np.int64)
        if is_counted:
            for instance, node in object_nodes.items():
                object_pixels[instance] = np.count_nonzero(self._draw(scene, [node], colours)[1])
        return RenderedPair(
            depth,
            np.where(code <= OBJECT_CODE, code, 0).astype(np.uint8),
            class_of_code[code],
            np.maximum(code - OBJECT_CODE, 0).astype(np.uint8),
            body_depth.copy(),
            body_code.astype(np.uint8),
            object_pixels,
        )

    def _empty_scene(self) -> Any:
        camera = self.camera
        scene = self._pyrender.Scene(bg_color=(0.0, 0.0, 0.0, 1.0))
        # OpenGL puts pixel centres at half integers, this project at integers
        lens = self._pyrender.IntrinsicsCamera(
            camera.fx, camera.fy, camera.cx + 0.5, camera.cy + 0.5, znear=self.near, zfar=FAR
        )
        scene.add(lens, pose=T_OPENCV_OPENGL)
        return scene

    def _add_parts(
        self, scene: Any, body: LabelledMesh, T: NDArray[np.float64], colours: dict[Any, tuple[int, int, int]]
    ) -> list[Any]:
        """Adds one node a body part: segmentation mode colours nodes, not faces."""
        nodes = []
        for label in np.unique(body.face_label):
            nodes.append(self._add(scene, body, body.faces[body.face_label == label], T, int(label), colours))
        return [node for node in nodes if node is not None]

    def _add(
        self,
        scene: Any,
        mesh: LabelledMesh,
        faces: NDArray[np.int32],
        T_camera_mesh: NDArray[np.float64],
        code: int,
        colours: dict[Any, tuple[int, int, int]],
    ) -> Any:
        if not len(faces):
            return None
        vertices = transform_points(T_camera_mesh, mesh.vertices).astype(np.float32)
        if not mesh.is_closed or vertices[:, 2].min() < self.near:
            faces = np.concatenate([faces, faces[:, ::-1]])
        primitive = self._pyrender.Primitive(positions=vertices, indices=faces.astype(np.uint32), mode=4)
        node = scene.add(self._pyrender.Mesh(primitives=[primitive]))
        colours[node] = (code & 255, code >> 8, 0)
        return node

    def _draw(
        self, scene: Any, nodes: list[Any], colours: dict[Any, tuple[int, int, int]]
    ) -> tuple[NDArray[np.uint16], NDArray[np.int32]]:
        """Draws some of a scene's nodes: depth [mm] and label codes."""
        for node in colours:
            node.mesh.is_visible = node in nodes
        camera = self.camera
        device = offscreen_renderer(self._pyrender, camera.width, camera.height)
        colour, metres = device.render(scene, flags=self._pyrender.RenderFlags.SEG, seg_node_map=colours)
        code = colour[..., 0].astype(np.int32) | colour[..., 1].astype(np.int32) << 8
        depth = np.floor(metres.astype(np.float64) * 1000.0 + 0.5).astype(np.uint16)
        code[depth == 0] = 0
        depth[code == 0] = 0
        return depth, code
