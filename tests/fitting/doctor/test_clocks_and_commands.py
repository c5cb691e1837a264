"""The pass of the tutorial, which another program made, with a clock that is not UTC and coils of the other sign."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from fitting.doctor.bench import Bench
from fitting.doctor.causes.magnets import other_commands
from fitting.doctor.causes.positions import late_clock
from fitting.doctor.trial import ranked
from fitting.run import fit
from fitting.settings import FitSettings
from fitting.surroundings import surroundings
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import read_telemetry
from jaxsat.time import Epoch

pytestmark = pytest.mark.slow

TUTORIALS = Path(__file__).parents[3] / "docs" / "tutorials"
EVERY = 3
"""Rows of which one is taken: a hundred say enough."""
LATE_S = 60.0


@pytest.fixture(scope="module")
def passed(tmp_path_factory):
    """Satellite and session of the tutorial."""
    folder = tmp_path_factory.mktemp("pass")
    (text,) = re.findall(
        r"^<!-- file: sat.toml -->\n```toml\n(.*?)^```", (TUTORIALS / "verdict.md").read_text("utf-8"), re.S | re.M
    )
    (folder / "sat.toml").write_text(text)
    (folder / "pass.tle").write_text((TUTORIALS / "data" / "pass.tle").read_text())
    head, *rows = (TUTORIALS / "data" / "pass.csv").read_text().splitlines()
    (folder / "pass.csv").write_text("\n".join([head, *rows[::EVERY]]) + "\n")
    satellite = read_satellite(folder / "sat.toml")
    return satellite, read_telemetry(folder / "pass.csv", satellite)


def examined(satellite, session) -> Bench:
    settings = FitSettings(holdout=0.3)
    found = fit(satellite, session, settings=settings, causes=False)
    assert found.status == "not_converged"
    around, _ = surroundings(satellite, session)
    return Bench(found.found, around, settings, (), satellite, session)


def test_a_late_clock_is_told_with_its_seconds(passed):
    satellite, session = passed
    bench = examined(satellite, replace(session, epoch=session.epoch.shifted(LATE_S)))
    best = ranked(list(late_clock(bench)), bench.chi2, bench.readings)[0]
    told = re.match(r"all stamps are (\d+\.\d) s late, or the orbit is as much behind on its track", best.cause)
    # Calibration and dipole, which are fitted too, take a few seconds of it.
    assert told and abs(float(told[1]) - LATE_S) < 0.1 * LATE_S and best.explains, best.cause
    meant = Epoch.from_iso(best.option.removeprefix("--as dated:"))
    assert abs(meant.seconds_since(session.epoch)) < 0.1 * LATE_S


def test_coils_of_the_other_sign_are_named(passed):
    satellite, session = passed
    turned = {name: (t, -value) for name, (t, value) in session.columns.items()}
    bench = examined(satellite, replace(session, columns=turned))
    best = ranked(list(other_commands(bench)), bench.chi2, bench.readings)[0]
    assert best.cause.startswith("coils turn it the other way: coil_x_A") and best.chi2_after < 0.5 * best.chi2_before
