"""Fits that no solver has made, and the directories of them."""

from pathlib import Path

import pytest
from made_up_fit import make_sensed_result, make_session, write_made_up

from fitting.outcome.sensed_result import SensedResult
from jaxsat.telemetry import TableSession


@pytest.fixture
def sensed_result() -> SensedResult:
    return make_sensed_result()


@pytest.fixture
def table_session() -> TableSession:
    return make_session()


@pytest.fixture(scope="session")
def sensed_run(tmp_path_factory) -> Path:
    """The directory of a made-up fit without pictures; not to be changed."""
    out = tmp_path_factory.mktemp("sensed") / "run"
    write_made_up(out, plots=False)
    return out
