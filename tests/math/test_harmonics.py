"""Harmonic sums: each harmonic by SciPy's Legendre functions, the gradient by complex step, Laplace's equation."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import lpmv

from jaxsat.math import gradient_coefficients, harmonic_sums

SIZE = 22
RADIUS = 6.4e6
SUMS = jax.jit(jax.vmap(harmonic_sums, in_axes=(0, None, None)))
SLOPE = jax.jit(jax.vmap(jax.grad(lambda x, c: harmonic_sums(x, c[None], RADIUS)[0]), in_axes=(0, None)))
JACOBIAN = jax.jit(jax.vmap(jax.jacfwd(harmonic_sums), in_axes=(0, None, None)))
GRADIENT = jax.jit(gradient_coefficients)
POINTS = np.array(
    [
        [6.5e6, 0.0, 0.0],
        [-3.1e6, 5.5e6, 4.0e6],
        [2.0e6, 1.0e6, -6.8e6],
        [0.0, 0.0, 6.6e6],
        [0.0, 0.0, -9.0e6],
        [3.0e7, -2.0e7, 1.0e7],
        [1.0, -2.0, 7.0e6],
    ]
)
# A metre from the axis the cosine of the latitude, taken from its sine, loses nine digits: not for SciPy.
FOR_SCIPY = POINTS[:-1]


def random_coefficients(size, seed=3):
    """Coefficients that a planet might have: they fall with degree as 1/n^2 (rule of Kaula)."""
    falling = 1.0 / np.maximum(1.0, np.arange(size)) ** 2
    return np.tril(np.random.default_rng(seed).normal(size=(2, size, size)) * falling[:, None])


def sums_by_scipy(points, coefficients):
    """The sum term by term, in spherical coordinates."""
    r, longitude = np.linalg.norm(points, axis=1), np.arctan2(points[:, 1], points[:, 0])
    sine = points[:, 2] / r
    total = np.zeros(len(points))
    for n in range(coefficients.shape[-1]):
        for m in range(n + 1):
            # SciPy's functions carry the sign of Condon and Shortley and no normalisation.
            schmidt = (-1) ** m * math.sqrt((2 - (m == 0)) * math.factorial(n - m) / math.factorial(n + m))
            c, s = coefficients[:, n, m]
            wave = c * np.cos(m * longitude) + s * np.sin(m * longitude)
            total += (RADIUS / r) ** (n + 1) * schmidt * lpmv(m, n, sine) * wave
    return total


@pytest.mark.slow
def test_every_harmonic_to_degree_21():
    orders, degrees = np.meshgrid(np.arange(SIZE), np.arange(SIZE))
    below = orders <= degrees
    n, m = degrees[below], orders[below]
    alone = np.zeros((len(n), 2, SIZE, SIZE))
    alone[np.arange(len(n)), :, n, m] = 1.0, 0.7
    found = np.asarray(SUMS(jnp.asarray(FOR_SCIPY), jnp.asarray(alone), RADIUS))
    for k in range(len(n)):
        expected = sums_by_scipy(FOR_SCIPY, alone[k])
        # Rounding of the argument of a Legendre polynomial of degree 21 grows by its slope, 21 * 22 / 2.
        np.testing.assert_allclose(found[:, k], expected, atol=231 * 4 * 2.2e-16, err_msg=f"{n[k]}, {m[k]}")


@pytest.mark.parametrize("size", [1, 2, 9])
def test_sum_of_any_size(size):
    coefficients = random_coefficients(size)
    found = SUMS(jnp.asarray(FOR_SCIPY), jnp.asarray(coefficients[None]), RADIUS)
    np.testing.assert_allclose(found[:, 0], sums_by_scipy(FOR_SCIPY, coefficients), rtol=1e-13, atol=1e-14)


def test_coefficients_without_a_harmonic_mean_nothing():
    coefficients = random_coefficients(9)
    coefficients[1, :, 0] = 0.0
    junk = coefficients + np.triu(np.ones((9, 9)), 1)
    junk[1, :, 0] = 1.0
    for with_junk, without in (
        (jnp.asarray(junk[None]), jnp.asarray(coefficients[None])),
        (GRADIENT(jnp.asarray(junk)), GRADIENT(jnp.asarray(coefficients))),
    ):
        found, expected = (SUMS(jnp.asarray(POINTS), c, RADIUS) for c in (with_junk, without))
        np.testing.assert_array_equal(found, expected)


@pytest.mark.slow
@pytest.mark.parametrize("size", [1, 21])
def test_gradient_is_the_complex_step_and_the_derivative(size):
    coefficients = jnp.asarray(random_coefficients(size))
    of_gradient = GRADIENT(coefficients)
    assert of_gradient.shape == (3, 2, size + 1, size + 1)
    gradient = np.asarray(SUMS(jnp.asarray(POINTS), of_gradient, RADIUS)) / RADIUS
    step = 1e-30
    for axis in range(3):
        moved = POINTS + 1j * step * np.eye(3)[axis]
        sums = SUMS(jnp.asarray(moved), coefficients[None].astype(complex), RADIUS)
        # Sums of up to 21 degrees, each with a rounding error of its own slope.
        np.testing.assert_allclose(np.imag(sums[:, 0]) / step, gradient[:, axis], rtol=0, atol=2e-13 / RADIUS)
    np.testing.assert_allclose(SLOPE(jnp.asarray(POINTS), coefficients), gradient, rtol=0, atol=2e-13 / RADIUS)


@pytest.mark.slow
def test_second_derivatives_are_symmetric_and_traceless():
    coefficients = GRADIENT(jnp.asarray(random_coefficients(14)))
    again = jax.jit(jax.vmap(GRADIENT))(coefficients).reshape(9, 2, 16, 16)
    hessian = np.asarray(SUMS(jnp.asarray(POINTS), again, RADIUS)).reshape(-1, 3, 3) / RADIUS
    jacobian = JACOBIAN(jnp.asarray(POINTS), coefficients, RADIUS)
    scale = np.max(np.abs(hessian), axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(np.asarray(jacobian) / scale, hessian / scale, rtol=0, atol=3e-13)
    np.testing.assert_allclose(hessian / scale, hessian.transpose(0, 2, 1) / scale, rtol=0, atol=3e-13)
    np.testing.assert_allclose(np.trace(hessian / scale, axis1=1, axis2=2), 0.0, atol=3e-13)


def test_slope_along_the_radius_of_reference():
    coefficients = jnp.asarray(random_coefficients(6))[None]
    point = jnp.asarray(POINTS[1])
    slope = jax.jit(jax.grad(lambda radius: harmonic_sums(point, coefficients, radius)[0]))(jnp.asarray(RADIUS))
    h = 1e3
    ends = [SUMS(point[None], coefficients, RADIUS + s)[0, 0] for s in (-h, h)]
    # The difference errs by h^2/6 of the third derivative, about (6 h/R)^2 of the slope.
    np.testing.assert_allclose(slope, (ends[1] - ends[0]) / (2 * h), rtol=1e-6)
