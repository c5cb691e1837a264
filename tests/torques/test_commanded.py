"""Coils and wheels by themselves: closed forms, slopes, what is missing; satellites with them keep their axes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

from jaxsat.spacecraft import Spacecraft, in_axes
from jaxsat.torques import BodyEnvironment, Coil, Wheel, commanded_columns, torques_of

AXIS, FIELD, RATE = np.array([0.48, 0.6, -0.64]), np.array([2e-5, -1e-5, 3e-5]), np.array([0.02, 0.05, -0.01])
COIL, WHEEL = Coil(AXIS, 2.0, "i"), Wheel(AXIS, 1e-5, "s")
CRAFT = Spacecraft(0.01 * jnp.eye(3), parts=(COIL, WHEEL))


def around(current=0.01, speed=200.0, acceleration=3.0, **changed):
    given = {
        "commands": {"i": jnp.asarray(current), "s": jnp.asarray(speed)},
        "command_rates": {"s": jnp.asarray(acceleration)},
    }
    return BodyEnvironment(jnp.zeros(3), jnp.asarray(FIELD), jnp.asarray(RATE), **{**given, **changed})


def test_torques_are_those_of_closed_forms():
    np.testing.assert_allclose(COIL(CRAFT, around()), np.cross(0.02 * AXIS, FIELD), rtol=1e-14)
    expected = -1e-5 * (3.0 * AXIS + np.cross(RATE, 200.0 * AXIS))
    np.testing.assert_allclose(WHEEL(CRAFT, around()), expected, rtol=1e-13)
    assert torques_of(CRAFT)[-2:] == (COIL, WHEEL)
    assert not COIL.smooth and not WHEEL.smooth


@pytest.mark.parametrize("part", [COIL, WHEEL], ids=["coil", "wheel"])
def test_slopes_are_differences(part):
    leaves, structure = jax.tree.flatten(part)
    flat, back = ravel_pytree(leaves)

    def torque(x):
        return jax.tree.unflatten(structure, back(x))(CRAFT, around())

    slopes, h = jax.jacfwd(torque)(flat), 1e-3
    steps = h * np.asarray(flat[:, None] + 1.0) * np.eye(len(flat))
    differences = [(torque(flat + s) - torque(flat - s)) / (2.0 * s[k]) for k, s in enumerate(steps)]
    # Linear in each number: central differences are exact but for rounding.
    np.testing.assert_allclose(slopes, np.array(differences).T, atol=1e-9 * np.abs(slopes).max())


def test_what_is_missing_is_named():
    with pytest.raises(ValueError, match="Coil needs BodyEnvironment.commands, which is None"):
        COIL(CRAFT, around(commands=None))
    with pytest.raises(ValueError, match=r"Wheel needs BodyEnvironment.command_rates\['s'\], which is None"):
        WHEEL(CRAFT, around(command_rates={}))


def test_columns_are_told_apart():
    assert commanded_columns((COIL, Coil(AXIS, 1.0, "j"), WHEEL, COIL)) == (("i", "j"), ("s",))


def test_a_satellite_with_them_is_described_in_its_own_axes_alone():
    with pytest.raises(ValueError, match="in_axes: Spacecraft.parts"):
        in_axes(CRAFT, np.eye(3))
