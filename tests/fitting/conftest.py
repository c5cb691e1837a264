"""Minima that no search has found, and sessions of Munin with their truth as the problems that solvers take."""

from collections.abc import Callable

import pytest
from munin_case import Case
from true_minimum import TrueMinimum


@pytest.fixture(scope="session")
def true_minimum() -> type[TrueMinimum]:
    """The minimum of the bundled session by what is free, refined from the truth."""
    return TrueMinimum


@pytest.fixture(scope="session")
def munin_case() -> Callable[..., Case]:
    """`munin_case(name of a bundled session, free)`; what it gives is made anew each time."""
    return Case
