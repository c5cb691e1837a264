"""Munin as a satellite file: the same motion and numbers as by the fit of six currents, and its magnetometer's word."""

import dataclasses

import numpy as np
import pytest

import fitting
from fitting.sensed_run import SensedFit, fit_table
from jaxsat.bundled import BUNDLED, MUNIN_SATELLITE
from jaxsat.satellites import Satellite, read_satellite
from jaxsat.telemetry import TableSession, read_telemetry

pytestmark = pytest.mark.slow

CLOSE = 0.1
"""Largest difference [sigma]."""


@pytest.fixture(scope="module")
def munin() -> Satellite:
    found = read_satellite(MUNIN_SATELLITE)
    assert isinstance(found, Satellite)
    return found


@pytest.fixture(scope="module")
def session(munin) -> TableSession:
    return read_telemetry(BUNDLED, munin)


@pytest.fixture(scope="module")
def by_table(munin, session) -> SensedFit:
    return fit_table(munin, session)


def test_the_same_as_by_the_fit_of_six_currents(by_table):
    old, new = fitting.fit(read_satellite(), read_telemetry(BUNDLED)).result, by_table.result
    assert new.status == old.status == "converged"
    assert new.chi2 == pytest.approx(old.chi2, abs=0.1)
    assert new.dof == old.dof
    known = {p.name: p for p in old.parameters}
    pairs = [(p, known[p.name]) for p in new.parameters if p.free]
    assert len(pairs) == 14
    for ours, theirs in pairs:
        assert theirs.free and theirs.sigma is not None and ours.unit == theirs.unit
        assert ours.value == pytest.approx(theirs.value, abs=CLOSE * theirs.sigma), ours.name
        assert ours.sigma == pytest.approx(theirs.sigma, rel=0.05), ours.name
    place = np.searchsorted(new.t_s, old.t_s)
    np.testing.assert_allclose(new.t_s[place], old.t_s)
    overlap = np.abs(np.sum(new.quaternion_inertial_from_body[place] * old.quaternion_inertial_from_body, axis=1))
    turn = np.degrees(2.0 * np.arccos(np.minimum(overlap, 1.0)))
    assert turn.max() < CLOSE * new.attitude_sigma_deg.min()


def test_the_magnetometer_is_a_witness(by_table):
    mag = by_table.result.channels["mag"]
    assert mag.witness and not mag.fitted.any()
    assert mag.holdout is not None and mag.holdout.rms < 0.5
    assert any("the witness mag confirms the motion" in remark for remark in by_table.result.remarks)
    assert not any(p.free for p in by_table.result.parameters if p.name.startswith("mag."))


def test_a_magnetometer_that_contradicts_is_heard(munin, session):
    mag = session.channels["mag"]
    turned = dataclasses.replace(mag, values=-mag.values)
    denied = dataclasses.replace(session, channels={**session.channels, "mag": turned})
    result = fit_table(munin, denied).result
    assert result.status == "not_converged"
    assert result.message.startswith("the witness mag denies the motion")
