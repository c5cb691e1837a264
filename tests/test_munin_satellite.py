"""Munin from its numbers: each in its place. What moves it is in `tests/torques/test_munin.py`."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxsat.munin import munin_panels, munin_satellite
from jaxsat.spacecraft import box_normals


def test_each_number_has_its_place():
    gains = jnp.asarray([1.0, 1.1, 0.9, 1.0, 1.2, 0.8])
    panels = jax.jit(munin_panels)(jnp.asarray(0.24), gains, jnp.zeros((6, 2)).at[0, 1].set(0.1))
    craft = munin_satellite(
        jnp.arange(1.0, 7.0),
        jnp.asarray([0.3, 0.0, 0.04]),
        jnp.asarray([0.03, 0.02]),
        reference_field=jnp.asarray(3e-5),
        panels=panels,
    )
    np.testing.assert_array_equal(craft.inertia, [[1, 4, 5], [4, 2, 6], [5, 6, 3]])
    np.testing.assert_array_equal(craft.magnet, [0.3, 0.0, 0.04])
    assert craft.rods is not None and craft.panels is panels and craft.facets is None and craft.parts == ()
    # In the reference field along its axis a rod has the moment of its name.
    np.testing.assert_allclose(craft.rods.dipole(jnp.full(3, 3e-5)), [0.0, 0.03, 0.02], rtol=1e-14)
    assert float(panels.max_current) == 0.24
    np.testing.assert_array_equal(panels.gains, gains)
    # A right-handed turn about body z carries +x towards y.
    np.testing.assert_allclose(panels.normals[0], [np.cos(0.1), np.sin(0.1), 0.0], atol=1e-15)
    np.testing.assert_array_equal(panels.normals[1:], box_normals()[1:])
