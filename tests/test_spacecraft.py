"""The satellite's own numbers: order of panels, tensor layout, moment of the rods, and that all of it can be fitted."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxsat.spacecraft import PANEL_NAMES, MagneticRods, SolarPanels, Spacecraft, box_normals, symmetric_tensor

MOMENTS, REFERENCE = np.array([0.03, 0.02, 0.05]), 3.0e-5
AXES = np.array([[0.0, 1.0, 0.0], [0.0, 0.6, 0.8], [-0.8, 0.0, 0.6]])
RODS = MagneticRods(jnp.asarray(MOMENTS), jnp.asarray(AXES), jnp.asarray(REFERENCE))
B = np.array([1.2e-5, -2.5e-5, 0.7e-5])


def test_normals_stand_in_the_order_of_the_names():
    for name, normal in zip(PANEL_NAMES, np.asarray(box_normals()), strict=True):
        expected = np.zeros(3)
        expected["xyz".index(name[1])] = {"+": 1.0, "-": -1.0}[name[0]]
        np.testing.assert_array_equal(normal, expected)


def test_tensor_from_six_components():
    found = symmetric_tensor(jnp.arange(1.0, 7.0))
    np.testing.assert_array_equal(found, [[1, 4, 5], [4, 2, 6], [5, 6, 3]])


def test_moment_of_rods():
    expected = sum(m * (B @ axis) / REFERENCE * axis for m, axis in zip(MOMENTS, AXES, strict=True))
    np.testing.assert_allclose(RODS.dipole(jnp.asarray(B)), expected, rtol=1e-14)
    # In the reference field along it, a rod has the moment that is quoted.
    one = MagneticRods(jnp.asarray([0.03]), jnp.asarray([[0.0, 1.0, 0.0]]), jnp.asarray(REFERENCE))
    np.testing.assert_allclose(one.dipole(jnp.asarray([0.0, REFERENCE, 0.0])), [0, 0.03, 0], rtol=1e-15)
    np.testing.assert_array_equal(RODS.dipole(jnp.zeros(3)), 0.0)
    fields = jnp.asarray(np.stack([B, 2 * B]))
    np.testing.assert_allclose(jax.jit(jax.vmap(RODS.dipole))(fields), np.stack([expected, 2 * expected]), rtol=1e-14)


def test_slopes_of_the_moment_are_those_of_a_linear_law():
    by_field = jax.jit(jax.jacrev(RODS.dipole))(jnp.asarray(B))
    expected = sum(m / REFERENCE * np.outer(a, a) for m, a in zip(MOMENTS, AXES, strict=True))
    # Largest slope 3000 A m^2 / T.
    np.testing.assert_allclose(by_field, expected, atol=1e-11)
    by_rods = jax.jit(jax.jacfwd(lambda rods: rods.dipole(jnp.asarray(B))))(RODS)
    np.testing.assert_allclose(by_rods.moments, ((AXES @ B) / REFERENCE * AXES.T), atol=1e-14)
    np.testing.assert_allclose(by_rods.reference_field, -expected @ B / REFERENCE, rtol=1e-12)


def test_every_number_is_a_leaf():
    panels = SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6))
    craft = Spacecraft(jnp.eye(3), jnp.asarray([0.3, 0, 0]), RODS, panels)
    leaves = jax.tree.leaves(craft)
    assert sum(leaf.size for leaf in leaves) == 9 + 3 + (3 + 9 + 1) + (18 + 1 + 6)
    assert all(leaf.dtype == np.float64 for leaf in leaves)
