"""Internal field: published values, closed-form dipole, Maxwell's equations, the poles."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.environment import InternalField, igrf_coefficients, igrf_field, magnetic_field_eci
from jaxsat.time import Epoch

evaluate = eqx.filter_jit(lambda field, point: field(point))
differentiate = eqx.filter_jit(lambda field, point: jax.jacfwd(field)(point))

POINTS = [[0.0, 0.0, 7.0e6], [0.0, 0.0, -7.0e6], [7.2e6, 0.0, 0.0], [-3.1e6, 5.5e6, 4.0e6]]


def spherical_components(field, r_km, colatitude_deg, longitude_deg):
    theta, phi = np.radians([colatitude_deg, longitude_deg])
    (st, sp), (ct, cp) = np.sin([theta, phi]), np.cos([theta, phi])
    axes = np.array([[st * cp, st * sp, ct], [ct * cp, ct * sp, -st], [-sp, cp, 0.0]])
    return axes @ np.asarray(evaluate(field, jnp.asarray(r_km * 1e3 * axes[0]))) * 1e9


@pytest.mark.parametrize(
    "r_km, colatitude_deg, longitude_deg, date, expected_nt",
    [
        (6371.2, 60, 30, (2000, 1, 1), (-29938.4913, -30782.2591, 1545.7625)),
        (7630.026457, 45, 100, (2001, 1, 18, 4, 54, 15), (-27979.3151, -14244.6784, -260.2592)),
        (7098.137, 120, -60, (2025, 1, 1), (10242.5309, -13754.8951, -2180.2003)),
    ],
)
def test_igrf_14_check_values(r_km, colatitude_deg, longitude_deg, date, expected_nt):
    field = igrf_field(Epoch.from_utc(*date).decimal_year())
    np.testing.assert_allclose(spherical_components(field, r_km, colatitude_deg, longitude_deg), expected_nt, atol=6e-5)


def test_centred_dipole_is_the_closed_form():
    field = igrf_field(2001.0, degree=1)
    g, h = np.asarray(field.g), np.asarray(field.h)
    moment = np.array([g[1, 1], h[1, 1], g[1, 0]]) * 6371.2e3**3
    for point in POINTS:
        r = np.linalg.norm(point)
        unit = np.array(point) / r
        expected = (3 * unit * (unit @ moment) - moment) / r**3
        np.testing.assert_allclose(evaluate(field, jnp.asarray(point)), expected, rtol=1e-13)


@pytest.mark.parametrize("degree", [1, 2, 13])
@pytest.mark.parametrize("point", POINTS)
def test_gradient_is_curl_free_divergence_free_and_the_difference(point, degree):
    field, point = igrf_field(2001.05, degree=degree), jnp.asarray(point)
    jacobian = np.asarray(differentiate(field, point))
    scale = np.max(np.abs(jacobian))
    np.testing.assert_allclose(jacobian, jacobian.T, atol=1e-13 * scale)
    assert abs(np.trace(jacobian)) < 1e-13 * scale
    h = 50.0
    steps = h * np.eye(3)
    moved = [np.asarray(evaluate(field, point + s) - evaluate(field, point - s)) / (2 * h) for s in steps]
    np.testing.assert_allclose(jacobian, np.transpose(moved), atol=1e-8 * scale)


def test_reverse_mode_at_the_pole():
    field, pole = igrf_field(2001.05), jnp.asarray(POINTS[0])
    np.testing.assert_allclose(jax.jit(jax.jacrev(field))(pole), differentiate(field, pole), rtol=1e-9, atol=1e-25)


def test_field_is_linear_in_its_coefficients():
    field, point = igrf_field(2001.0), jnp.asarray(POINTS[3])
    gradient = eqx.filter_jit(jax.jacrev(lambda f: f(point)))(field)
    value = jnp.tensordot(gradient.g, field.g, 2) + jnp.tensordot(gradient.h, field.h, 2)
    np.testing.assert_allclose(value, evaluate(field, point), rtol=1e-12)


def test_axial_dipole_points_north_over_the_equator():
    g = jnp.zeros((2, 2)).at[1, 0].set(-3e-5)
    b_field = evaluate(InternalField(g, jnp.zeros((2, 2))), jnp.asarray([6371.2e3, 0.0, 0.0]))
    np.testing.assert_allclose(b_field, [0.0, 0.0, 3e-5], atol=1e-20)


def test_inertial_field_turns_with_the_earth():
    field, angle = igrf_field(2001.0), 0.7
    position_ecef = jnp.asarray(POINTS[3])
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    b_field_eci = magnetic_field_eci(field, jnp.asarray(turn @ np.asarray(position_ecef)), jnp.asarray(angle))
    np.testing.assert_allclose(b_field_eci, turn @ np.asarray(evaluate(field, position_ecef)), rtol=1e-12)


def test_single_precision_stays_single():
    field = jax.tree.map(lambda x: x.astype(jnp.float32), igrf_field(2001.0))
    value = evaluate(field, jnp.asarray(POINTS[3], jnp.float32))
    assert value.dtype == jnp.float32
    np.testing.assert_allclose(value, evaluate(igrf_field(2001.0), jnp.asarray(POINTS[3])), rtol=2e-5)


def test_coefficients_at_the_ends_and_outside():
    g, h = igrf_coefficients(1900.0)
    assert (g[1, 0], g[1, 1], h[1, 1]) == pytest.approx((-31543e-9, -2298e-9, 5922e-9))
    g, _ = igrf_coefficients(2030.0)
    assert g[1, 0] == pytest.approx(-29287.0e-9)
    for year in (1899.99, 2030.01, float("nan")):
        with pytest.raises(ValueError, match="decimal_year"):
            igrf_coefficients(year)
    with pytest.raises(ValueError, match="degree"):
        igrf_field(2001.0, degree=14)
