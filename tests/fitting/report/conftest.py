"""Fits that no solver has made, and the directories of them."""

from pathlib import Path

import pytest
from made_up_fit import make_fit_result, make_session, write_made_up

from fitting.outcome.result import FitResult
from jaxsat.telemetry import TableSession


@pytest.fixture
def fit_result() -> FitResult:
    return make_fit_result()


@pytest.fixture
def table_session() -> TableSession:
    return make_session()


@pytest.fixture(scope="session")
def fit_run(tmp_path_factory) -> Path:
    """The directory of a made-up fit without pictures; not to be changed."""
    out = tmp_path_factory.mktemp("fit") / "run"
    write_made_up(out, plots=False)
    return out
