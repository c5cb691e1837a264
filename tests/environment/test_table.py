"""Tables: rows are the single evaluations, and derivatives flow through to the orbit's elements."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxsat.environment import (
    ConeShadow,
    DiffuseAlbedo,
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


def test_greenwich_angle_advances_as_sidereal_time_does():
    later = EPOCH.shifted(4500.0)
    table = jax.jit(tabulate_orbit)(ORBIT, TIMES, FIELD, greenwich_angle(EPOCH))
    assert table.position_eci.shape == table.b_field_eci.shape == (19, 3)
    position, _ = ORBIT(TIMES[-1])
    expected = jax.jit(magnetic_field_eci)(FIELD, position, greenwich_angle(later))
    np.testing.assert_allclose(table.position_eci[-1], position, rtol=1e-13)
    # The rate of the mean angle against the apparent one: below 1e-9 rad over a session.
    np.testing.assert_allclose(table.b_field_eci[-1], expected, rtol=1e-7)


def test_rows_of_light():
    table = jax.jit(tabulate_light)(ORBIT, TIMES, SUN)
    assert table.diffuse_direction_eci.shape == (*table.diffuse_weight.shape, 3) == (19, 200, 3)
    assert set(np.unique(table.illumination)) == {0.0, 1.0}
    position, _ = ORBIT(TIMES[4])
    direction, factor = specular_albedo(position, SUN[4], 6371.2e3)
    np.testing.assert_allclose(table.specular_direction_eci[4], direction, atol=1e-12)
    np.testing.assert_allclose(table.specular_factor[4], factor, rtol=1e-12)
    assert all(np.all(np.isfinite(x)) for x in jax.tree.leaves(table))


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
