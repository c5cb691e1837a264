"""Orbit ephemeris messages: round trip, another program's reading of them, and what is refused."""

import re
from typing import Any

import numpy as np
import pytest
from brahe.ccsds import OEM

from jaxsat.errors import InputError
from jaxsat.telemetry.ccsds.oem import OrbitEphemeris, oem_text, read_oem
from jaxsat.time import Epoch

MESSAGE = """CCSDS_OEM_VERS = 2.0
CREATION_DATE = 2017-02-01T00:00:00
ORIGINATOR = TEST

META_START
OBJECT_NAME = CUBE
OBJECT_ID = 2016-001A
CENTER_NAME = EARTH
REF_FRAME = TOD
REF_FRAME_EPOCH = 2017-01-01T00:00:00
TIME_SYSTEM = GPS
START_TIME = 2017-01-01T00:00:00
STOP_TIME = 2017-01-01T00:02:00
META_STOP
COMMENT with an acceleration, then without
2017-01-01T00:00:00 7000.0 0.5 -1 0.0 7.5 .25 0.0 0.0 1e-3
2017-01-01T00:02:00 6900.0 0.5 -1 0.0 7.5 .25
COVARIANCE_START
EPOCH = 2017-01-01T00:00:00
1.0
COVARIANCE_STOP
"""


def read(text, tmp_path):
    path = tmp_path / "x.oem"
    path.write_text(text)
    return read_oem(path)


def test_round_trip_and_another_program(tmp_path):
    rng = np.random.default_rng(0)
    orbit = OrbitEphemeris(
        "CUBE",
        "2016-001A",
        "GCRF",
        Epoch.from_iso("2016-12-31T23:59:50.25"),
        64.0 * np.arange(12),
        rng.normal(scale=7e6, size=(12, 3)),
        rng.normal(scale=7e3, size=(12, 3)),
    )
    text = oem_text(orbit, created=orbit.epoch, comments=("by hand",))
    (found,) = read(text, tmp_path)
    np.testing.assert_allclose(found.position_m, orbit.position_m, atol=6e-4)
    np.testing.assert_allclose(found.velocity_m_s, orbit.velocity_m_s, atol=6e-7)
    np.testing.assert_allclose(found.t_s, orbit.t_s, atol=1e-6)
    assert (found.frame, found.object_id, found.epoch.iso(2)) == ("GCRF", "2016-001A", orbit.epoch.iso(2))
    segments: Any = OEM.from_str(text).segments
    theirs = segments[0]
    assert len(theirs.states) == 12
    np.testing.assert_allclose(theirs.states[11].position, orbit.position_m[11], atol=6e-4)
    np.testing.assert_allclose(theirs.states[11].velocity, orbit.velocity_m_s[11], atol=6e-7)


def test_a_message_written_by_hand(tmp_path):
    (found,) = read(MESSAGE, tmp_path)
    np.testing.assert_allclose(found.position_m, [[7e6, 500, -1000], [6.9e6, 500, -1000]])
    np.testing.assert_allclose(found.velocity_m_s[1], [0, 7500, 250])
    # GPS was 18 s ahead of UTC from then on, and 17 s before the leap second.
    assert found.epoch.iso(0) == "2016-12-31T23:59:43" and found.frame_epoch is not None
    two = MESSAGE + MESSAGE[MESSAGE.index("META_START") :]
    assert len(read(two, tmp_path)) == 2


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("= 2.0", "= 3.0", "CCSDS_OEM_VERS: expected 1.0 or 2.0"),
        ("7.5 .25\n", "7.5\n", "expected an instant and 6 numbers, found 6 fields"),
        ("6900.0", "6900,0", "plain decimal number"),
        ("REF_FRAME = TOD\n", "", "REF_FRAME: is missing"),
        ("EPOCH = 2017-01-01", "EPOCH = 2017-13-01", "REF_FRAME_EPOCH: 2017-13-01"),
        ("COVARIANCE_STOP\n", "", "ends within its skipped"),
        ("START_TIME = 2017-01-01T00:00:00\n", "", "START_TIME: is missing"),
        ("META_STOP\n", "META_STOP\nMETA_STOP\n", "expected an instant such as"),
    ],
)
def test_damage_is_one_line(old, new, expected, tmp_path):
    with pytest.raises(InputError) as error:
        read(MESSAGE.replace(old, new, 1), tmp_path)
    assert expected in str(error.value) and re.match(r"\S+x\.oem:\d+: ", str(error.value))
