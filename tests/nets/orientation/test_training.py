"""Orientation nets learn, repeat themselves, and go on after an interruption to the same weights."""

from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="torch is not installed")

from toy_patches import toy_patches, with_postures

from nets.orientation.angles import angular_error
from nets.orientation.config import OUTPUTS, OrientationConfig
from nets.orientation.predict import OrientationPredictor
from nets.orientation.train import learned_angle, train

QUIET = {"cut_share": 0.0, "hole_share": 0.0, "depth_jitter_m": 0.0, "scale_jitter": 0.0}
TINY = OrientationConfig(region="head", n_epochs=3, batch_size=20, seed=4, **QUIET)


class Kept:
    """A checkpoint in memory that interrupts after an epoch if told."""

    def __init__(self, stops_after=None):
        self.state, self.n_saved, self.stops_after = None, 0, stops_after

    def load(self, tree):
        return self.state

    def save(self, tree, grown):
        self.state = {name: value.copy() for name, value in grown.items()}
        self.n_saved += 1
        if self.n_saved == self.stops_after:
            raise KeyboardInterrupt


def errors_of(model, patches):
    estimates = OrientationPredictor(model).estimates(patches.relative)
    return angular_error([item.angle for item in estimates], patches.angle)


def assert_same_weights(a, b):
    assert sorted(a.weights) == sorted(b.weights)
    for name, values in a.weights.items():
        np.testing.assert_array_equal(values, b.weights[name], err_msg=name)


def test_a_net_learns_which_way_a_toy_looks():
    config = replace(TINY, n_epochs=9)
    model = train(toy_patches(240, 1), config, validation=toy_patches(20, 2))
    assert np.degrees(errors_of(model, toy_patches(80, 3)).mean()) < 20.0


@pytest.mark.parametrize("optimizer", ["adamw", "adadelta"])
def test_an_interrupted_training_goes_on_to_the_same_weights(optimizer):
    config = replace(TINY, optimizer=optimizer, cut_share=0.5, hole_share=0.1)
    patches, validation = toy_patches(60, 1), toy_patches(20, 2)
    whole = train(patches, config, validation=validation)
    kept = Kept(stops_after=2)
    with pytest.raises(KeyboardInterrupt):
        train(patches, config, validation=validation, checkpoint=kept)
    kept.stops_after = None
    torch.rand(7)  # whatever else draws from torch does not matter
    shares = []
    resumed = train(patches, config, validation=validation, checkpoint=kept, on_progress=shares.append)
    assert shares == [1.0]
    assert_same_weights(whole, resumed)
    assert whole.calibration == resumed.calibration


def test_another_seed_gives_other_weights_and_torch_is_left_as_it_was():
    torch.manual_seed(3)
    before = torch.random.get_rng_state()
    patches = toy_patches(40, 1)
    first, second = (
        train(patches, replace(TINY, n_epochs=1, seed=seed), validation=toy_patches(0)) for seed in (0, 1)
    )
    assert (first.weights["angle.weight"] != second.weights["angle.weight"]).any()
    assert torch.equal(before, torch.random.get_rng_state())
    assert not torch.are_deterministic_algorithms_enabled()


def test_bodies_learn_postures():
    config = OrientationConfig(n_epochs=8, batch_size=14, auxiliary_weight=1.0, **QUIET)
    patches, tests = (with_postures(toy_patches(n, seed, config)) for n, seed in ((140, 1), (50, 2)))
    model = train(patches, config, validation=tests)
    estimates = OrientationPredictor(model).estimates(tests.relative)
    right = np.mean([item.posture_probability.argmax() for item in estimates] == tests.posture)
    assert right > 0.85
    np.testing.assert_allclose([item.posture_probability.sum() for item in estimates], 1.0, atol=1e-5)
    assert {item.posture for item in estimates} <= {"standing", "sitting", "bent", "squatting"}


def test_labels_in_sectors_are_the_centres_of_the_true_sectors():
    learned = learned_angle(np.array([0.1, -0.3, 3.0]), 4)
    np.testing.assert_allclose(learned, [0.0, 0.0, -np.pi])
    np.testing.assert_array_equal(learned_angle(np.array([0.1]), 0), [0.1])


def test_too_few_patches_are_refused():
    with pytest.raises(ValueError, match="cannot be fitted to 1 samples"):
        train(toy_patches(1), TINY, validation=toy_patches(0))


@pytest.mark.parametrize("n_bins", [0, 2])
def test_classes_need_sectors(n_bins):
    with pytest.raises(ValueError, match=f"n_bins={n_bins} must be at least 3 with output=softmax_centres"):
        OrientationConfig(output="softmax_centres", n_bins=n_bins)


def test_every_output_is_an_option():
    assert len(OUTPUTS) == 6
