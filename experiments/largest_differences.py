"""Prints what comparisons of tests found: the largest difference of each beside what was allowed.

A plugin of pytest, for docs/background/validation.md. Assertions tell their values only where they are compiled so,
which a cache of Python's own for this run sees to:

    PYTHONPYCACHEPREFIX=/tmp/pyc .venv/bin/python -m pytest -q -p experiments.largest_differences \
        -o enable_assertion_pass_hook=true tests/oracles
"""

import os
from collections.abc import Iterator

import numpy as np
import pytest

_FOUND: dict[str, tuple[float, str]] = {}
"""Of each test, and line within it, the largest difference over what is allowed, and both in words."""


@pytest.fixture(autouse=True, scope="session")
def _watched() -> Iterator[None]:
    """Looks at each `np.testing.assert_allclose` on its way."""
    real = np.testing.assert_allclose

    def watched(actual, desired, rtol=1e-7, atol=0.0, **options):
        _note(np.asarray(actual), np.asarray(desired), rtol, np.asarray(atol))
        return real(actual, desired, rtol, atol, **options)

    np.testing.assert_allclose = watched
    yield
    np.testing.assert_allclose = real


def _note(actual: np.ndarray, desired: np.ndarray, rtol: float, atol: np.ndarray) -> None:
    difference = np.abs(np.asarray(actual - desired, complex))
    if difference.size and np.isfinite(difference).any():
        test = os.environ["PYTEST_CURRENT_TEST"].partition(" ")[0]
        _keep(test, float(np.nanmax(difference)), float(np.max(atol + rtol * np.abs(desired))))


def pytest_assertion_pass(item: pytest.Item, lineno: int, orig: str, expl: str) -> None:
    """Is called for each assertion that holds, with its values: `assert difference < allowed`."""
    sides = expl.splitlines()[0].replace("np.float64", "").split(" < ")
    if len(sides) == 2:
        try:
            small, large = map(_number, sides)
        except ValueError:
            # No two numbers.
            return
        _keep(f"{item.nodeid.partition('[')[0]}:{lineno}", small, large)


def _number(text: str) -> float:
    """Of a number, or of a quotient of two."""
    above, _, below = text.replace("(", "").replace(")", "").partition(" / ")
    return float(above) / float(below or 1.0)


def _keep(test: str, difference: float, allowed: float) -> None:
    test, ratio = test.partition("[")[0], difference / allowed if allowed else 0.0
    if ratio >= _FOUND.get(test, (-1.0, ""))[0]:
        _FOUND[test] = ratio, f"{difference:.2e}, allowed {allowed:.2e}"


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Prints them behind all else, a line a comparison."""
    terminalreporter.section("largest differences")
    for test, (_, words) in sorted(_FOUND.items()):
        terminalreporter.write_line(f"{test}: {words}")
