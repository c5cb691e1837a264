"""The turn to be made against SciPy's rotations and differences, and the rate that it asks for."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.control.attitude_error import modified_rodrigues, rate_command
from jaxsat.math import quaternion


def random_unit(seed):
    v = np.random.default_rng(seed).normal(size=(1, 3))
    return jnp.asarray(v[0] / np.linalg.norm(v))


def error_toward(target, sun):
    """Of a body whose `target` is to look along `sun`."""
    return modified_rodrigues(quaternion.shortest_turn(target, sun))


def test_modified_rodrigues_parameters_are_those_of_scipy():
    q = np.random.default_rng(1).normal(size=(50, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    ours = jax.vmap(modified_rodrigues)(jnp.asarray(q))
    # SciPy too takes the shorter way round.
    np.testing.assert_allclose(ours, Rotation.from_quat(q, scalar_first=True).as_mrp(), atol=1e-14)
    np.testing.assert_allclose(ours, jax.vmap(modified_rodrigues)(jnp.asarray(-q)), atol=1e-15)
    assert np.all(np.linalg.norm(ours, axis=1) <= 1.0 + 1e-12)


@pytest.mark.parametrize("target", [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.6, 0.0, -0.8]])
def test_error_has_slopes_when_aligned_and_opposite(target):
    target = jnp.array(target)
    for sun in (target, -target):
        assert np.all(np.isfinite(jax.jacfwd(error_toward, argnums=1)(target, sun)))


def test_derivative_of_the_error():
    target, sun = random_unit(0), random_unit(3)

    def error(s):
        return error_toward(target, s / jnp.linalg.norm(s))

    slope, h = jax.jacfwd(error)(sun), 1e-6
    for k in range(3):
        step = h * jnp.eye(3)[k]
        np.testing.assert_allclose(slope[:, k], (error(sun + step) - error(sun - step)) / (2 * h), atol=1e-8)


def test_rate_command_is_proportional_and_limited():
    small = modified_rodrigues(quaternion.from_rotation_vector(jnp.array([0.0, 1e-3, 0.0])))
    np.testing.assert_allclose(rate_command(small, 0.05, 0.01), [0.0, 5e-5, 0.0], rtol=1e-6)
    large = modified_rodrigues(quaternion.from_rotation_vector(jnp.array([0.0, -2.0, 2.0])))
    np.testing.assert_allclose(rate_command(large, 0.05, 0.01), 0.01 / np.sqrt(2.0) * np.array([0, -1, 1]), rtol=1e-9)
    np.testing.assert_array_equal(rate_command(jnp.zeros(3), 0.05, 0.01), 0.0)
