"""Calibration by the modulus: exact readings, outliers, the numerical optimum, what scatters against the covariance."""

import numpy as np
import pytest
from scipy.optimize import minimize

from jaxsat.errors import InputError
from jaxsat.estimation import calibrate_magnetometer
from jaxsat.sensors import Magnetometer

BIAS, SCALE, SHEAR = np.array([4e-6, -9e-6, 2e-6]), np.array([1.04, 0.97, 1.01]), np.array([0.01, -0.02, 0.015])
TRUE = np.concatenate([BIAS, SCALE, SHEAR])
MATRIX = np.array([[1.04, 0.015, -0.02], [0.015, 0.97, 0.01], [-0.02, 0.01, 1.01]])


def field(rng, count):
    """Fields of a tumbling satellite [T]."""
    v = rng.normal(size=(count, 3))
    return rng.uniform(2.2e-5, 5e-5, (count, 1)) * v / np.linalg.norm(v, axis=1, keepdims=True)


def numbers(found):
    return np.concatenate([found.bias, found.scale, found.shear])


def test_exact_readings_give_the_numbers_of_the_sensor():
    true = field(np.random.default_rng(0), 60)
    found = calibrate_magnetometer(true @ MATRIX + BIAS, np.linalg.norm(true, axis=1))
    np.testing.assert_allclose(numbers(found), TRUE, rtol=1e-7, atol=1e-12)
    np.testing.assert_allclose(found.corrected(true @ MATRIX + BIAS), true, atol=1e-12)
    np.testing.assert_allclose(found.matrix, MATRIX, atol=1e-7)
    assert found.used.all() and found.sigma < 1e-11
    # The sensor takes them as they are: its direct sight is the direction of the field.
    sensor = Magnetometer(bias=found.bias, scale=found.scale, shear=found.shear)
    told = sensor.direct(true @ MATRIX + BIAS, 1e-9)
    assert told is not None
    np.testing.assert_allclose(told[0], true / np.linalg.norm(true, axis=1, keepdims=True), atol=1e-6)


def test_a_bias_larger_than_the_field():
    true = field(np.random.default_rng(1), 80)
    bias = np.array([3e-4, -2e-4, 1e-4])
    found = calibrate_magnetometer(true @ MATRIX + bias, np.linalg.norm(true, axis=1))
    np.testing.assert_allclose(found.bias, bias, atol=1e-10)


def test_wrong_bytes_are_left_out():
    rng = np.random.default_rng(2)
    true = field(rng, 300)
    read = true @ MATRIX + BIAS + 1e-7 * rng.normal(size=true.shape)
    wrong = rng.permutation(300)[:45]
    read[wrong[:15], 0] *= -1.0
    read[wrong[15:30]] *= 3.0
    read[wrong[30:40], 1] = 9.999e-4
    read[wrong[40:], 2] = np.nan
    found = calibrate_magnetometer(read, np.linalg.norm(true, axis=1))
    clean = np.setdiff1d(np.arange(300), wrong)
    assert found.used[clean].mean() > 0.99 and not found.used[wrong[15:]].any()
    sigmas = np.array(list(found.sigmas.values()))
    assert np.abs((numbers(found) - TRUE) / sigmas).max() < 4.5
    assert found.sigma == pytest.approx(1e-7, rel=0.15)


def test_the_optimum_is_the_numerical_one():
    rng = np.random.default_rng(3)
    true = field(rng, 100)
    modulus = np.linalg.norm(true, axis=1)
    read = true @ MATRIX + BIAS + 3e-7 * rng.normal(size=true.shape)
    found = calibrate_magnetometer(read, modulus, sigma=3e-7)
    assert found.used.all()

    def loss(y):
        matrix = np.array([[y[3], y[8], y[7]], [y[8], y[4], y[6]], [y[7], y[6], y[5]]])
        field = np.linalg.solve(matrix, (read - 1e-5 * y[:3]).T).T
        return np.sum(((np.linalg.norm(field, axis=1) - modulus - 9e-14 / modulus) / 3e-7) ** 2)

    size = np.where(np.arange(9) < 3, 1e-5, 1.0)
    best = minimize(loss, TRUE / size, method="BFGS", options={"gtol": 1e-4}).x * size
    sigmas = np.array(list(found.sigmas.values()))
    assert np.abs((numbers(found) - best) / sigmas).max() < 1e-2


def test_numbers_scatter_by_the_covariance():
    rng = np.random.default_rng(4)
    true = field(rng, 150)
    modulus = np.linalg.norm(true, axis=1)
    runs = [
        calibrate_magnetometer(true @ MATRIX + BIAS + 4e-7 * rng.normal(size=true.shape), modulus, sigma=4e-7)
        for _ in range(120)
    ]
    off = np.array([(numbers(run) - TRUE) / np.array(list(run.sigmas.values())) for run in runs])
    # Nine means and nine spreads of 120 runs.
    assert np.abs(off.mean(axis=0)).max() < 3.5 / np.sqrt(120)
    assert np.abs(off.std(axis=0) - 1.0).max() < 3.5 / np.sqrt(240)
    whole = [(numbers(run) - TRUE) @ np.linalg.solve(run.covariance, numbers(run) - TRUE) for run in runs]
    assert np.mean(whole) == pytest.approx(9.0, abs=3.5 * np.sqrt(18 / 120))


def test_what_the_readings_do_not_see_is_infinite():
    rng = np.random.default_rng(5)
    true = field(rng, 60)
    true[:, 2] = 0.0
    read = true + 1e-7 * rng.normal(size=true.shape) * [1.0, 1.0, 0.0]
    found = calibrate_magnetometer(read, np.linalg.norm(true, axis=1))
    assert np.isinf(found.sigmas["scale.z"]) and np.isinf(found.sigmas["bias.z"]) and found.sigmas["scale.x"] < 2e-3
    np.testing.assert_allclose(found.scale[:2], 1.0, atol=5e-3)
    plain = calibrate_magnetometer(true + BIAS, np.linalg.norm(true, axis=1), bias_only=True)
    np.testing.assert_allclose(plain.scale, 1.0)
    np.testing.assert_allclose(plain.bias[:2], BIAS[:2], atol=1e-6)


def test_too_few_readings():
    with pytest.raises(InputError, match="5 readings of a magnetometer, and a calibration needs more than 9"):
        calibrate_magnetometer(np.ones((5, 3)), np.ones(5))
