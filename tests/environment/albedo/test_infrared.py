"""The Earth's brightness: size and correlation of the random field, and that the table is read where it was written."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.constants import EARTH_RADIUS_MEAN
from jaxsat.environment.albedo.infrared import CELLS, BrightnessMap, octahedral_nodes, random_brightness

quick = functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 0})
read = quick(lambda field, ground: field(ground))


def directions(count, seed=1):
    v = np.random.default_rng(seed).normal(size=(count, 3))
    return v / np.linalg.norm(v, axis=1)[:, None]


def test_nodes_are_read_where_they_are_and_smooth_fields_between_them():
    nodes = octahedral_nodes()
    field = BrightnessMap(jnp.asarray(nodes @ [0.2, -0.5, 0.8] + nodes[:, 0] * nodes[:, 2]))
    np.testing.assert_allclose(read(field, jnp.asarray(nodes)), field.table, atol=1e-12)
    # A poor man's pole, seam and edge are among random directions; the error is that of 1.4 deg to 2.8 deg cells.
    ground = directions(4000)
    np.testing.assert_allclose(
        read(field, jnp.asarray(ground)), ground @ [0.2, -0.5, 0.8] + ground[:, 0] * ground[:, 2], atol=2e-3
    )
    assert len(nodes) == (CELLS + 1) ** 2


@pytest.mark.slow
def test_the_field_has_the_published_correlation():
    """Over 4 draws: variance one, and exp(-L/R) at several distances, in pairs with all directions."""
    here = directions(3000)
    across = np.cross(here, directions(3000, 2))
    across /= np.linalg.norm(across, axis=1)[:, None]
    products = []
    for seed in range(4):
        field = random_brightness(seed)
        values = np.asarray(read(field, jnp.asarray(here)))
        row = [np.mean(values**2)]
        for distance_km in (350.0, 700.0, 1400.0, 2800.0):
            angle = distance_km * 1e3 / EARTH_RADIUS_MEAN
            row.append(
                np.mean(values * np.asarray(read(field, jnp.asarray(np.cos(angle) * here + np.sin(angle) * across))))
            )
        products.append(row)
    variance, *covariances = np.mean(products, axis=0)
    # Interpolation between nodes takes an eighth of the variance of so rough a field.
    assert 0.8 < variance < 1.05
    np.testing.assert_allclose(covariances, np.exp(-np.array([0.5, 1.0, 2.0, 4.0])), atol=0.08)


@pytest.mark.slow
def test_a_seed_is_a_field():
    assert np.array_equal(random_brightness(3).table, random_brightness(3).table)
    assert np.std(random_brightness(3).table - random_brightness(4).table) > 1.0


@pytest.mark.slow
def test_slopes_are_those_of_finite_differences():
    field, ground = random_brightness(0), jnp.asarray(directions(20))
    along = jnp.asarray(directions(20, 5))
    h = 1e-7
    _, slope = quick(lambda g, d: jax.jvp(lambda g: field(g), (g,), (d,)))(ground, along)
    difference = (read(field, ground + h * along) - read(field, ground - h * along)) / (2 * h)
    np.testing.assert_allclose(slope, difference, rtol=1e-5, atol=1e-5)
