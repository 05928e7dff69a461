"""The pyrender back end: the numba renderer's images, repeated use, and errors that say what to install."""

import gc
import sys

import numpy as np
import pytest

from synth.render import gl
from synth.render.backends import renderer
from synth.render.rasterize import Renderer
from tests.render_scenes import NEAR, random_scene


@pytest.fixture(scope="module")
def _egl() -> None:
    try:
        gl.GLRenderer(random_scene(0).camera, NEAR)
    except RuntimeError as error:
        pytest.skip(str(error))


@pytest.mark.usefixtures("_egl")
@pytest.mark.parametrize("seed", range(200, 212))
def test_both_back_ends_give_the_same_frame(seed: int) -> None:
    scene = random_scene(seed)
    fast = Renderer(scene.camera, NEAR).render(scene.T_camera_world, scene.body, scene.objects)
    other = gl.GLRenderer(scene.camera, NEAR)
    slow = other.render(scene.T_camera_world, scene.body, scene.objects)
    for name in ("part", "occluder", "instance", "body_part"):
        a, b = getattr(fast, name), getattr(slow, name)
        assert a.dtype == b.dtype
        assert np.count_nonzero(a != b) <= 8, name
    for name in ("depth", "body_depth"):
        a, b = getattr(fast, name), getattr(slow, name)
        assert a.dtype == b.dtype
        assert np.count_nonzero(np.abs(a.astype(int) - b) > 1) <= 8, name
    assert fast.object_pixels.shape == slow.object_pixels.shape
    assert np.abs(fast.object_pixels - slow.object_pixels).max() <= 8
    pair = other.render_layers(scene.T_camera_world, scene.body, scene.objects)
    assert np.array_equal(pair.depth, slow.depth)
    assert np.array_equal(pair.part, slow.part)


@pytest.mark.usefixtures("_egl")
def test_a_renderer_can_follow_a_deleted_one() -> None:
    scene = random_scene(1)
    first = gl.GLRenderer(scene.camera, NEAR).render(scene.T_camera_world, scene.body, scene.objects)
    gc.collect()
    second = gl.GLRenderer(scene.camera, NEAR).render(scene.T_camera_world, scene.body, scene.objects)
    assert np.array_equal(first.depth, second.depth)


@pytest.mark.usefixtures("_egl")
def test_a_scene_without_anything_is_empty() -> None:
    scene = random_scene(1)
    pair = gl.GLRenderer(scene.camera, NEAR).render(scene.T_camera_world, None)
    assert not pair.depth.any()
    assert not pair.part.any()


@pytest.mark.usefixtures("_egl")
def test_descriptions_name_what_draws() -> None:
    camera = random_scene(0).camera
    assert renderer("numba", camera).description == "numba z-buffer on the CPU, one core"
    assert renderer("pyrender", camera).description.startswith("pyrender on ")


def test_a_missing_library_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyrender", None)
    with pytest.raises(RuntimeError, match=r"pip install 'undergrowth\[gl\]'.*libegl1"):
        renderer("pyrender", random_scene(0).camera)


def test_a_missing_device_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    class Broken:
        @staticmethod
        def OffscreenRenderer(width: int, height: int) -> None:
            raise AssertionError("eglInitialize")

    monkeypatch.setattr(gl, "_offscreen", [])
    with pytest.raises(
        RuntimeError, match=r"no OpenGL context could be made.*libegl1.*AssertionError eglInitialize"
    ):
        gl.offscreen_renderer(Broken, 8, 8)  # type: ignore[arg-type]
