"""Field lines against the closed form of a dipole's, r = L cos^2(latitude), and the field that they follow."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.constants import EARTH_RADIUS_MEAN
from jaxsat.environment import dipole_from_pole, igrf_field
from jaxsat.environment.field_lines import FURTHEST, field_line

AXIAL = dipole_from_pole(7.8e22, latitude=jnp.pi / 2, longitude=0.0)


def start(distance: float, latitude_deg: float, longitude_deg: float = 40.0) -> jnp.ndarray:
    b, lon = np.radians([latitude_deg, longitude_deg])
    return jnp.asarray(distance * np.array([np.cos(b) * np.cos(lon), np.cos(b) * np.sin(lon), np.sin(b)]))


@pytest.mark.parametrize("latitude_deg", [-50.0, 5.0, 40.0])
def test_line_of_a_dipole(latitude_deg):
    line = np.asarray(field_line(AXIAL, start(7.6e6, latitude_deg)))
    distance = np.linalg.norm(line, axis=1)
    free = distance > EARTH_RADIUS_MEAN * 1.0001
    shell = distance[free] / (1.0 - (line[free, 2] / distance[free]) ** 2)
    # The midpoint rule with steps of 3 % of the distance.
    np.testing.assert_allclose(shell, shell[0], rtol=2e-3)
    # Both feet on the sphere, at the conjugate latitudes of the shell.
    np.testing.assert_allclose(distance[[0, -1]], EARTH_RADIUS_MEAN, rtol=1e-12)
    foot = np.arccos(np.sqrt(EARTH_RADIUS_MEAN / shell[0]))
    np.testing.assert_allclose(np.arcsin(line[[0, -1], 2] / distance[[0, -1]]), [-foot, foot], atol=0.03)
    assert line[-1, 2] > 0.0, "the field points north outside the Earth"


def test_open_line_ends():
    line = np.asarray(field_line(AXIAL, start(7.0e6, 85.0), steps=200))
    distance = np.linalg.norm(line, axis=1)
    assert distance.max() < 1.1 * FURTHEST and np.isfinite(line).all()
    assert np.array_equal(line[0], line[1]), "given up, not gone on"


def test_middle_is_the_position_and_the_line_follows_the_field():
    field, position = igrf_field(2001.05), start(7.6e6, 20.0)
    line, b = (np.asarray(each) for each in jax.jit(lambda r: (field_line(field, r, steps=3), field(r)))(position))
    np.testing.assert_array_equal(line[3], position)
    along = line[4] - line[2]
    assert along @ b / np.linalg.norm(along) / np.linalg.norm(b) > 0.9995


def test_gradient_is_that_of_differences():
    @jax.jit
    def foot(position):
        return field_line(AXIAL, position, steps=20)[-1]

    position, change = start(7.6e6, 20.0), jnp.array([0.3, -0.5, 0.8])
    _, derivative = jax.jvp(foot, (position,), (change,))
    h = 10.0
    difference = (foot(position + h * change) - foot(position - h * change)) / (2.0 * h)
    np.testing.assert_allclose(derivative, difference, rtol=1e-7, atol=1e-8)


def test_derivative_is_finite_where_the_line_has_landed():
    jacobian = jax.jit(jax.jacfwd(lambda r: field_line(AXIAL, r)[jnp.array([0, -1])]))(start(7.6e6, 30.0))
    assert np.isfinite(jacobian).all() and np.abs(jacobian).max() > 0.1
