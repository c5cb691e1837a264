"""Attitude ephemeris messages: the turn that a quaternion means, both versions, and everything that is refused."""

import re
from typing import Any

import brahe
import numpy as np
import pytest
from brahe.ccsds import AEM
from scipy.spatial.transform import Rotation

from jaxsat.errors import InputError
from jaxsat.telemetry.ccsds.aem import AttitudeEphemeris, aem_text, read_aem
from jaxsat.time import Epoch

EPOCH = Epoch.from_iso("2016-12-31T23:59:50.25")
NOW = Epoch.from_iso("2017-02-01T00:00:00")
# A satellite turned 30 deg about inertial z, then 50 deg about its own x.
BODY = Rotation.from_euler("ZX", [30.0, 50.0], degrees=True)

MESSAGE = """CCSDS_AEM_VERS = 1.0
CREATION_DATE  = 2017-032T00:00:00
ORIGINATOR     = TEST
META_START
COMMENT made for this test
OBJECT_NAME = CUBE
OBJECT_ID   = 2016-001A
REF_FRAME_A = EME2000
REF_FRAME_B = SC_BODY_1
ATTITUDE_DIR = A2B
TIME_SYSTEM = UTC
START_TIME  = 2016-366T23:59:58
STOP_TIME   = 2017-001T00:00:10
ATTITUDE_TYPE = QUATERNION
QUATERNION_TYPE = LAST
META_STOP
DATA_START
2016-12-31T23:59:59.5 0.0 0.0 0.6 0.8
COMMENT a leap second follows
2016-12-31T23:59:60.5 0.0 0.0 0.0 1.0
2017-01-01T00:00:00.5Z 1e0 0.0 0.0 .0
DATA_STOP
"""


@pytest.fixture
def ephemeris():
    rng = np.random.default_rng(0)
    q = np.roll((BODY * Rotation.from_rotvec(rng.normal(scale=0.5, size=(20, 3)))).as_quat(), 1, axis=1)
    q[0] = np.roll(BODY.as_quat(), 1)
    return AttitudeEphemeris(
        "CUBE", "2016-001A", "EME2000", "SC_BODY_1", EPOCH, np.arange(20.0), q, rng.normal(scale=0.02, size=(20, 3))
    )


def read(text, tmp_path):
    path = tmp_path / "x.aem"
    path.write_bytes(text.encode())
    return read_aem(path)


@pytest.mark.parametrize("quaternion_type", ["FIRST", "LAST"])
@pytest.mark.parametrize("direction", ["A2B", "B2A"])
def test_version_1_round_trip(ephemeris, direction, quaternion_type, tmp_path):
    text = aem_text(
        ephemeris, version="1.0", created=NOW, direction=direction, quaternion_type=quaternion_type, comments=("hello",)
    )
    (found,) = read(text, tmp_path)
    np.testing.assert_allclose(found.quaternion_a_from_b, ephemeris.quaternion_a_from_b, atol=2e-12)
    # Ten seconds in, through the leap second.
    np.testing.assert_allclose(found.t_s, ephemeris.t_s, atol=1e-6)
    assert found.epoch.iso(2) == EPOCH.iso(2) and found.angular_velocity_b is None
    assert (found.object_name, found.frame_a, found.frame_b) == ("CUBE", "EME2000", "SC_BODY_1")


@pytest.mark.parametrize(
    ("direction", "quaternion_type", "sign", "scalar"),
    [("A2B", "LAST", 1, 3), ("A2B", "FIRST", 1, 0), ("B2A", "LAST", -1, 3), ("B2A", "FIRST", -1, 0)],
)
def test_the_numbers_written_turn_a_known_vector(ephemeris, direction, quaternion_type, sign, scalar):
    """Body z of `BODY` lies at (sin 30 sin 50, -cos 30 sin 50, cos 50) in inertial axes, by hand."""
    text = aem_text(ephemeris, version="1.0", created=NOW, direction=direction, quaternion_type=quaternion_type)
    (row,) = re.findall(r"^2016-12-31T23:59:50\S* (.*)$", text, re.M)
    numbers = np.array(row.split(), float)
    qc, e = numbers[scalar], np.delete(numbers, scalar)
    # The matrix of 504.0-B: components in the frame that is left, turned into those of the frame that is reached.
    skew = np.array([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    matrix = (qc**2 - e @ e) * np.eye(3) + 2 * np.outer(e, e) - 2 * qc * skew
    z_inertial = np.array(
        [0.5 * np.sin(np.radians(50)), -np.sqrt(0.75) * np.sin(np.radians(50)), np.cos(np.radians(50))]
    )
    before, after = (z_inertial, [0, 0, 1]) if sign > 0 else ([0, 0, 1], z_inertial)
    np.testing.assert_allclose(matrix @ before, after, atol=1e-11)


def test_version_2_means_the_same_to_another_program(ephemeris, tmp_path):
    text = aem_text(ephemeris, created=NOW)
    assert "ATTITUDE_DIR" not in text and "QUATERNION_TYPE" not in text
    theirs = AEM.from_str(text).segments[0]
    assert (theirs.object_id, theirs.attitude_type, len(theirs.states)) == ("2016-001A", "QUATERNION/ANGVEL", 20)
    for k in (0, 7, 19):
        state = theirs.states[k]
        matrix = np.array(state.quaternion.to_rotation_matrix().to_matrix())
        body_from_inertial = Rotation.from_quat(np.roll(ephemeris.quaternion_a_from_b[k], -1)).as_matrix().T
        np.testing.assert_allclose(matrix, body_from_inertial, atol=1e-11)
        np.testing.assert_allclose(state.angular_velocity, ephemeris.angular_velocity_b[k], atol=1e-12)
    (found,) = read(text, tmp_path)
    np.testing.assert_allclose(found.quaternion_a_from_b, ephemeris.quaternion_a_from_b, atol=2e-12)
    np.testing.assert_allclose(np.array(found.angular_velocity_b), ephemeris.angular_velocity_b, atol=1e-13)


def test_a_message_of_another_program_is_read(tmp_path):
    brahe.set_global_eop_provider(brahe.StaticEOPProvider.from_zero())
    utc: Any = brahe.TimeSystem.UTC
    start: Any = brahe.Epoch.from_datetime(2024, 1, 1, 0, 0, 0.0, 0.0, utc)
    segment = brahe.ccsds.AEMSegment("S", "2024-001A", "EME2000", "SC_BODY_1", "UTC", start, start + 60.0, "QUATERNION")
    for t, angle in ((0.0, 0.0), (60.0, 40.0)):
        half = np.radians(angle) / 2
        quaternion = brahe.Quaternion(np.cos(half), 0.0, 0.0, np.sin(half))
        segment.add_state(brahe.ccsds.AEMAttitudeState.from_quaternion(start + t, quaternion))
    message = AEM("TEST")
    message.add_segment(segment)
    (found,) = read(message.to_string("KVN"), tmp_path)
    # The body has turned 40 deg about z: its x axis points there in inertial axes.
    x_axis = Rotation.from_quat(np.roll(found.quaternion_a_from_b[1], -1)).apply([1.0, 0.0, 0.0])
    np.testing.assert_allclose(x_axis, [np.cos(np.radians(40)), np.sin(np.radians(40)), 0.0], atol=1e-9)
    np.testing.assert_allclose(found.t_s, [0.0, 60.0])


def test_a_message_written_by_hand(tmp_path):
    (found,) = read(MESSAGE.replace("\n", "\r\n"), tmp_path)
    np.testing.assert_allclose(found.t_s, [0.0, 1.0, 2.0], atol=1e-9)
    np.testing.assert_allclose(found.quaternion_a_from_b, [[0.8, 0, 0, 0.6], [1, 0, 0, 0], [0, 1, 0, 0]])
    assert found.metadata["START_TIME"] == "2016-366T23:59:58" and found.center_name == ""


def test_rates_follow_from_derivatives_and_frames(tmp_path):
    """A turn about body axes at a constant rate, its quaternion's derivative by differences; both directions."""
    rate, t, h = np.array([0.02, -0.03, 0.01]), np.array([0.0, 1.0]), 1e-6

    def quaternion(t):
        return np.roll((BODY * Rotation.from_rotvec(np.multiply.outer(t, rate))).as_quat(), 1, axis=-1)

    q, derivative = quaternion(t), (quaternion(t + h) - quaternion(t - h)) / (2 * h)
    base = MESSAGE.replace("UTC", "TAI").replace("2016-366T23:59:58", "2016-366T23:59:57")
    for flip in (1.0, -1.0):
        signs = np.array([1.0, flip, flip, flip])
        rows = "\n".join(
            f"2016-12-31T23:59:5{8 + int(x)} " + " ".join(f"{v:.15f}" for v in [*(a * signs), *(b * signs)])
            for x, a, b in zip(t, q, derivative, strict=True)
        )
        text = base.replace("= QUATERNION\n", "= QUATERNION/DERIVATIVE\n").replace("= LAST", "= FIRST")
        text = text.replace("= A2B", "= B2A") if flip < 0 else text
        text = re.sub(r"(?s)DATA_START.*DATA_STOP", f"DATA_START\n{rows}\nDATA_STOP", text)
        (found,) = read(text, tmp_path)
        np.testing.assert_allclose(np.array(found.angular_velocity_b), [rate, rate], atol=1e-9)
        # TAI was 36 s ahead of UTC.
        assert found.epoch.iso(3) == "2016-12-31T23:59:22.000"
    inertial = BODY.apply(rate)
    row = " ".join(f"{x:.15f}" for x in [*np.roll(q[0], -1), *np.degrees(inertial)])
    text = MESSAGE.replace("1.0\n", "2.0\n", 1).replace("= QUATERNION\n", "= QUATERNION/ANGVEL\n")
    text = re.sub("(ATTITUDE_DIR|QUATERNION_TYPE) .*\n", "", text).replace(
        "META_STOP", "ANGVEL_FRAME = EME2000\nMETA_STOP"
    )
    text = re.sub(r"(?s)DATA_START.*DATA_STOP", f"DATA_START\n2017-01-01T00:00:00 {row}\nDATA_STOP", text)
    (found,) = read(text, tmp_path)
    np.testing.assert_allclose(np.array(found.angular_velocity_b), [rate], atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("= 1.0", "= 3.0", "CCSDS_AEM_VERS: expected 1.0 or 2.0"),
        ("= 1.0", "= 2.0", "QUATERNION_TYPE: is a keyword of version 1.0"),
        ("CCSDS_AEM_VERS", "CCSDS_OEM_VERS", "expected CCSDS_AEM_VERS"),
        ("QUATERNION_TYPE = LAST\n", "", "QUATERNION_TYPE: is missing"),
        ("= LAST", "= MIDDLE", "QUATERNION_TYPE: expected FIRST or LAST"),
        ("ATTITUDE_DIR = A2B\n", "", "ATTITUDE_DIR: is missing"),
        ("ATTITUDE_DIR", "ATTITUDE_DIRECTION", "ATTITUDE_DIRECTION: is not a keyword"),
        ("= QUATERNION\n", "= SPIN\n", "ATTITUDE_TYPE: expected QUATERNION or"),
        ("= UTC", "= MRT", "TIME_SYSTEM: expected UTC or TAI"),
        ("= UTC", "= TAI", "no leap seconds"),
        ("REF_FRAME_B = SC_BODY_1", "REF_FRAME_B = EME2000", "REF_FRAME_B: EME2000 is REF_FRAME_A too"),
        ("0.6 0.8", "0.6 nan", "expected a plain decimal number, found 'nan'"),
        ("0.6 0.8", "0.6 0_8", "found '0_8'"),
        ("0.6 0.8", "0.6 inf", "found 'inf'"),
        ("0.6 0.8", "0.6 1e999", "found '1e999'"),
        ("0.6 0.8", "0.6 \u0668", "plain ASCII"),
        ("0.6 0.8", "0.6 0.9", "expected a unit quaternion, its length is 1.08167"),
        ("0.6 0.8", "0.6", "expected an instant and 4 numbers, found 4 fields"),
        ("12-31T23:59:59.5", "13-31T23:59:59.5", "month must be in 1..12"),
        ("12-31T23:59:59.5", "12-31T23:58:60.5", "second must be"),
        ("12-31T23:59:59.5", "12-31T23:59:61.5", "second must be"),
        ("12-31T23:59:59.5", "12-31 23:59:59.5", "expected an instant such as"),
        ("12-31T23:59:60.5", "12-31T23:59:59.5", "is not after the instant before it"),
        ("01T00:00:00.5Z", "01T00:00:20", "lies outside START_TIME to STOP_TIME"),
        ("DATA_STOP\n", "", "ends within its data"),
        ("META_STOP\n", "", "expected KEYWORD = VALUE, found 'DATA_START'"),
        ("OBJECT_NAME = CUBE\n", "OBJECT_NAME = CUBE\nOBJECT_NAME = CUBE\n", "is given twice"),
        ("OBJECT_NAME = CUBE\n", "", "OBJECT_NAME: is missing"),
        ("DATA_START\n", "DATA_START\nX = 1\n", "has no place here"),
    ],
)
def test_damage_is_one_line(old, new, expected, tmp_path):
    assert old in MESSAGE
    with pytest.raises(InputError) as error:
        read(MESSAGE.replace(old, new, 1), tmp_path)
    assert expected in str(error.value) and re.match(r"\S+x\.aem:\d+: ", str(error.value))


def test_what_version_2_cannot_say_is_refused(ephemeris):
    with pytest.raises(ValueError, match="A2B and LAST only"):
        aem_text(ephemeris, created=NOW, direction="B2A")
    with pytest.raises(ValueError, match="one line"):
        aem_text(ephemeris, created=NOW, comments=("two\nlines",))
