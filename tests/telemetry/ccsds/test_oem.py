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
COV_REF_FRAME = RTN
1.0
0.0 2.0
0 0 3e-1
0 0 0 1e-6
0 0 0 0 1e-6
0 0 0 0 0 1e-6
COVARIANCE_STOP
"""
SEGMENT = MESSAGE[MESSAGE.index("META_START") :]


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
    other = SEGMENT.replace("T00:02", "T00:03")
    assert len(read(MESSAGE + other, tmp_path)) == 2
    third = MESSAGE.replace("= 2.0", "= 3.0").replace("ORIGINATOR", "CLASSIFICATION = U\nMESSAGE_ID = 7\nORIGINATOR")
    np.testing.assert_array_equal(read(third, tmp_path)[0].position_m, found.position_m)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("= 2.0", "= 4.0", "CCSDS_OEM_VERS: expected 1.0 or 2.0 or 3.0"),
        ("7.5 .25\n", "7.5\n", "expected an instant and 6 numbers, found 6 fields"),
        ("6900.0", "6900,0", "plain decimal number"),
        ("REF_FRAME = TOD\n", "", "REF_FRAME: is missing"),
        ("EPOCH = 2017-01-01", "EPOCH = 2017-13-01", "REF_FRAME_EPOCH: 2017-13-01"),
        ("COVARIANCE_STOP\n", "", ":18: COVARIANCE_START: is not closed"),
        ("COVARIANCE_STOP\n", "META_START\n", ":18: COVARIANCE_START: is not closed before META_START in line 27"),
        ("0 0 3e-1\n", "", ":23: covariance of line 18: expected 3 numbers, found '0 0 0 1e-6'"),
        ("0 0 3e-1\n", "0 0 three\n", ":23: covariance of line 18: expected 3 numbers"),
        ("COV_REF_FRAME", "COV_FRAME", ":20: covariance of line 18: expected 1 numbers"),
        ("0 0 0 0 0 1e-6\n", "", ":18: COVARIANCE_START: ends after 5 rows"),
        ("START\nEPOCH = 2017-01", "START\nEPOCH = 2017-13", ":19: EPOCH of a covariance: 2017-13-01"),
        ("2017-02-01", "2017-02-30", ":2: CREATION_DATE: 2017-02-30"),
        ("ORIGINATOR", "ORIGIN", ":3: ORIGIN: is not a keyword of the header"),
        ("META_STOP", "USEABLE_START_TIME = yesterday\nMETA_STOP", "USEABLE_START_TIME: expected an instant"),
        (
            "META_STOP",
            "USEABLE_START_TIME = 2017-01-01T00:01:01\nUSEABLE_STOP_TIME = 2017-01-01T00:01:00\nMETA_STOP",
            ":15: USEABLE_STOP_TIME: 2017-01-01T00:01:00 is before USEABLE_START_TIME",
        ),
        ("META_STOP", "USEABLE_STOP_TIME = 2017-01-01T00:02:01\nMETA_STOP", "STOP_TIME: 2017-01-01T00:02:00 is before"),
        ("META_STOP", "INTERPOLATION_DEGREE = -7\nMETA_STOP", "INTERPOLATION_DEGREE: expected a whole number"),
        ("6900.0", "6.9e307", "plain decimal number of at most 1e+12, found '6.9e307'"),
        ("COMMENT", "\v", ":15: is not plain ASCII text"),
        (
            "COVARIANCE_START",
            MESSAGE[MESSAGE.index("META_START") :] + "COVARIANCE_START",
            "repeats the segment of line 5",
        ),
        (
            "COVARIANCE_START",
            MESSAGE[MESSAGE.index("META_START") :].replace("GPS", "TAI") + "COVARIANCE_START",
            ":24: TIME_SYSTEM: TAI after GPS in line 11: a message has one",
        ),
        ("START_TIME = 2017-01-01T00:00:00\n", "", "START_TIME: is missing"),
        ("META_STOP\n", "META_STOP\nMETA_STOP\n", "expected an instant such as"),
    ],
)
def test_damage_is_one_line(old, new, expected, tmp_path):
    with pytest.raises(InputError) as error:
        read(MESSAGE.replace(old, new, 1), tmp_path)
    assert expected in str(error.value) and re.match(r"\S+x\.oem:\d+: ", str(error.value))
