import importlib
import subprocess
import sys

import pytest

PACKAGES = ["synth", "synth.occluders", "synth.render.sensors", "synth.scene", "synth.scene.composed"]


@pytest.mark.parametrize("package", PACKAGES)
def test_every_exported_name_is_there(package: str) -> None:
    module = importlib.import_module(package)
    for name in module.__all__:
        assert getattr(module, name) is not None
        assert name in dir(module)


def test_everything_that_the_front_door_exports_is_documented() -> None:
    module = importlib.import_module("synth")
    for name in module.__all__:
        exported = getattr(module, name)
        assert not callable(exported) or exported.__doc__


def test_an_unknown_name_is_an_error_that_lists_the_known_ones() -> None:
    with pytest.raises(AttributeError, match=r"'synth' has no attribute 'Frames'; it offers .*FrameSource"):
        importlib.import_module("synth").Frames  # noqa: B018


@pytest.mark.parametrize("package", ["synth", "synth.scene.config", "synth.render.sensors"])
def test_names_and_settings_load_without_the_kernels(package: str) -> None:
    code = f"import sys, {package}; sys.exit('numba' in sys.modules or 'scipy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
