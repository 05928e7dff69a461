"""The nets' sizes are the paper's; costs, files and graphs."""

import json
from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="torch is not installed")

from toy_patches import toy_patches

from forests.modelfile import ModelFileError, read_model, write_model
from nets.inputs import Draws, crop_inputs, draw, training_inputs
from nets.modules import to_arrays
from nets.orientation.config import OUTPUTS, VIEWS, OrientationConfig
from nets.orientation.costs import COSTS, concentration_cost, posture_cost, tilt_roll_cost
from nets.orientation.decode import decode_crops
from nets.orientation.export import to_onnx
from nets.orientation.model import Calibration, OrientationModel
from nets.orientation.network import OrientationNet, net_of
from nets.orientation.predict import OrientationPredictor
from nets.orientation.storage import load_model, save_model


def config_of(output="biternion_von_mises", region="head", architecture="small"):
    n_bins = 8 if output.startswith("softmax") else 0
    return OrientationConfig(region=region, architecture=architecture, output=output, n_bins=n_bins)


def random_model(config, seed=0):
    """A model whose every weight is drawn, so that no part of the net can hide."""
    generator = torch.Generator().manual_seed(seed)
    net = OrientationNet(config)
    with torch.no_grad():
        for name, value in net.named_parameters():
            scale = (2.0 / value[0].numel()) ** 0.5 if value.ndim > 1 else 0.2
            value.copy_(torch.randn(value.shape, generator=generator) * scale)
            if name.startswith("features") and value.ndim == 1 and name.endswith("weight"):
                value.add_(1.0)
        for _ in range(4):  # statistics of the normalisations
            net(torch.randn((16, 2, config.view.height, config.view.width), generator=generator))
    return OrientationModel(config, to_arrays(net), Calibration(0.1, 0.9, 0.02))


def test_the_papers_nets_end_in_the_maps_of_its_table():
    head = OrientationNet(config_of(architecture="paper"))
    assert head.features(torch.zeros(1, 2, 46, 46)).shape == (1, 64, 5, 5)
    body = OrientationNet(config_of(region="body", architecture="paper"))
    assert body.features(torch.zeros(1, 2, 123, 54)).shape == (1, 64, 7, 2)
    convolutions = [part for part in head.features if isinstance(part, torch.nn.Conv2d)]
    assert [part.out_channels for part in convolutions] == [24, 24, 48, 48, 64, 64]


@pytest.mark.parametrize("output", OUTPUTS)
@pytest.mark.parametrize(("region", "architecture"), VIEWS)
def test_a_graph_puts_out_what_the_net_does(output, region, architecture):
    runtime = pytest.importorskip("onnxruntime", reason="onnxruntime is not installed")
    config = config_of(output, region, architecture)
    model = random_model(config)
    rng = np.random.default_rng(3)
    shape = (3, 2, config.view.height, config.view.width)
    images = rng.normal(0.0, 0.5, shape).astype(np.float32)
    with torch.inference_mode():
        ours = [value.numpy() for value in net_of(config, model.weights)(torch.from_numpy(images))]
    session = runtime.InferenceSession(to_onnx(model), providers=["CPUExecutionProvider"])
    names = ["angle", "log_concentration", "auxiliary"]
    for name, mine, theirs in zip(names, ours, session.run(names, {"images": images}), strict=True):
        assert mine.shape == theirs.shape
        assert np.ptp(mine) > 1e-3, "an output that never changes compares nothing"
        np.testing.assert_allclose(theirs, mine, atol=1e-4, err_msg=name)
    assert json.loads(session.get_modelmeta().custom_metadata_map["config"])["output"] == output


def test_the_same_model_gives_the_same_graph():
    pytest.importorskip("onnx", reason="onnx is not installed")
    assert to_onnx(random_model(config_of())) == to_onnx(random_model(config_of()))


@pytest.mark.parametrize("output", OUTPUTS)
def test_no_cost_is_lower_than_that_of_the_truth(output):
    rng = np.random.default_rng(1)
    angle = rng.uniform(-3.0, 3.0, 50)
    other = angle + rng.uniform(-1.0, 1.0, 50)
    sector = torch.from_numpy(np.floor((angle + np.pi) / (2 * np.pi) * 8).astype(np.int64))

    def raw(values):
        if output.startswith("biternion"):
            return torch.from_numpy(np.stack([np.cos(values), np.sin(values)], axis=1))
        if output.startswith("softmax"):
            at = torch.from_numpy(np.floor((values + np.pi) / (2 * np.pi) * 8).astype(np.int64) % 8)
            return 9.0 * torch.nn.functional.one_hot(at, 8).double()
        return torch.from_numpy(values)[:, None]

    cost = COSTS[output]
    true = torch.from_numpy(angle)
    right, wrong = (cost(raw(values), true, sector, 1.0).numpy() for values in (angle, other))
    assert right.shape == (50,)
    assert (right <= wrong + 1e-6).all()
    if "von_mises" in output or output == "biternion_cosine":
        turned = raw(angle + 2 * np.pi)
        np.testing.assert_allclose(cost(turned, true, sector, 1.0).numpy(), right, atol=1e-9)


def test_the_concentration_that_fits_errors_best_is_cheapest():
    rng = np.random.default_rng(0)
    error = torch.from_numpy(rng.vonmises(0.0, 5.0, 4000))
    log_kappa = torch.linspace(-3.0, 6.0, 91, dtype=torch.float64)
    costs = [float(concentration_cost(value.expand(4000), error).mean()) for value in log_kappa]
    assert abs(float(log_kappa[int(np.argmin(costs))]) - np.log(5.0)) < 0.2


def test_what_is_not_known_costs_nothing():
    logits = torch.randn(3, 4, generator=torch.Generator().manual_seed(0)).requires_grad_()
    assert float(posture_cost(logits, torch.tensor([-1, -1, -1])).detach()) == 0.0
    posture_cost(logits, torch.tensor([-1, 2, -1])).backward()
    assert (logits.grad[[0, 2]] == 0).all()
    assert (logits.grad[1] != 0).all()
    unknown = torch.full((2, 2), torch.nan)
    assert float(tilt_roll_cost(torch.ones(2, 2), unknown)) == 0.0


def test_crops_are_averaged_across_the_back():
    angles = np.array([np.pi - 0.1, 0.1 - np.pi])
    raw = np.stack([np.cos(angles), np.sin(angles)], axis=1)[None]
    np.testing.assert_allclose(abs(decode_crops(raw, "biternion_cosine")), np.pi)


def still(n):
    """Draws that change nothing."""
    none, zero = np.zeros(n, bool), np.zeros(n)
    return Draws(none, none, none, none, np.zeros((n, 2), np.int64), none, np.zeros((n, 2)), zero + 1, zero, zero)


def test_inputs_in_training_are_the_middle_crops_if_nothing_is_drawn():
    patches = toy_patches(3)
    view = VIEWS["head", "small"]
    relative, kind = torch.from_numpy(patches.relative), torch.from_numpy(patches.kind)
    given = training_inputs(relative, kind, still(3), view, torch.Generator().manual_seed(0))
    assert torch.equal(given, crop_inputs(patches.relative, view, 1))
    mirrored = still(3)._replace(is_mirrored=np.ones(3, bool))
    turned = training_inputs(relative, kind, mirrored, view, torch.Generator().manual_seed(0))
    assert torch.equal(turned, given.flip(3))


def test_who_is_cut_out_is_shown_without_objects():
    patches = toy_patches(2)
    patches.kind[:, :, 20:] = np.where(patches.kind[:, :, 20:] == 1, 2, 0)
    view = VIEWS["head", "small"]
    cut = still(2)._replace(is_cut=np.ones(2, bool))
    relative, kind = torch.from_numpy(patches.relative), torch.from_numpy(patches.kind)
    given = training_inputs(relative, kind, cut, view, torch.Generator().manual_seed(0))
    assert (given[:, :, :, 18:] == 0).all()
    assert (given[:, 1, :, :18] == 1).any()


def test_what_goes_wrong_with_patches_follows_from_the_seed():
    config = config_of()
    first, second = (draw(np.random.default_rng(7), 5, config) for _ in range(2))
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)
    assert not draw(np.random.default_rng(7), 50, replace(config, mirrors=False)).is_mirrored.any()


def test_a_model_comes_back_out_of_its_file(tmp_path):
    model = random_model(config_of())
    save_model(tmp_path / "m", model, {"corpus": "abc"})
    again = load_model(tmp_path / "m")
    assert again.config == model.config
    assert again.calibration == model.calibration
    patches = toy_patches(4)
    for one, other in zip(
        *(OrientationPredictor(item).estimates(patches.relative) for item in (model, again)), strict=True
    ):
        assert one.angle == other.angle
        assert -np.pi <= one.angle <= np.pi
        assert 0.0 < one.probability < 1.0
    save_model(tmp_path / "n", again, {"corpus": "abc"})
    assert (tmp_path / "n").read_bytes() == (tmp_path / "m").read_bytes()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda arrays, metadata: arrays.pop("angle.bias"), "weights do not fit the net: angle.bias"),
        (lambda arrays, metadata: arrays.update({"angle.bias": np.zeros(3, np.float32)}), "must be float32"),
        (lambda arrays, metadata: arrays["angle.bias"].fill(np.nan), "not finite"),
        (lambda arrays, metadata: metadata.pop("config"), "lacks 'config'"),
        (lambda arrays, metadata: metadata["config"].update(output="softmax_centres"), "n_bins=0 must be"),
        (lambda arrays, metadata: metadata.update(postures=["lying"]), "knows the postures"),
        (lambda arrays, metadata: metadata["calibration"].update(outliers=2.0), "is none"),
    ],
)
def test_a_file_that_holds_no_such_net_is_refused(tmp_path, change, words):
    save_model(tmp_path / "m", random_model(config_of()), {})
    contents = read_model(tmp_path / "m")
    change(contents.arrays, contents.metadata)
    write_model(tmp_path / "m", "orientation", contents.arrays, contents.metadata)
    with pytest.raises((ModelFileError, ValueError), match=words):
        OrientationPredictor(load_model(tmp_path / "m"))
