"""Minima that no search has found."""

import pytest
from true_minimum import TrueMinimum


@pytest.fixture(scope="session")
def true_minimum() -> type[TrueMinimum]:
    """The minimum of the bundled session by what is free, refined from the truth."""
    return TrueMinimum
