"""A torque of one's own that follows a schedule: it is told the time where the surroundings have it."""

from typing import ClassVar

import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array, Float

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import CentredDipole, KeplerOrbit, Surroundings
from jaxsat.simulate import simulate
from jaxsat.spacecraft import Spacecraft
from jaxsat.torques import AbstractTorque, BodyEnvironment
from jaxsat.torques.abstract import required

SIZE, RATE = 1e-5, 0.05


class Push(AbstractTorque):
    """Swings about body z."""

    smooth: ClassVar[bool] = True

    def __call__(self, spacecraft: Spacecraft, around: BodyEnvironment) -> Float[Array, "3"]:
        time = required(around.time, "Push", "BodyEnvironment.time", "Surroundings(..., clock=True)")
        return SIZE * jnp.cos(RATE * time) * jnp.array([0.0, 0.0, 1.0])


CRAFT = Spacecraft(0.01 * jnp.eye(3), parts=(Push(),))
START = AttitudeState(jnp.array([1.0, 0, 0, 0]), jnp.zeros(3))


def around(**settings):
    return Surroundings(KeplerOrbit(7e6, 0.0, 1.0, 0.0, 0.0, 0.0), CentredDipole([0.0, 0.0, -8e22]), 0.0, **settings)


def test_the_rate_is_the_integral_of_the_schedule():
    """About one axis of a body alike in all directions, which gravity does not turn."""
    times = np.linspace(100.0, 300.0, 9)
    found = simulate(CRAFT, START, around(clock=True), times, start=100.0, tolerance=1e-9)
    expected = SIZE / 0.01 / RATE * (np.sin(RATE * times) - np.sin(RATE * 100.0))
    np.testing.assert_allclose(found.angular_velocity[:, 2], expected, rtol=0, atol=1e-9)
    angle = 2.0 * np.arctan2(found.quaternion[:, 3], found.quaternion[:, 0])
    turned = -SIZE / 0.01 / RATE**2 * (np.cos(RATE * times) - np.cos(RATE * 100.0))
    turned = turned - SIZE / 0.01 / RATE * np.sin(RATE * 100.0) * (times - 100.0)
    np.testing.assert_allclose(np.angle(np.exp(1j * (angle - turned))), 0.0, atol=1e-8)


def test_without_a_clock_it_says_what_it_needs():
    with pytest.raises(ValueError, match="Push needs BodyEnvironment.time, which is None: give Surroundings"):
        simulate(CRAFT, START, around(), np.array([0.0, 10.0]))
