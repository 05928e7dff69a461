"""Heat map nets learn where the parts of a toy are, repeat themselves, and answer as forests do."""

from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="torch is not installed")

from forests.frames import FrameBatch, Intrinsics, LabelTable
from forests.modelfile import ModelFileError, read_model, write_model
from nets.heatmap.config import CELL_MIDDLE, SIGMA, STATES, STRIDE, VIEW, HeatmapConfig
from nets.heatmap.export import to_onnx
from nets.heatmap.network import names_of, net_of
from nets.heatmap.predict import HeatmapPredictor
from nets.heatmap.samples import collect_patches
from nets.heatmap.storage import load_model, save_model
from nets.heatmap.targets import depth_cost, heat_cost, shown_in_cells, state_cost, targets_of
from nets.heatmap.train import train
from nets.inputs import crop_inputs, draw, training_inputs
from nets.modules import from_arrays

CAMERA = Intrinsics(80.0, 80.0, 63.5, 47.5)
LABELS = LabelTable(("body",), ("box",), ("head", "r_hand", "l_hand"))
QUIET = {"hole_share": 0.0, "depth_jitter_m": 0.0, "scale_jitter": 0.0, "cut_share": 0.0}
TINY = HeatmapConfig((8, 12, 16), (1, 1, 1), n_epochs=2, batch_size=8, learning_rate=5e-3, seed=4, **QUIET)
FORWARD_M = {"r_hand": 0.25, "l_hand": -0.2}
"""Hands lie before and behind the trunk."""


def toy_frames(n, seed=0):
    """A disc for a head over a bar for a trunk; the right hand is a near disc, the left one a far one; some hidden."""
    rng = np.random.default_rng(seed)
    depth, label = np.zeros((n, 96, 128), np.uint16), np.zeros((n, 96, 128), np.uint8)
    joints, hidden = np.empty((n, 3, 3), np.float32), np.zeros((n, 3), bool)
    v, u = np.mgrid[:96, :128]
    for k in range(n):
        z = rng.uniform(1.9, 2.5)
        at = {"head": (rng.uniform(-0.2, 0.2), -0.55, z)}
        for name, side in (("r_hand", -1.0), ("l_hand", 1.0)):
            x = at["head"][0] + side * rng.uniform(0.25, 0.45)
            at[name] = (x, rng.uniform(-0.3, 0.5), z - FORWARD_M[name])
        trunk = (abs(u - 80.0 * at["head"][0] / z - 63.5) < 4) & (v > 28) & (v < 75)
        depth[k][trunk] = round(1e3 * z)
        for joint, name in enumerate(LABELS.joints):
            x, y, far = at[name]
            disc = np.hypot(u - 80.0 * x / far - 63.5, v - 80.0 * y / far - 47.5) < 4.5
            depth[k][disc] = round(1e3 * far)
            joints[k, joint] = at[name]
        label[k] = depth[k] > 0
        if k % 3 == 0:
            box = v > 62
            depth[k][box], label[k][box] = 1500, 2
            hidden[k] = 80.0 * joints[k, :, 1] / joints[k, :, 2] + 47.5 > 62
    return FrameBatch(depth, label, joints, CAMERA, LABELS, is_occluded=hidden)


def errors_of(model, frames):
    predictor = HeatmapPredictor(model)
    given = np.array(
        [predictor.predict(frame.depth, CAMERA, (20.0, 18.0, 110.0, 80.0)).joints for frame in frames]
    )
    return np.linalg.norm(given - frames.joints, axis=2)


def test_a_net_learns_where_the_hands_of_a_toy_are():
    frames = toy_frames(72, 1)
    model = train(frames, replace(TINY, n_epochs=28), validation=toy_frames(20, 2))
    errors = errors_of(model, toy_frames(20, 3))
    seen = errors[~toy_frames(20, 3).is_occluded]
    assert np.median(seen) < 0.08
    estimate = HeatmapPredictor(model).predict(frames.depth[1], CAMERA, None)
    assert estimate.proposals.shape == (3, 3, 3)
    assert (np.diff(estimate.proposal_confidence, axis=1) <= 0.0).all()
    told = (estimate.hidden_probability, estimate.self_hidden_probability, estimate.outside_probability)
    for values in (estimate.probability, *told):
        assert ((values > 0.0) & (values < 1.0)).all()


def test_bells_lie_where_crops_show_the_joint():
    """A pixel that stands out at a joint is shown where the joint's bell is, whatever was drawn."""
    frames, config = toy_frames(12, 5), replace(TINY, scale_jitter=0.1)
    patches = collect_patches(frames, config)
    place = np.rint(patches.place).astype(int)
    relative = np.zeros_like(patches.relative)
    for k in range(len(place)):
        relative[k, place[k, 1, 0], place[k, 1, 1]] = 900
    patches = patches._replace(place=place.astype(np.float32), relative=relative)
    batch = np.arange(12)
    draws = draw(np.random.default_rng(3), 12, config)._replace(has_wall=np.zeros(12, bool))
    assert draws.is_mirrored.any()
    kind = torch.ones(relative.shape, dtype=torch.uint8)
    images = training_inputs(torch.from_numpy(relative), kind, draws, VIEW, torch.Generator().manual_seed(0))
    heat = targets_of(patches, batch, draws, VIEW, np.array([0, 2, 1])).heat.numpy()
    n_seen = 0
    for k in range(12):
        rows, columns = np.nonzero(images[k, 0].numpy() > 0.9)
        if len(rows):
            n_seen += 1
            joint = 2 if draws.is_mirrored[k] else 1
            row, column = np.unravel_index(heat[k, joint].argmax(), heat[k, joint].shape)
            assert abs((rows.mean() - CELL_MIDDLE) / STRIDE - row) <= 0.75
            assert abs((columns.mean() - CELL_MIDDLE) / STRIDE - column) <= 0.75
    assert n_seen >= 8


@pytest.mark.parametrize("kind", ["mse", "cross_entropy"])
def test_no_maps_are_cheaper_than_the_true_ones(kind):
    frames = toy_frames(6, 5)
    patches = collect_patches(frames, TINY)
    draws = draw(np.random.default_rng(3), 6, TINY)
    targets = targets_of(patches, np.arange(6), draws, VIEW, np.array([0, 2, 1]))
    true = targets.heat if kind == "mse" else torch.log(targets.heat + 1e-9)
    moved = true.roll(round(4 * SIGMA), dims=3)
    assert float(heat_cost(true, targets, kind)) < float(heat_cost(moved, targets, kind))
    depth = targets.depth[:, :, None, None].expand(targets.heat.shape)
    assert float(depth_cost(depth, targets)) == pytest.approx(0.0, abs=1e-6)
    assert float(depth_cost(depth + 0.1, targets)) == pytest.approx(0.1, abs=1e-5)


def test_joints_that_are_not_known_are_not_learned_from():
    frames = toy_frames(10, 1)
    frames.joints[:, 2] = np.nan
    patches = collect_patches(frames, TINY)
    targets = targets_of(
        patches, np.arange(10), draw(np.random.default_rng(0), 10, TINY), VIEW, np.array([0, 2, 1])
    )
    assert not (targets.is_known.numpy().all(axis=1)).any()
    assert torch.isfinite(targets.depth).all()
    model = train(frames, replace(TINY, n_epochs=1), validation=frames)
    assert np.isnan(model.calibration[:, 2]).all()
    assert np.isfinite(model.calibration[:, 0]).all()


def test_states_are_what_frames_tell_and_outside_goes_first():
    frame = replace(toy_frames(1, 5)[0], is_self_occluded=np.array([False, True, True]))
    frame.joints[1] = (3.0, 0.0, 2.0)
    frame = replace(frame, is_occluded=np.array([False, True, True]))

    class One:
        labels = LABELS

        def __len__(self):
            return 1

        def __getitem__(self, index):
            return frame

    of = {layer: collect_patches(One(), replace(TINY, layer=layer)).state[0] for layer in ("composite", "body")}
    assert [STATES[k] for k in of["composite"]] == ["visible", "outside", "hidden"]
    assert [STATES[k] for k in of["body"]] == ["visible", "outside", "self_hidden"]
    patches = collect_patches(One(), TINY)
    draws = draw(np.random.default_rng(0), 1, replace(TINY, mirrors=False))
    targets = targets_of(patches, np.arange(1), draws, VIEW, np.array([0, 2, 1]))
    right = 20.0 * torch.nn.functional.one_hot(targets.state, len(STATES)).transpose(1, 2).float()
    assert float(state_cost(right, targets)) < 1e-6 < float(state_cost(-right, targets))


def test_cells_show_what_lies_in_their_middles():
    """Patches whose labels tell rows, then columns; crops that are not moved, then mirrored."""
    draws = draw(np.random.default_rng(0), 1, replace(TINY, mirrors=False))._replace(shift=np.zeros((1, 2)))
    rows, columns = (
        np.broadcast_to(values, VIEW.patch)[None] for values in np.ogrid[: VIEW.patch[0], : VIEW.patch[1]]
    )
    first = VIEW.margin + STRIDE // 2
    shown = shown_in_cells(rows.astype(np.uint8), draws, VIEW)[0]
    assert shown.shape == (VIEW.height // STRIDE, VIEW.width // STRIDE)
    assert shown[:3, 5].tolist() == [first, first + STRIDE, first + 2 * STRIDE]
    turned = draws._replace(is_mirrored=np.array([True]))
    shown = shown_in_cells(columns.astype(np.uint8), turned, VIEW)[0]
    assert (shown[4, 0], shown[4, -1]) == (VIEW.patch[1] - 1 - first, VIEW.margin + STRIDE // 2 - 1)


@pytest.mark.parametrize(
    ("naming", "layer", "n_classes"),
    [
        ("none", "composite", 0),
        ("one_class", "composite", 1),
        ("each_class", "composite", 1),
        ("each_class", "body", 0),
    ],
)
def test_what_is_named_is_learned_and_not_asked(naming, layer, n_classes):
    frames = toy_frames(24, 1)
    model = train(frames, replace(TINY, naming=naming, layer=layer, n_epochs=6), validation=frames)
    names = names_of(model.weights, 3)
    assert names == (3, 1, n_classes)
    net = net_of(model.config, names)
    from_arrays(net, model.weights)
    patches = collect_patches(frames, model.config)
    with torch.inference_mode():
        maps, _ = net.features(crop_inputs(patches.relative, VIEW, 1))
        middle = slice(VIEW.margin + STRIDE // 2, -VIEW.margin, STRIDE)
        for output, label, first in ((net.part, patches.part, 1), (net.object, patches.label, 2)):
            if output is not None:
                told = output(maps).argmax(dim=1).numpy() == 1
                true = label[:, middle, middle] == first
                assert told[true].mean() > told[~true].mean() + 0.3


def seen_alone(n):
    """`collect_patches` for that many frames alone: others were cut before."""

    def collected(frames, *others):
        assert len(frames) == n
        return collect_patches(frames, *others)

    return collected


def test_an_interrupted_training_goes_on_to_the_same_weights(monkeypatch):
    frames = toy_frames(16, 1)
    whole = train(frames, TINY, validation=toy_frames(4, 2))
    kept = {}

    class Stops:
        def load(self, piece):
            return kept.get(piece)

        def save(self, piece, grown):
            is_first = piece == 0 and 0 not in kept
            kept[piece] = {name: value.copy() for name, value in grown.items()}
            if is_first:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(frames, TINY, validation=toy_frames(4, 2), checkpoint=Stops())
    monkeypatch.setattr("nets.heatmap.train.collect_patches", seen_alone(4))
    resumed = train(frames, TINY, validation=toy_frames(4, 2), checkpoint=Stops())
    for name, values in whole.weights.items():
        np.testing.assert_array_equal(values, resumed.weights[name], err_msg=name)
    np.testing.assert_array_equal(whole.calibration, resumed.calibration)


def test_a_model_comes_back_out_of_its_file_or_is_refused(tmp_path):
    frames = toy_frames(8, 1)
    model = train(frames, replace(TINY, n_epochs=1), validation=frames)
    save_model(tmp_path / "m", model, {})
    np.testing.assert_array_equal(errors_of(model, frames), errors_of(load_model(tmp_path / "m"), frames))
    contents = read_model(tmp_path / "m")
    write_model(tmp_path / "n", "heatmap", contents.arrays, contents.metadata | {"joints": ["head"]})
    with pytest.raises(ModelFileError, match="calibration is float32"):
        load_model(tmp_path / "n")


def test_an_image_that_shows_nothing_has_no_joints():
    model = train(toy_frames(8, 1), replace(TINY, n_epochs=1), validation=toy_frames(2, 2))
    estimate = HeatmapPredictor(model).predict(np.zeros((96, 128), np.uint16), CAMERA)
    assert np.isnan(estimate.joints).all()
    assert (estimate.confidence == 0.0).all()


def test_a_graph_puts_out_what_the_net_does():
    runtime = pytest.importorskip("onnxruntime", reason="onnxruntime is not installed")
    model = train(toy_frames(16, 1), TINY, validation=toy_frames(2, 2))
    net = net_of(model.config, names_of(model.weights, 3))
    from_arrays(net, model.weights)
    rng = np.random.default_rng(3)
    images = rng.normal(0.0, 0.5, (2, 2, VIEW.height, VIEW.width)).astype(np.float32)
    with torch.inference_mode():
        ours = [value.numpy() for value in net(torch.from_numpy(images))]
    session = runtime.InferenceSession(to_onnx(model), providers=["CPUExecutionProvider"])
    names = ["heat", "depth", "state"]
    for name, mine, theirs in zip(names, ours, session.run(names, {"images": images}), strict=True):
        assert mine.shape == theirs.shape
        assert np.ptp(mine) > 1e-3, "an output that never changes compares nothing"
        np.testing.assert_allclose(theirs, mine, atol=1e-4, err_msg=name)
