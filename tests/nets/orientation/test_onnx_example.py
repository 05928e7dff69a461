"""The script that runs an exported net without this program answers what the program does."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch", reason="torch is not installed")
pytest.importorskip("onnxruntime", reason="onnxruntime is not installed")

from test_network import config_of, random_model

from forests.frames import Intrinsics
from nets.orientation.export import to_onnx
from nets.orientation.predict import OrientationPredictor

SCRIPT = Path(__file__).parents[3] / "examples" / "onnx" / "run_orientation.py"


def test_the_script_answers_what_the_program_does(tmp_path):
    model = random_model(config_of(region="body"))
    rng = np.random.default_rng(0)
    depth = np.zeros((96, 128), np.uint16)
    depth[10:90, 50:80] = 2500 + rng.integers(-150, 150, (80, 30))
    box = (50.0, 10.0, 80.0, 90.0)
    camera = Intrinsics(70.0, 70.0, 63.5, 47.5)  # coarse: no pixel of the patch covers two of the image
    ours = OrientationPredictor(model).predict(depth, camera, box)
    (tmp_path / "net.onnx").write_bytes(to_onnx(model))
    np.save(tmp_path / "depth.npy", depth)
    words = [str(SCRIPT), str(tmp_path / "net.onnx"), str(tmp_path / "depth.npy"), "70", "70", *map(str, box)]
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    theirs = json.loads(done.stdout)
    assert theirs["heading"] == pytest.approx(np.degrees(ours.angle), abs=0.01)
    assert theirs["kappa"] == pytest.approx(ours.concentration, rel=1e-3)
    assert theirs["posture"] == ours.posture
