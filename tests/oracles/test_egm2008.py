"""The gravity field against brahe, an independent implementation with its own copy of EGM2008."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.constants import EARTH_EQUATORIAL_RADIUS, EARTH_MU
from jaxsat.environment import egm2008

brahe = pytest.importorskip("brahe")

MODEL = brahe.GravityModel.from_model_type(brahe.GravityModelType.EGM2008_120)


def random_points(count):
    """Directions all over the sphere, heights from 150 km to 40 000 km, and both poles with points beside them."""
    rng = np.random.default_rng(8)
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    points = direction * (6378e3 + np.geomspace(150e3, 4e7, count))[:, None]
    points[:4] = [[0, 0, 6.9e6], [0, 0, -6.9e6], [1.0, -2.0, 7.0e6], [3.0e3, 4.0e3, -7.1e6]]
    return points


def test_coefficients_and_constants():
    field = egm2008(20)
    assert (EARTH_MU, EARTH_EQUATORIAL_RADIUS) == (MODEL.gm, MODEL.radius)
    assert str(MODEL.tide_system).endswith("TideFree") and str(MODEL.normalization).endswith("FullyNormalized")
    for n in range(21):
        for m in range(n + 1):
            assert (float(field.cosine[n, m]), float(field.sine[n, m])) == MODEL.get(n, m), (n, m)


@pytest.mark.parametrize(("degree", "order"), [(2, 2), (8, 8), (20, 20), (20, 7), (8, 0)])
def test_acceleration(degree, order):
    points = random_points(300)
    found = np.asarray(jax.jit(jax.vmap(egm2008(degree, order).__call__))(jnp.asarray(points)))
    expected = np.array([MODEL.compute_spherical_harmonics(point, degree, order) for point in points])
    error = np.linalg.norm(found - expected, axis=1) / np.linalg.norm(expected, axis=1)
    # Each rounds a dozen operations on the central term in double precision, 2.2e-16.
    assert np.max(error) < 3e-15
