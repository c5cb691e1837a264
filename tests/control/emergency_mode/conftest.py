"""One flight for all tests of the emergency mode: each length of orbit and of leg is a program of its own."""

import pytest

from jaxsat.control.emergency_mode.orbit import fly, leg

PERIODS = 400


@pytest.fixture(scope="session")
def flight():
    """Ten days of the paper's orbit."""
    return fly(10.0)


@pytest.fixture(scope="session")
def around(flight):
    """Its first `PERIODS` control periods."""
    return leg(flight, 0, PERIODS)
