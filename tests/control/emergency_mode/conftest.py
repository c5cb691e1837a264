"""One flight for all tests of the emergency mode: each length of orbit and of leg is a program of its own."""

import jax
import jax.numpy as jnp
import pytest

from jaxsat.control.emergency_mode.orbit import fly, leg

PERIODS = 200


@pytest.fixture(scope="session")
def flight():
    """Ten days of the paper's orbit."""
    return fly(10.0)


@pytest.fixture(scope="session")
def legs(flight):
    """Its legs of one length by their first control period."""
    return lambda first: leg(flight, first, PERIODS)


@pytest.fixture(scope="session")
def around(legs):
    """The first two of them in one, longer than an orbit."""
    return jax.tree.map(lambda a, b: jnp.concatenate([a, b[1:]]), legs(0), legs(PERIODS))
