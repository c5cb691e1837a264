"""Internal field: published values, closed-form dipole, Maxwell's equations, the poles."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.environment import (
    InternalField,
    dipole_field,
    dipole_from_pole,
    igrf_coefficients,
    igrf_dipole,
    igrf_field,
    magnetic_field_eci,
)
from jaxsat.time import Epoch

evaluate = eqx.filter_jit(lambda field, point: field(point))
complex_dipole = jax.jit(dipole_field)
differentiate = eqx.filter_jit(lambda field, point: jax.jacfwd(field)(point))

# The poles, a metre and ten kilometres from one, the equator, anywhere.
POINTS = [
    [0.0, 0.0, 7.0e6],
    [0.0, 0.0, -7.0e6],
    [7.2e6, 0.0, 0.0],
    [-3.1e6, 5.5e6, 4.0e6],
    [0.6, -0.8, 7.0e6],
    [6.0e3, 8.0e3, -7.0e6],
]


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


def closed_form_dipole(point, moment):
    """mu0/(4 pi r^3) (3 (m . e) e - m), with the magnetic constant of CODATA 2018."""
    r = np.linalg.norm(point)
    unit = np.asarray(point) / r
    return 1.25663706212e-6 / (4 * np.pi * r**3) * (3 * unit * (unit @ moment) - moment)


def test_dipoles_are_the_closed_form():
    field, dipole = igrf_field(2001.0, degree=1), igrf_dipole(2001.0)
    g, h = np.asarray(field.g), np.asarray(field.h)
    at_the_surface = np.array([g[1, 1], h[1, 1], g[1, 0]])
    for point in POINTS:
        r = np.linalg.norm(point)
        unit = np.array(point) / r
        expected = (6371.2e3 / r) ** 3 * (3 * unit * (unit @ at_the_surface) - at_the_surface)
        scale = float(np.linalg.norm(expected))
        np.testing.assert_allclose(evaluate(field, jnp.asarray(point)), expected, atol=1e-15 * scale, rtol=1e-13)
        np.testing.assert_allclose(evaluate(dipole, jnp.asarray(point)), expected, atol=1e-15 * scale, rtol=1e-13)
        # mu0/(4 pi) is 1e-7 but for 6e-10.
        absolute = closed_form_dipole(point, np.asarray(dipole.moment))
        np.testing.assert_allclose(evaluate(dipole, jnp.asarray(point)), absolute, rtol=1e-9, atol=1e-9 * scale)


def test_moment_of_the_earth():
    # IGRF-14, 2025.0: R^3/1e-7 sqrt(29350.0^2 + 1410.3^2 + 4545.5^2) nT.
    assert np.linalg.norm(igrf_dipole(2025.0).moment) == pytest.approx(7.6895e22, rel=1e-4)


# Alken et al. 2021, table 4, to 0.01 deg; latitudes on the ellipsoid WGS 84. These coefficients have not changed since.
@pytest.mark.parametrize(
    "year, latitude_deg, longitude_deg", [(1900, 78.68, -68.79), (1950, 78.55, -68.85), (1980, 78.88, -70.76)]
)
def test_north_geomagnetic_pole(year, latitude_deg, longitude_deg):
    x, y, z = -np.asarray(igrf_dipole(year).moment)
    geodetic = np.degrees(np.arctan(z / np.hypot(x, y) / (1 - 1 / 298.257223563) ** 2))
    assert (geodetic, np.degrees(np.arctan2(y, x))) == pytest.approx((latitude_deg, longitude_deg), abs=0.01)
    geocentric, longitude = np.arctan2(z, np.hypot(x, y)), np.arctan2(y, x)
    strength = float(np.linalg.norm([x, y, z]))
    again = dipole_from_pole(strength, latitude=geocentric, longitude=longitude)
    np.testing.assert_allclose(again.moment, [-x, -y, -z], rtol=1e-12)


def test_dipole_along_the_axis_points_north_over_the_equator():
    dipole = dipole_from_pole(8e22, latitude=np.pi / 2, longitude=1.0)
    b_field = evaluate(dipole, jnp.asarray([0.0, 7.0e6, 0.0]))
    np.testing.assert_allclose(b_field, [0.0, 0.0, 8e22 * 1e-7 / 7.0e6**3], atol=1e-20)


@pytest.mark.parametrize("point", POINTS)
def test_gradient_of_the_dipole_is_the_complex_step(point):
    dipole, step = igrf_dipole(2001.05), 1e-30
    gradient = np.asarray(differentiate(dipole, jnp.asarray(point)))
    for axis in range(3):
        moved = jnp.asarray(np.array(point) + 1j * step * np.eye(3)[axis])
        slope = np.imag(complex_dipole(moved, dipole.moment.astype(complex))) / step
        np.testing.assert_allclose(gradient[:, axis], slope, rtol=0, atol=2e-15 * np.max(np.abs(gradient)))


def test_moment_is_fitted_in_closed_form():
    moment, point = jnp.asarray([1e21, -2e22, 7e22]), jnp.asarray(POINTS[3])
    slope = np.asarray(jax.jit(jax.jacrev(dipole_field, argnums=1))(point, moment))
    for axis in range(3):
        expected = closed_form_dipole(POINTS[3], np.eye(3)[axis])
        np.testing.assert_allclose(slope[:, axis], expected, rtol=1e-9)


@pytest.mark.parametrize("degree", range(1, 14))
def test_coefficients_of_every_degree(degree):
    field, whole = igrf_field(2012.3, degree=degree), igrf_field(2012.3)
    assert field.g.shape == field.h.shape == (degree + 1, degree + 1)
    np.testing.assert_array_equal(field.g, whole.g[: degree + 1, : degree + 1])
    np.testing.assert_array_equal(field.h, whole.h[: degree + 1, : degree + 1])


@pytest.mark.parametrize("degree", [1, 2, 7, 13])
def test_poles_by_their_own_series(degree):
    """Only orders 0 and 1 reach the axis; P_n1 / cos latitude is sqrt(n (n + 1)/2), times (-1)^(n+1) in the south."""
    field = igrf_field(1987.6, degree=degree)
    g, h = np.asarray(field.g), np.asarray(field.h)
    n = np.arange(1, degree + 1)
    falling, slope = (6371.2e3 / 6.9e6) ** (n + 2), np.sqrt(n * (n + 1) / 2)
    for pole, parity in ((1.0, np.ones(degree)), (-1.0, (-1.0) ** (n + 1))):
        # The same parity serves order zero: P_n at the south pole is (-1)^n, and outward is -z.
        expected = [
            -np.sum(falling * parity * slope * g[1:, 1]),
            -np.sum(falling * parity * slope * h[1:, 1]),
            np.sum(falling * parity * (n + 1) * g[1:, 0]),
        ]
        found = evaluate(field, jnp.asarray([0.0, 0.0, pole * 6.9e6]))
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize("field", [igrf_dipole(2001.05), igrf_field(2001.05, degree=1), igrf_field(2001.05)])
@pytest.mark.parametrize("point", POINTS)
def test_gradient_is_curl_free_divergence_free_and_the_difference(point, field):
    point = jnp.asarray(point)
    jacobian = np.asarray(differentiate(field, point))
    scale = np.max(np.abs(jacobian))
    np.testing.assert_allclose(jacobian, jacobian.T, atol=1e-13 * scale)
    assert abs(np.trace(jacobian)) < 1e-13 * scale
    h = 50.0
    steps = h * np.eye(3)
    moved = [np.asarray(evaluate(field, point + s) - evaluate(field, point - s)) / (2 * h) for s in steps]
    np.testing.assert_allclose(jacobian, np.transpose(moved), atol=1e-8 * scale)


@pytest.mark.parametrize("field", [igrf_dipole(2001.05), igrf_field(2001.05)])
def test_reverse_mode_at_the_pole(field):
    pole = jnp.asarray(POINTS[0])
    np.testing.assert_allclose(
        jax.jit(jax.jacrev(field.__call__))(pole), differentiate(field, pole), rtol=1e-9, atol=1e-25
    )


@pytest.mark.slow
def test_field_is_linear_in_its_coefficients():
    field, point = igrf_field(2001.0), jnp.asarray(POINTS[3])
    gradient = eqx.filter_jit(jax.jacrev(lambda f: f(point)))(field)
    value = jnp.tensordot(gradient.g, field.g, 2) + jnp.tensordot(gradient.h, field.h, 2)
    np.testing.assert_allclose(value, evaluate(field, point), rtol=1e-12)


def test_centre_of_the_earth_is_refused():
    centre = np.zeros(3)
    for field in (igrf_field(2025.0), dipole_from_pole(8e22, latitude=1.4, longitude=0.0)):
        with pytest.raises(ValueError, match="no value at the centre of its source, and position is zero"):
            field(jnp.asarray(centre))


def test_axial_dipole_points_north_over_the_equator():
    g = jnp.zeros((2, 2)).at[1, 0].set(-3e-5)
    b_field = evaluate(InternalField(g, jnp.zeros((2, 2))), jnp.asarray([6371.2e3, 0.0, 0.0]))
    np.testing.assert_allclose(b_field, [0.0, 0.0, 3e-5], atol=1e-20)


def test_inertial_field_turns_with_the_earth():
    field, angle = igrf_field(2001.0), 0.7
    position_ecef = jnp.asarray(POINTS[3])
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    turned = eqx.filter_jit(magnetic_field_eci)
    b_field_eci = turned(field, jnp.asarray(turn @ np.asarray(position_ecef)), jnp.asarray(angle))
    np.testing.assert_allclose(b_field_eci, turn @ np.asarray(evaluate(field, position_ecef)), rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("field", [igrf_dipole(2001.0), igrf_field(2001.0)])
def test_single_precision_stays_single(field):
    """Within 1e-6 of the field, 0.06 nT: a rounding of 6e-8 in position counts 3 to 15 times, the sums add as much."""
    points = np.random.default_rng(5).normal(size=(500, 3))
    points *= np.geomspace(6371.2e3, 4e7, 500)[:, None] / np.linalg.norm(points, axis=1, keepdims=True)
    points[:6] = POINTS
    along = eqx.filter_jit(lambda f, x: jax.vmap(f)(x))
    single = jax.tree.map(lambda x: x.astype(jnp.float32), field)
    found = along(single, jnp.asarray(points, jnp.float32))
    assert found.dtype == jnp.float32
    found, expected = np.asarray(found, float), np.asarray(along(field, jnp.asarray(points)))
    assert np.max(np.linalg.norm(found - expected, axis=1) / np.linalg.norm(expected, axis=1)) < 1e-6
    slope = differentiate(single, jnp.asarray(points[0], jnp.float32))
    assert slope.dtype == jnp.float32 and np.all(np.isfinite(slope))


def test_coefficients_at_the_ends_and_outside():
    g, h = igrf_coefficients(1900.0)
    assert (g[1, 0], g[1, 1], h[1, 1]) == pytest.approx((-31543e-9, -2298e-9, 5922e-9))
    np.testing.assert_array_equal(igrf_coefficients(1900), (g, h))
    g, _ = igrf_coefficients(2030.0)
    assert g[1, 0] == pytest.approx(-29287.0e-9)
    for year in (1899.99, 2030.01, float("nan")):
        with pytest.raises(ValueError, match="decimal_year"):
            igrf_coefficients(year)
    for degree in (0, 14):
        with pytest.raises(ValueError, match=f"degree must be in 1..13, got {degree}"):
            igrf_field(2001.0, degree=degree)
