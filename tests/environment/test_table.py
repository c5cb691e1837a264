"""Tables: rows are the single evaluations, and derivatives flow through to the orbit's elements."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.environment import (
    ConeShadow,
    CylinderShadow,
    DiffuseAlbedo,
    ExponentialAtmosphere,
    KeplerOrbit,
    apparent_sun,
    igrf_field,
    magnetic_field_eci,
    specular_albedo,
    tabulate_light,
    tabulate_orbit,
)
from jaxsat.time import Epoch, greenwich_angle

EPOCH = Epoch.from_utc(2001, 1, 18, 4, 54, 15)
ORBIT = KeplerOrbit(7630.026457e3, 0.072661, 1.6657226, 1.1313013, 0.2910495, -3.0602300)
TIMES = jnp.linspace(0.0, 4500.0, 19)
FIELD = igrf_field(EPOCH.decimal_year())
SUN = jnp.asarray(apparent_sun(EPOCH, np.asarray(TIMES))[0])


@pytest.mark.slow
def test_greenwich_angle_advances_as_sidereal_time_does():
    later = EPOCH.shifted(4500.0)
    table = jax.jit(tabulate_orbit)(ORBIT, TIMES, FIELD, greenwich_angle(EPOCH))
    assert table.position_eci.shape == table.b_field_eci.shape == (19, 3)
    position, _ = ORBIT(TIMES[-1])
    expected = jax.jit(magnetic_field_eci)(FIELD, position, greenwich_angle(later))
    np.testing.assert_allclose(table.position_eci[-1], position, rtol=1e-13)
    # The rate of the mean angle against the apparent one: below 1e-9 rad over a session.
    np.testing.assert_allclose(table.b_field_eci[-1], expected, rtol=1e-7)


@pytest.mark.slow
def test_rows_of_light():
    table = jax.jit(tabulate_light)(ORBIT, TIMES, SUN)
    assert table.diffuse_direction_eci.shape == (*table.diffuse_weight.shape, 3) == (19, 200, 3)
    assert set(np.unique(table.illumination)) == {0.0, 1.0}
    position, _ = ORBIT(TIMES[4])
    direction, factor = specular_albedo(position, SUN[4], 6371.2e3)
    np.testing.assert_allclose(table.specular_direction_eci[4], direction, atol=1e-12)
    np.testing.assert_allclose(table.specular_factor[4], factor, rtol=1e-12)
    assert all(np.all(np.isfinite(x)) for x in jax.tree.leaves(table))


@pytest.mark.slow
def test_derivatives_with_respect_to_elements_are_finite():
    diffuse = DiffuseAlbedo(rings=3, azimuths=4)

    def tables(orbit):
        return tabulate_orbit(orbit, TIMES, FIELD, 3.3376), tabulate_light(
            orbit, TIMES, SUN, shadow=ConeShadow(), diffuse=diffuse
        )

    jacobian = jax.jit(jax.jacfwd(tables))(ORBIT)
    assert all(np.all(np.isfinite(x)) for x in jax.tree.leaves(jacobian))
    slope = np.asarray(jacobian[0].position_eci.semi_major_axis)
    moved = [
        jax.jit(jax.vmap(KeplerOrbit(7630.026457e3 + h, 0.072661, 1.6657226, 1.1313013, 0.2910495, -3.0602300)))(TIMES)
        for h in (-1.0, 1.0)
    ]
    np.testing.assert_allclose(slope, (moved[1][0] - moved[0][0]) / 2, atol=1e-7)


tabulate = eqx.filter_jit(tabulate_orbit)


def test_entries_that_are_not_asked_for_are_absent():
    table = tabulate(ORBIT, TIMES, FIELD, 3.3376)
    assert len(jax.tree.leaves(table)) == 2
    assert table.b_rate_eci is table.air_velocity_eci is table.air_density is table.sun_eci is None
    assert table.solar_pressure is None
    with pytest.raises(ValueError, match="shadow is given without sun_eci"):
        tabulate_orbit(ORBIT, TIMES, FIELD, 3.3376, shadow=ConeShadow())


@pytest.mark.slow
def test_rate_of_the_field_along_the_orbit():
    """The field moves by the flight through it and by the turn of the Earth: the difference along the table."""
    h = 1.0
    times = (TIMES[:, None] + jnp.asarray([-h, 0.0, h])[None, :]).reshape(-1)
    table = tabulate(ORBIT, times, FIELD, 3.3376, field_rate=True)
    field = np.asarray(table.b_field_eci).reshape(-1, 3, 3)
    rate = np.asarray(table.b_rate_eci).reshape(-1, 3, 3)[:, 1]
    # Harmonics to degree 13 pass at 13 n or less: (13 x 9.5e-4)^2 / 6 = 3e-5 of the fastest, here far less.
    np.testing.assert_allclose(rate, (field[:, 2] - field[:, 0]) / (2 * h), atol=1e-5 * np.abs(rate).max())
    assert 2e-8 < np.abs(rate).max() < 1e-7


def test_any_orbit_will_do_and_the_air_is_that_of_its_places():
    """A circular orbit as a function: 500 km over a round Earth, where the air moves at 7612.6 - 501.0 m/s."""
    r, mu, rate = 6871e3, 3.986004415e14, 7.2921158553e-5
    n = np.sqrt(mu / r**3)

    def circle(t):
        c, s = jnp.cos(n * t), jnp.sin(n * t)
        return r * jnp.stack([c, s, 0.0 * t]), r * n * jnp.stack([-s, c, 0.0 * t])

    air = ExponentialAtmosphere(equatorial_radius=6371e3, flattening=0.0)
    table = tabulate(circle, TIMES, FIELD, 3.3376, atmosphere=air)
    density, velocity = np.asarray(table.air_density), np.asarray(table.air_velocity_eci)
    np.testing.assert_allclose(density, 6.967e-13, rtol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(velocity, axis=1), r * (n - rate), rtol=1e-12)
    np.testing.assert_allclose(np.sum(velocity * np.asarray(table.position_eci), axis=1), 0.0, atol=1e-3)


@pytest.mark.slow
def test_pressure_of_sunlight():
    sun, distance = apparent_sun(EPOCH, np.asarray(TIMES))
    table = tabulate(ORBIT, TIMES, FIELD, 3.3376, sun_eci=sun, sun_distance=distance)
    np.testing.assert_array_equal(table.sun_eci, sun)
    pressure = np.asarray(table.solar_pressure)
    # In January the Sun is near: 0.98394 AU. Its nominal irradiance is 1361 W/m^2 (Prsa et al. 2016), here 1367.
    t = np.asarray(TIMES)
    lit, dark = (t < 2720) | (t > 4035), (t > 2770) & (t < 3985)
    np.testing.assert_allclose(pressure[lit], 1361 / 299792458 / 0.98394**2, rtol=6e-3)
    # The cylinder's edges are at 2746.0 and 4008.6 s; the sample 4 s behind the first lies in the penumbra.
    np.testing.assert_array_equal(pressure[dark], 0.0)
    assert 0.1 < pressure[t == 2750.0][0] / pressure[0] < 0.5

    # At one astronomical unit by default, and with the shadow that is asked for.
    plain = tabulate(ORBIT, TIMES, FIELD, 3.3376, sun_eci=sun, shadow=CylinderShadow())
    assert set(np.unique(np.asarray(plain.solar_pressure))) == {0.0, 4.56e-6}


@pytest.mark.slow
def test_derivatives_of_all_entries_are_finite():
    turned = Rotation.from_euler("Z", 1.0).apply(np.array(SUN))

    def table(orbit):
        return tabulate_orbit(
            orbit, TIMES, FIELD, 3.3376, field_rate=True, atmosphere=ExponentialAtmosphere(), sun_eci=turned
        )

    slopes = jax.jit(jax.jacfwd(lambda orbit: (table(orbit),) * 2, has_aux=True))
    jacobian, _ = slopes(ORBIT)
    assert all(np.all(np.isfinite(x)) for x in jax.tree.leaves(jacobian))
    moved = [
        slopes(KeplerOrbit(7630.026457e3 + h, 0.072661, 1.6657226, 1.1313013, 0.2910495, -3.0602300))[1]
        for h in (-10.0, 10.0)
    ]
    for name in ("b_rate_eci", "air_velocity_eci", "air_density"):
        slope = np.asarray(getattr(jacobian, name).semi_major_axis)
        difference = (np.asarray(getattr(moved[1], name)) - np.asarray(getattr(moved[0], name))) / 20.0
        # Truncation (10 m / 60 km)^2.
        np.testing.assert_allclose(slope, difference, atol=1e-6 * np.abs(difference).max())
