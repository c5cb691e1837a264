"""The turn to be made against SciPy's rotations, and by what it does."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.control.attitude_error import modified_rodrigues, rate_command, turn_toward

turn, parameters, command = jax.jit(turn_toward), jax.jit(modified_rodrigues), jax.jit(rate_command)
turns, many_parameters = jax.jit(jax.vmap(turn_toward)), jax.jit(jax.vmap(modified_rodrigues))
X, Y = jnp.array([1.0, 0.0, 0.0]), jnp.array([0.0, 1.0, 0.0])


def random_units(count, seed=0):
    v = np.random.default_rng(seed).normal(size=(count, 3))
    return jnp.asarray(v / np.linalg.norm(v, axis=1, keepdims=True))


slope_of = jax.jit(jax.jacfwd(lambda target, sun: modified_rodrigues(turn_toward(target, sun)), argnums=1))


def rotated(q, v):
    return Rotation.from_quat(np.array(q), scalar_first=True).apply(np.array(v))


def of_vector(v):
    return jnp.asarray(Rotation.from_rotvec(v).as_quat(scalar_first=True))


def test_modified_rodrigues_parameters_are_those_of_scipy():
    q = np.random.default_rng(1).normal(size=(50, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    ours = many_parameters(jnp.asarray(q))
    # SciPy too takes the shorter way round.
    np.testing.assert_allclose(ours, Rotation.from_quat(q, scalar_first=True).as_mrp(), atol=1e-14)
    np.testing.assert_allclose(ours, many_parameters(jnp.asarray(-q)), atol=1e-15)
    assert np.all(np.linalg.norm(ours, axis=1) <= 1.0 + 1e-12)


def test_the_turn_brings_the_target_onto_the_sun():
    target, sun = random_units(200), random_units(200, seed=2)
    q = turns(target, sun)
    np.testing.assert_allclose(rotated(q, target), sun, atol=1e-14)
    angle = 4.0 * np.arctan(np.linalg.norm(many_parameters(q), axis=1))
    # And by no more than it must.
    np.testing.assert_allclose(angle, np.arccos(np.sum(np.asarray(target * sun), axis=1)), atol=1e-7)


@pytest.mark.parametrize("target", [X, Y, jnp.array([0.0, 0.0, 1.0]), jnp.array([0.6, 0.0, -0.8])])
def test_aligned_and_opposite(target):
    q = turn(target, target)
    np.testing.assert_allclose(q, [1.0, 0.0, 0.0, 0.0], atol=1e-15)
    q = turn(target, -target)
    np.testing.assert_allclose(rotated(q, target), -target, atol=1e-15)
    for sun in (target, -target):
        slope = slope_of(target, sun)
        assert np.all(np.isfinite(slope))


def test_derivative_of_the_error():
    target, sun = random_units(1)[0], random_units(1, seed=3)[0]

    def error(s):
        return modified_rodrigues(turn_toward(target, s / jnp.linalg.norm(s)))

    slope, h = jax.jit(jax.jacfwd(error))(sun), 1e-6
    error = jax.jit(error)
    for k in range(3):
        step = h * np.eye(3)[k]
        np.testing.assert_allclose(slope[:, k], (error(sun + step) - error(sun - step)) / (2 * h), atol=1e-8)


def test_rate_command_is_proportional_and_limited():
    small = parameters(of_vector([0.0, 1e-3, 0.0]))
    np.testing.assert_allclose(command(small, 0.05, 0.01), [0.0, 5e-5, 0.0], rtol=1e-6)
    large = parameters(of_vector([0.0, -2.0, 2.0]))
    np.testing.assert_allclose(command(large, 0.05, 0.01), 0.01 / np.sqrt(2.0) * np.array([0, -1, 1]), rtol=1e-9)
    np.testing.assert_array_equal(command(jnp.zeros(3), 0.05, 0.01), 0.0)
