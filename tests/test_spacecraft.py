"""The satellite's own numbers: order of panels, tensor layout, moment of the rods, and that all of it can be fitted."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxsat.panel_names import PANEL_NAMES
from jaxsat.spacecraft import (
    HysteresisRods,
    MagneticRods,
    SolarPanels,
    Spacecraft,
    box_facets,
    box_normals,
    symmetric_tensor,
)

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
    # What is absent is no leaf; what is there is nothing but leaves.
    rods = HysteresisRods(AXES, MOMENTS, MOMENTS, MOMENTS, 2 * MOMENTS)
    whole = Spacecraft(craft.inertia, craft.magnet, RODS, panels, rods, box_facets((0.1, 0.2, 0.3)))
    added = jax.tree.leaves(whole)[len(leaves) :]
    assert sum(leaf.size for leaf in added) == (9 + 4 * 3 + 3) + (6 + 18 + 18 + 6 + 6 + 1)
    assert all(leaf.dtype == np.float64 for leaf in added)


def test_faces_of_a_box():
    size, shift = (0.1, 0.2, 0.3), (0.01, -0.02, 0.03)
    facets = box_facets(size, center_of_mass=shift, specular=0.2, diffuse=0.3, drag_coefficient=2.5)
    for k, name in enumerate(PANEL_NAMES):
        axis, sign = "xyz".index(name[1]), {"+": 1.0, "-": -1.0}[name[0]]
        middle = 0.5 * sign * size[axis] * np.eye(3)[axis]
        np.testing.assert_allclose(facets.centers[k], middle - shift, atol=1e-16)
        np.testing.assert_array_equal(facets.normals[k], sign * np.eye(3)[axis])
        others = [size[i] for i in range(3) if i != axis]
        assert float(facets.areas[k]) == others[0] * others[1]
    np.testing.assert_array_equal(facets.specular, 0.2)
    np.testing.assert_array_equal(facets.diffuse, 0.3)
    assert float(facets.drag_coefficient) == 2.5
    # Closed: the outward areas add up to nothing, and by Gauss the box's volume is a third of the flux of r.
    np.testing.assert_allclose(facets.areas @ facets.normals, 0.0, atol=1e-17)
    flux = np.sum(facets.areas * np.sum(facets.centers * facets.normals, axis=1))
    np.testing.assert_allclose(flux / 3, np.prod(size), rtol=1e-14)
    by_size = jax.jit(jax.jacrev(lambda size: box_facets(size).areas.sum()))(jnp.asarray(size))
    np.testing.assert_allclose(by_size, 2 * (np.sum(size) - np.array(size)), rtol=1e-14)
