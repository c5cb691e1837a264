"""Gravity field: published numbers, the closed form of J2, the poles, Laplace's equation, derivatives."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.environment import GravityField, egm2008

evaluate = eqx.filter_jit(lambda field, point: field(point))
differentiate = eqx.filter_jit(lambda field, point: jax.jacfwd(field)(point))
potential = eqx.filter_jit(lambda field, point: field.potential(point))

MU, RADIUS = 3.986004415e14, 6378136.3
C20 = -4.84165143790815e-4
POINTS = [
    [0.0, 0.0, 7.0e6],
    [0.0, 0.0, -6.7e6],
    [1.0, -2.0, 7.0e6],
    [6.9e6, 0.0, 0.0],
    [5.0e6, -3.0e6, 4.1e6],
    [-2.0e7, 3.0e7, -1.0e7],
]


def test_coefficients_as_published():
    field = egm2008(20)
    zonals = [C20, 9.57161207093473e-7, 5.39965866638991e-7, 6.86702913736681e-8, -1.49953927978527e-7]
    zonals += [9.05120844521618e-8, 4.94756003005199e-8]
    np.testing.assert_array_equal(field.cosine[2:9, 0], zonals)
    assert (float(field.mu), float(field.radius)) == (MU, RADIUS)
    assert float(field.cosine[0, 0]) == 1.0
    assert not np.any(field.cosine[1]) and not np.any(field.sine[:, 0])
    for table in (field.cosine, field.sine):
        assert table.shape == (21, 21) and not np.any(np.triu(table, 1))
    # Each of the 228 rows of the file arrived: no coefficient of orders 1 to n is exactly zero.
    assert np.count_nonzero(field.cosine) == 229 and np.count_nonzero(field.sine) == 209
    # The rule of Kaula (1966), 1e-5/n^2 in the mean of each degree, is met within a factor of three.
    n = np.arange(3, 21)
    power = np.sqrt(np.sum(np.square([field.cosine, field.sine]), axis=(0, 2))[3:] / (2 * n + 1))
    assert np.all((power * n**2 < 3e-5) & (power * n**2 > 1e-5 / 3))


@pytest.mark.parametrize(
    ("degree", "expected"),
    [(8, (-5.4981989, 3.29902997, -4.52020982)), (2, (-5.4981347, 3.29891549, -4.52025008))],
)
def test_acceleration_check_values(degree, expected):
    np.testing.assert_allclose(evaluate(egm2008(degree), jnp.asarray(POINTS[4])), expected, atol=6e-9)


def test_degree_zero_is_a_point():
    for point in POINTS:
        r = float(np.linalg.norm(point))
        np.testing.assert_allclose(evaluate(egm2008(0), jnp.asarray(point)), -MU / r**3 * np.array(point), rtol=1e-14)
        np.testing.assert_allclose(potential(egm2008(0), jnp.asarray(point)), MU / r, rtol=1e-14)


@pytest.mark.parametrize("point", POINTS)
def test_oblateness_is_the_closed_form(point):
    """a = -mu/r^3 [1 + (3/2) J2 (R/r)^2 (1 - 5 z^2/r^2)] r, with 3 in place of 1 along z (Curtis 2014, eq. 12.30)."""
    j2 = -np.sqrt(5.0) * C20
    assert j2 == pytest.approx(1.0826e-3, abs=1e-7)
    x, y, z = point
    r = float(np.linalg.norm(point))
    factor, sine2 = 1.5 * j2 * (RADIUS / r) ** 2, (z / r) ** 2
    across, along = 1 + factor * (1 - 5 * sine2), 1 + factor * (3 - 5 * sine2)
    expected = -MU / r**3 * np.array([across * x, across * y, along * z])
    field = egm2008(2, 0)
    scale = MU / r**2
    np.testing.assert_allclose(evaluate(field, jnp.asarray(point)), expected, rtol=1e-14, atol=1e-15 * scale)
    energy = MU / r * (1 - j2 / 2 * (RADIUS / r) ** 2 * (3 * sine2 - 1))
    np.testing.assert_allclose(potential(field, jnp.asarray(point)), energy, rtol=2e-15)


@pytest.mark.parametrize("pole", [1.0, -1.0])
def test_poles_by_their_own_series(pole):
    """Only orders 0 and 1 reach the axis; P_n1 / cos latitude is sqrt(n (n + 1)/2), times (-1)^(n+1) in the south."""
    field = egm2008(20)
    n = np.arange(21)
    # Schmidt from fully normalised.
    c, s = (np.sqrt(2 * n + 1)[:, None] * np.asarray(t) for t in (field.cosine, field.sine))
    falling = MU / RADIUS**2 * (RADIUS / 6.8e6) ** (n + 2)
    tilt, parity = np.sqrt(n * (n + 1) / 2), pole ** (n + 1)
    expected = [
        np.sum(falling * tilt * parity * c[:, 1]),
        np.sum(falling * tilt * parity * s[:, 1]),
        -np.sum(falling * (n + 1) * parity * c[:, 0]),
    ]
    found = evaluate(field, jnp.asarray([0.0, 0.0, pole * 6.8e6]))
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-15)


def test_without_the_central_term_the_perturbation_is_left():
    field = egm2008(8)
    perturbation = eqx.tree_at(lambda f: f.cosine, field, field.cosine.at[0, 0].set(0.0))
    point = jnp.asarray(POINTS[4])
    whole, centre = evaluate(field, point), evaluate(egm2008(0), point)
    np.testing.assert_allclose(evaluate(perturbation, point), whole - centre, rtol=0, atol=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize("degree", [2, 20])
@pytest.mark.parametrize("point", POINTS)
def test_gradient_is_symmetric_traceless_and_the_difference(point, degree):
    field, point = egm2008(degree), jnp.asarray(point)
    jacobian = np.asarray(differentiate(field, point))
    scale = np.max(np.abs(jacobian))
    np.testing.assert_allclose(jacobian, jacobian.T, atol=1e-13 * scale)
    # Laplace's equation.
    assert abs(np.trace(jacobian)) < 1e-13 * scale
    h = 50.0
    moved = [np.asarray(evaluate(field, point + d) - evaluate(field, point - d)) / (2 * h) for d in h * np.eye(3)]
    # Rounding 1e-16 r/h of it, and h^2/6 of the third derivative, 20 (h/r)^2.
    np.testing.assert_allclose(jacobian, np.transpose(moved), atol=1e-8 * scale)


def test_acceleration_is_the_slope_of_the_potential():
    field = egm2008(20)
    slope = eqx.filter_jit(lambda f, x: jax.grad(f.potential)(x))
    for point in POINTS:
        acceleration = evaluate(field, jnp.asarray(point))
        scale = float(jnp.max(jnp.abs(acceleration)))
        np.testing.assert_allclose(slope(field, jnp.asarray(point)), acceleration, rtol=0, atol=1e-14 * scale)


@pytest.mark.slow
def test_coefficients_and_constants_may_be_fitted():
    field, point = egm2008(3), jnp.asarray(POINTS[4])
    slope = eqx.filter_jit(jax.jacfwd(lambda f: f(point)))(field)
    # Linear in the coefficients and in mu; in R by the differences.
    whole = np.asarray(evaluate(field, point))
    summed = jnp.tensordot(slope.cosine, field.cosine, 2) + jnp.tensordot(slope.sine, field.sine, 2)
    np.testing.assert_allclose(summed, whole, rtol=1e-13)
    np.testing.assert_allclose(slope.mu * field.mu, whole, rtol=1e-13)
    ends = [evaluate(GravityField(field.cosine, field.sine, MU, RADIUS + d), point) for d in (-100.0, 100.0)]
    # Rounding 1e-15 of gravity over 200 m.
    np.testing.assert_allclose(slope.radius, np.subtract(ends[1], ends[0]) / 200.0, rtol=0, atol=1e-16)
    # A sine of order zero, and orders above the degree, stand for nothing.
    assert not np.any(slope.sine[..., 0]) and not np.any(np.triu(slope.cosine, 1)) and np.all(slope.cosine[:, 3, 0])


@pytest.mark.slow
def test_single_precision_stays_single():
    """Within 1e-6 of gravity: a rounding of 6e-8 in position counts twice and more, the sums add as much."""
    field = egm2008(20)
    single = jax.tree.map(lambda x: x.astype(jnp.float32), field)
    points = np.random.default_rng(5).normal(size=(500, 3))
    points *= np.geomspace(6.5e6, 4e7, 500)[:, None] / np.linalg.norm(points, axis=1, keepdims=True)
    along = eqx.filter_jit(lambda f, x: jax.vmap(f)(x))
    found = along(single, jnp.asarray(points, jnp.float32))
    assert found.dtype == jnp.float32
    found, expected = np.asarray(found, float), np.asarray(along(field, jnp.asarray(points)))
    assert np.max(np.linalg.norm(found - expected, axis=1) / np.linalg.norm(expected, axis=1)) < 1e-6


@pytest.mark.parametrize(
    ("degree", "order", "message"),
    [(21, None, "degree must be in 0..20"), (-1, None, "degree"), (4, 5, "order must be in 0..4"), (4, -1, "order")],
)
def test_beyond_the_bundled_part(degree, order, message):
    with pytest.raises(ValueError, match=message):
        egm2008(degree, order)


def test_order_cuts_the_waves_in_longitude():
    field = egm2008(6, 2)
    assert not np.any(field.cosine[:, 3:]) and not np.any(field.sine[:, 3:])
    np.testing.assert_array_equal(field.cosine[:, :3], egm2008(6).cosine[:, :3])
