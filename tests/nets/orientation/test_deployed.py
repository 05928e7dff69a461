"""Exported nets answer without torch what the program answers with it."""

import numpy as np
import pytest

pytest.importorskip("torch", reason="torch is not installed")
pytest.importorskip("onnx", reason="onnx is not installed")
pytest.importorskip("onnxruntime", reason="onnxruntime is not installed")

from forests.frames import Intrinsics
from nets.deployed import DeployedOrientation
from nets.orientation.export import to_onnx
from nets.orientation.predict import OrientationPredictor
from pipelines.online.messages import Request
from pipelines.online.modules.analysers import open_analyser
from pipelines.online.modules.jobs import Job, ModuleSettings
from tests.nets.orientation.test_network import config_of, random_model

CAMERA = Intrinsics(70.0, 70.0, 63.5, 47.5)
BOX = (50.0, 10.0, 80.0, 90.0)


@pytest.fixture
def depth():
    rng = np.random.default_rng(0)
    out = np.zeros((96, 128), np.uint16)
    out[10:90, 50:80] = 2500 + rng.integers(-150, 150, (80, 30))
    return out


@pytest.mark.parametrize("region", ["body", "head"])
@pytest.mark.parametrize("output", ["biternion_von_mises", "softmax_interpolated"])
def test_an_exported_net_answers_the_same(region, output, depth, tmp_path):
    model = random_model(config_of(output, region))
    path = tmp_path / "net.onnx"
    path.write_bytes(to_onnx(model))
    ours, net = OrientationPredictor(model).predict(depth, CAMERA, BOX), DeployedOrientation(path)
    assert net.region == region
    (found,) = net.ask(net.patch(depth, CAMERA, BOX)[None])
    assert found.angle == pytest.approx(ours.angle, abs=1e-3)
    assert found.concentration == pytest.approx(ours.concentration, rel=1e-3)
    assert found.probability == pytest.approx(ours.probability, abs=1e-3)
    assert found.posture == (ours.posture if region == "body" else "")


def test_a_file_that_is_no_net_is_one_clear_error(tmp_path):
    (tmp_path / "net.onnx").write_bytes(b"nonsense")
    with pytest.raises(ValueError, match=r"net\.onnx holds no sound ONNX graph"):
        DeployedOrientation(tmp_path / "net.onnx")
    with pytest.raises(ValueError, match="there is no file"):
        DeployedOrientation(tmp_path / "missing.onnx")


def test_a_module_answers_everybody_whom_the_image_shows(depth, tmp_path):
    path = tmp_path / "net.onnx"
    path.write_bytes(to_onnx(random_model(config_of(region="body"))))
    module = open_analyser(ModuleSettings("orientation", "orientation", str(path)))
    empty = (0.0, 0.0, 10.0, 10.0)
    asked = tuple(Request(5, k, "orientation", box, box, np.zeros(3)) for k, box in ((3, BOX), (4, empty)))
    (answer,) = module.analyse(depth, Job(5, "camera", CAMERA, None, np.zeros((0, 3)), asked))
    assert (answer.stamp, answer.track_id, answer.region) == (5, 3, "body")
    assert answer.seconds > 0
