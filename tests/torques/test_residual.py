"""A constant torque: itself whatever surrounds the satellite, and a leaf that can be fitted."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxsat.spacecraft import MagneticRods, SolarPanels, Spacecraft, box_normals
from jaxsat.torques import BodyEnvironment, ResidualTorque

TORQUE = np.array([1e-9, -2e-9, 3e-9])
RODS = MagneticRods(jnp.zeros(0), jnp.zeros((0, 3)), jnp.asarray(3e-5))
CRAFT = Spacecraft(jnp.eye(3), jnp.ones(3), RODS, SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6)))


def test_is_constant_and_its_own_slope():
    places = jnp.asarray(np.random.default_rng(1).normal(size=(4, 3)))
    found = jax.jit(jax.vmap(lambda x: ResidualTorque(TORQUE)(CRAFT, BodyEnvironment(x, x, x))))(places)
    np.testing.assert_array_equal(found, [TORQUE] * 4)
    around = BodyEnvironment(places[0], places[1], places[2])
    for jacobian in (jax.jacfwd, jax.jacrev):
        slope = jax.jit(jacobian(lambda torque: torque(CRAFT, around)))(ResidualTorque(TORQUE))
        np.testing.assert_array_equal(slope.torque, np.eye(3))
