"""The least turn from one direction to another: where it leads, by how much, and at aligned and opposite ones."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.math import quaternion

RNG = np.random.default_rng(0)


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


AXES = np.concatenate([np.eye(3), -np.eye(3), [[0.6, 0.0, -0.8]], unit(RNG.normal(size=(5, 3)))])

turns = jax.jit(jax.vmap(quaternion.shortest_turn))
slopes = jax.jit(jax.vmap(jax.jacfwd(quaternion.shortest_turn, argnums=(0, 1))))


def turns_of(a, b) -> Rotation:
    q = np.asarray(turns(jnp.asarray(a), jnp.asarray(b)))
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0, atol=1e-14)
    return Rotation.from_quat(q, scalar_first=True)


def test_one_vector_is_carried_onto_the_other_and_no_further():
    a, b = unit(RNG.normal(size=(2, 200, 3)))
    found = turns_of(a, b)
    np.testing.assert_allclose(found.apply(a), b, atol=1e-14)
    angle = 2.0 * np.arcsin(0.5 * np.linalg.norm(a - b, axis=1))
    np.testing.assert_allclose(found.magnitude(), angle, atol=1e-12)


def test_aligned_vectors_need_no_turn():
    found = np.asarray(turns(jnp.asarray(AXES), jnp.asarray(AXES)))
    np.testing.assert_allclose(found, np.tile([1.0, 0.0, 0.0, 0.0], (len(AXES), 1)), atol=1e-15)


def test_opposite_vectors_are_half_a_turn_apart():
    found = turns_of(AXES, -AXES)
    np.testing.assert_allclose(found.apply(AXES), -AXES, atol=2e-15)
    np.testing.assert_allclose(found.magnitude(), np.pi, atol=1e-12)
    # Just short of opposite the axis is still well defined.
    near = unit(-AXES + 1e-5 * unit(np.cross(AXES, [0.3, 0.5, 0.7])))
    np.testing.assert_allclose(turns_of(AXES, near).apply(AXES), near, atol=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0], ids=["aligned", "opposite"])
def test_slopes_are_finite_where_the_axis_vanishes(sign):
    found = slopes(jnp.asarray(AXES), jnp.asarray(sign * AXES))
    assert all(np.all(np.isfinite(slope)) for slope in found)
