"""Angles on a circle."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import vonmises

from nets.orientation.angles import (
    angular_error,
    bin_centre,
    bin_of,
    interpolated_peak,
    mean_direction,
    von_mises_log_density,
    von_mises_within,
    wrapped,
)

angles = st.floats(-20.0, 20.0)


@given(angles, angles, st.integers(-3, 3))
def test_errors_know_no_turns_and_no_order(a, b, turns):
    error = float(angular_error(a, b))
    assert 0.0 <= error <= np.pi
    np.testing.assert_allclose(float(angular_error(b, a + 2.0 * np.pi * turns)), error, atol=1e-9)
    np.testing.assert_allclose(np.cos(error), np.cos(a - b), atol=1e-9)


@given(angles, st.integers(3, 36))
def test_an_angle_is_within_half_a_sector_of_its_centre(angle, n_bins):
    centre = bin_centre(bin_of(angle, n_bins), n_bins)
    assert float(angular_error(angle, centre)) <= np.pi / n_bins + 1e-9


def test_the_first_sector_is_that_of_frontal_views():
    assert bin_of([0.0, 0.3, -0.3, np.pi], 8).tolist() == [0, 0, 0, 4]


@given(st.floats(-np.pi, np.pi), st.integers(6, 36))
def test_the_peak_of_a_smooth_posterior_lies_near_its_centre(angle, n_bins):
    at = bin_centre(np.arange(n_bins), n_bins)
    posterior = np.exp(3.0 * np.cos(at - angle))[None]
    posterior /= posterior.sum()
    error = float(angular_error(interpolated_peak(posterior)[0], angle))
    assert error <= 0.5 * np.pi / n_bins
    assert error <= float(angular_error(at[posterior.argmax()], angle)) + 1e-6


def test_a_flat_posterior_has_the_centre_of_its_first_sector():
    assert interpolated_peak(np.full((1, 8), 0.125)).tolist() == [0.0]


@pytest.mark.parametrize("kappa", [0.0, 0.5, 4.0, 300.0])
def test_the_von_mises_distribution_is_that_of_scipy(kappa):
    at = np.linspace(-np.pi, np.pi, 41)
    if kappa > 0.0:
        np.testing.assert_allclose(von_mises_log_density(at, kappa), vonmises.logpdf(at, kappa), atol=1e-9)
        inside = vonmises.cdf(0.4, kappa) - vonmises.cdf(-0.4, kappa)
        np.testing.assert_allclose(von_mises_within(0.4, kappa), inside, atol=1e-4)
    else:
        np.testing.assert_allclose(np.exp(von_mises_log_density(at, kappa)), 1.0 / (2.0 * np.pi))
    np.testing.assert_allclose(von_mises_within(np.pi, kappa), 1.0, atol=1e-4)


def test_directions_are_averaged_across_the_back():
    np.testing.assert_allclose(abs(mean_direction(np.array([np.pi - 0.1, 0.1 - np.pi]))), np.pi)
    assert wrapped(np.pi) == -np.pi
