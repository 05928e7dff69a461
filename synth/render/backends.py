"""Renderers by name."""

from collections.abc import Callable

from synth.camera import Camera
from synth.render.records import NEAR, Backend


def _numba(camera: Camera, near: float) -> Backend:
    from synth.render.rasterize import Renderer

    return Renderer(camera, near)


def _pyrender(camera: Camera, near: float) -> Backend:
    from synth.render.gl import GLRenderer

    return GLRenderer(camera, near)


RENDERERS: dict[str, Callable[[Camera, float], Backend]] = {"numba": _numba, "pyrender": _pyrender}
"""Back ends by name; pyrender is imported only when it is asked for."""


def renderer(name: str, camera: Camera, near: float = NEAR) -> Backend:
    """A renderer of one camera.

    Args:
        name: A key of `RENDERERS`.
        camera: Its intrinsics.
        near: Near plane [m].

    Raises:
        KeyError: No back end has that name; the message lists those that exist.
        RuntimeError: The back end's library or device is missing; the message says what to install.
    """
    if name not in RENDERERS:
        raise KeyError(f"unknown renderer {name!r}, known are: {', '.join(RENDERERS)}")
    return RENDERERS[name](camera, near)
