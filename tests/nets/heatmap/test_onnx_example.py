"""The script that runs an exported net without this program finds the joints that the program does."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch", reason="torch is not installed")
pytest.importorskip("onnxruntime", reason="onnxruntime is not installed")

from forests.frames import Intrinsics
from nets.heatmap.config import HeatmapConfig
from nets.heatmap.export import to_onnx
from nets.heatmap.model import N_TERMS, OUTCOMES, HeatmapModel
from nets.heatmap.network import Names, net_of
from nets.heatmap.predict import HeatmapPredictor
from nets.modules import to_arrays

SCRIPT = Path(__file__).parents[3] / "examples" / "onnx" / "run_heatmap.py"
JOINTS = ("head", "r_hand", "l_hand")


@pytest.mark.parametrize("cost", ["cross_entropy", "mse"])
def test_the_script_finds_what_the_program_does(tmp_path, cost):
    config = HeatmapConfig((8, 8, 8), (1, 1, 1), cost)
    weights = to_arrays(net_of(config, Names(len(JOINTS))))
    for name in ("heat", "depth"):  # as they are drawn, maps are nearly flat
        weights[f"{name}.weight"] = weights[f"{name}.weight"] * 30
    unsure = np.full((len(OUTCOMES), len(JOINTS), N_TERMS), np.nan, np.float32)
    model = HeatmapModel(config, JOINTS, weights, unsure)
    rng = np.random.default_rng(0)
    depth = np.zeros((96, 128), np.uint16)
    depth[10:90, 50:80] = 2500 + rng.integers(-150, 150, (80, 30))
    box = (50.0, 10.0, 80.0, 90.0)
    camera = Intrinsics(70.0, 72.0, 63.5, 47.5)  # coarse: no pixel of the patch covers two of the image
    ours = HeatmapPredictor(model).predict(depth, camera, box)
    (tmp_path / "net.onnx").write_bytes(to_onnx(model))
    np.save(tmp_path / "depth.npy", depth)
    told = map(str, (camera.fx, camera.fy, camera.cx, camera.cy, *box))
    words = [str(SCRIPT), str(tmp_path / "net.onnx"), str(tmp_path / "depth.npy"), *told]
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    theirs = [json.loads(line) for line in done.stdout.splitlines()]
    assert [item["joint"] for item in theirs] == list(JOINTS)
    np.testing.assert_allclose([item["xyz"] for item in theirs], ours.joints, atol=1e-3)
