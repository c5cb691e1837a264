"""Eddy currents: opposed to the turn across the field, blind to that along it, with the slopes of differences."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxsat.spacecraft import Spacecraft
from jaxsat.torques import BodyEnvironment, EddyDamping, torques_of

K = 300.0
RNG = np.random.default_rng(4)
RATES, FIELDS = 0.1 * RNG.normal(size=(20, 3)), 3e-5 * RNG.normal(size=(20, 3))
PART = EddyDamping(K)
CRAFT = Spacecraft(0.01 * jnp.eye(3), parts=(PART,))


def torque(part, rate, field):
    return part(CRAFT, BodyEnvironment(field, field, rate))


found_by = jax.jit(jax.vmap(torque, (None, 0, 0)))


def test_torque_takes_power_from_the_turn_across_the_field():
    found = np.asarray(found_by(PART, RATES, FIELDS))
    square, along = np.sum(FIELDS**2, axis=1), np.sum(FIELDS * RATES, axis=1)
    expected = -K * (square[:, None] * RATES - along[:, None] * FIELDS)
    np.testing.assert_allclose(found, expected, atol=1e-13 * np.abs(expected).max())
    assert np.all(np.sum(found * RATES, axis=1) < 0.0)
    # A turn about the field induces nothing.
    np.testing.assert_allclose(found_by(PART, 1e3 * FIELDS, FIELDS), 0.0, atol=1e-22)
    assert torques_of(CRAFT)[-1] is PART


def test_slopes_are_differences():
    slopes = jax.jit(jax.jacfwd(torque, argnums=(0, 1, 2)))(PART, RATES[0], FIELDS[0])
    for k, given in ((1, RATES), (2, FIELDS)):
        h = 1e-4 * np.abs(given[0]).max()
        steps = np.tile(given[0], (6, 1)) + h * np.vstack([np.eye(3), -np.eye(3)])
        at = found_by(
            PART, steps if k == 1 else np.tile(RATES[0], (6, 1)), steps if k == 2 else np.tile(FIELDS[0], (6, 1))
        )
        differences = (np.asarray(at[:3]) - np.asarray(at[3:])).T / (2.0 * h)
        # The torque is of second order in the field: central differences are exact but for rounding.
        np.testing.assert_allclose(slopes[k], differences, atol=1e-10 * np.abs(differences).max())
    np.testing.assert_allclose(slopes[0].coefficient, np.asarray(found_by(PART, RATES, FIELDS))[0] / K, rtol=1e-13)
