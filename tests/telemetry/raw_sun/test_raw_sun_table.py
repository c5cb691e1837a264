"""RAW_SUN sessions as tables of a satellite file: the same numbers as the session has."""

from pathlib import Path

import numpy as np
import pytest

from jaxsat.bundled import BUNDLED, MUNIN_SATELLITE
from jaxsat.errors import InputError
from jaxsat.satellites import Satellite, read_satellite
from jaxsat.telemetry import read_session, read_telemetry


def munin(path: Path = MUNIN_SATELLITE) -> Satellite:
    found = read_satellite(path)
    assert isinstance(found, Satellite)
    return found


@pytest.fixture(scope="module")
def both():
    return read_telemetry([BUNDLED], munin()), read_session(BUNDLED)


def test_channels_hold_currents_and_field_in_si(both):
    table, session = both
    assert table.epoch == session.epoch
    cells, mag = table.channels["cells"], table.channels["mag"]
    np.testing.assert_array_equal(cells.t_s, session.t_s)
    np.testing.assert_allclose(cells.values, 1e-3 * session.currents_mA, rtol=1e-15)
    assert cells.sigma == pytest.approx(1e-3 * np.hypot(2.0, 1.0 / np.sqrt(12.0))) and not cells.witness
    there = np.isfinite(session.b_field_uT).any(axis=1)
    np.testing.assert_array_equal(mag.t_s, session.t_s[there])
    np.testing.assert_allclose(mag.values, 1e-6 * session.b_field_uT[there], rtol=1e-15)
    assert mag.witness


def test_states_and_rejections_are_carried_over(both):
    table, session = both
    assert table.positions is not None
    np.testing.assert_array_equal(table.positions[1], session.position_eci_m)
    np.testing.assert_array_equal(table.velocities, session.velocity_eci_m_s)
    assert table.rejected_by_reason == session.rejected_by_reason


def test_two_sessions_are_not_joined():
    with pytest.raises(InputError, match="one session by itself"):
        read_telemetry([BUNDLED, BUNDLED.with_name("a-nominal-exact.RAW_SUN")], munin())


def test_a_column_that_the_file_has_not_is_named(tmp_path):
    text = MUNIN_SATELLITE.read_text().replace('columns = ["By", "Bz"]', 'columns = ["By", "Bq"]')
    (tmp_path / "other.sat.toml").write_text(text)
    with pytest.raises(InputError, match="no column 'Bq'"):
        read_telemetry(BUNDLED, munin(tmp_path / "other.sat.toml"))
