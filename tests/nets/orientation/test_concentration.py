"""Calibrated concentrations: recovered from errors that were drawn with them."""

import numpy as np

from nets.orientation.concentration import calibrate, negative_log_likelihood
from nets.orientation.model import PROBABLE_RAD, Calibration


def drawn(calibration, n=6000, seed=0):
    rng = np.random.default_rng(seed)
    told = rng.uniform(-1.0, 3.0, n)
    error = rng.vonmises(0.0, calibration.concentration(told))
    is_outlier = rng.random(n) < calibration.outliers
    return told, np.abs(np.where(is_outlier, rng.uniform(-np.pi, np.pi, n), error))


def test_the_calibration_that_errors_were_drawn_with_is_found():
    truth = Calibration(0.5, 0.8, 0.1)
    found = calibrate(*drawn(truth))
    np.testing.assert_allclose(found, truth, atol=0.1)
    told, error = drawn(truth, seed=1)
    assert negative_log_likelihood(found, told, error) < negative_log_likelihood(Calibration(), told, error)


def test_probabilities_are_shares():
    truth = Calibration(0.5, 0.8, 0.1)
    told, error = drawn(truth)
    probability = calibrate(told, error).probability(told)
    for group in np.array_split(np.argsort(probability), 5):
        assert abs(probability[group].mean() - (error[group] <= PROBABLE_RAD).mean()) < 0.05


def test_without_frames_the_net_is_believed():
    assert calibrate(np.empty(0), np.empty(0)) == Calibration()
