"""The main job from Python gives what the command gives, and says no as it does."""

import json
from pathlib import Path

import jax
import pytest

import fitting
import jaxsat
from fitting.settings import FitSettings
from jaxsat.bundled import BUNDLED
from jaxsat.cli.main import run
from jaxsat.errors import InputError


def stripped(directory: Path) -> dict[str, object]:
    """Content of the files by name, without times."""
    found: dict[str, object] = {file.name: file.read_bytes() for file in directory.iterdir()}
    document = json.loads((directory / "fit.json").read_text())
    del document["timing_s"]
    # The page shows the times too.
    return {**found, "fit.json": document, "report.html": None}


@pytest.mark.slow
def test_python_writes_what_the_command_writes(fake_fit, tmp_path):
    satellite = jaxsat.read_satellite()
    session = jaxsat.read_telemetry(BUNDLED, satellite)
    found = fitting.fit(satellite, session, free="alsI0,albedo", settings=FitSettings(starts=256))
    assert isinstance(found, fitting.Fit)
    (warning,) = found.write(tmp_path / "python")
    assert warning.startswith("parameters.imax.sigma is not a finite number")
    assert run(["fit", "--free", "alsI0,albedo", "--out", str(tmp_path / "command")]) == 0
    assert stripped(tmp_path / "python") == stripped(tmp_path / "command")
    assert found.status == "converged"
    times = found.result.timing_s
    assert 0.0 < times["prepare"] <= times["total"]


def test_what_cannot_be_fitted_is_said(fake_fit, tmp_path):
    satellite = jaxsat.read_satellite()
    session = jaxsat.read_telemetry(BUNDLED, satellite)
    fake_fit["error"] = AssertionError("the work has begun")
    with pytest.raises(InputError, match="did you mean magnet"):
        fitting.fit(satellite, session, free="magnt")
    with pytest.raises(InputError, match="imax is not free"):
        fitting.fit(satellite, session, free="als", profiles=["imax"])
    with pytest.raises(InputError, match="no such file"):
        jaxsat.read_telemetry(tmp_path / "none.RAW_SUN", satellite)
    with pytest.raises(InputError, match=r"spacecraft\.imax: unknown key"):
        jaxsat.read_satellite(changed={"spacecraft.imax": 230.0})


def test_single_precision_is_refused():
    satellite = jaxsat.read_satellite()
    session = jaxsat.read_telemetry(BUNDLED, satellite)
    jax.config.update("jax_enable_x64", False)
    try:
        with pytest.raises(ValueError, match=r"call jaxsat\.set_up_jax\(\) first"):
            fitting.fit(satellite, session)
    finally:
        jax.config.update("jax_enable_x64", True)


def test_tables_of_contents_are_true():
    for package in (fitting, jaxsat):
        for name in package._PLACES:
            assert getattr(package, name).__module__.startswith(("fitting.", "jaxsat."))
    with pytest.raises(AttributeError, match="nowhere"):
        fitting.nowhere  # noqa: B018
    assert jaxsat.__version__.count(".") == 2
