"""What an import brings along; modules are counted, not seconds."""

import json
import subprocess
import sys

import pytest

SLOW = ("scipy.stats", "scipy.optimize", "cv2", "trimesh", "h5py", "OpenEXR", "tyro", "tqdm")
"""Libraries that most work does without."""


def loaded(statement):
    """Names of the modules that a fresh interpreter holds after a statement."""
    script = f"import json, sys; {statement}; print(json.dumps(sorted(sys.modules)))"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    return set(json.loads(run.stdout))


def test_reading_a_corpus_brings_neither_kernels_nor_scenes():
    modules = loaded("import pipelines.corpus")
    assert "pipelines.corpus.read" in modules
    assert modules.isdisjoint({*SLOW, "numba", "synth.scene", "synth.bodies", "synth.occluders", "synth.render"})


def test_forests_bring_neither_statistics_nor_pictures():
    assert loaded("import forests").isdisjoint(SLOW)


@pytest.mark.parametrize(
    "module", ["pipelines.metrics", "pipelines.metrics.document", "pipelines.metrics.offsets"]
)
def test_measures_bring_neither_statistics_nor_pictures(module):
    assert loaded(f"import {module}").isdisjoint({*SLOW, "scipy.special"})


@pytest.mark.parametrize("module", ["pipelines.recordings.frames", "pipelines.drawing.frames"])
def test_recordings_and_drawing_bring_no_libraries_but_that_of_pictures(module):
    assert loaded(f"import {module}").isdisjoint({*SLOW, "scipy.ndimage"} - {"cv2"})


def test_the_help_text_brings_no_library_at_all():
    modules = loaded("import pipelines.cli; pipelines.cli.usage()")
    assert modules.isdisjoint({*SLOW, "numpy", "numba"})


def test_asking_a_model_about_images_brings_neither_measures_nor_corpora():
    modules = loaded("import pipelines.commands.predict")
    assert modules.isdisjoint({"pipelines.metrics", "pipelines.corpus", "scipy.ndimage", "scipy.optimize"})


def test_commands_bring_no_engine_of_clusters():
    commands = ("generate", "train", "evaluate", "ablate")
    modules = loaded("; ".join(f"import pipelines.commands.{command}" for command in commands))
    assert modules.isdisjoint({"dask", "distributed", "fsspec"})
