"""CZML: frames, the order of quaternions, and enough samples of a fast attitude."""

import erfa
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.math.attitude_between import attitude_between
from jaxsat.telemetry.czml import LARGEST_TURN, czml_document, fixed_from_body, icrf_quaternion, to_celestial
from jaxsat.time import Epoch, greenwich_angle

EPOCH = Epoch.from_iso("2001-01-18T04:54:15")
T = 64.0 * np.arange(10)
RATE = np.array([0.02, 0.06, -0.05])
"""[rad/s]: 81 deg of turn between samples for each 0.022 of it."""


def spinning(t, base=(0.3, -0.5, 0.2)):
    return Rotation.from_rotvec(base) * Rotation.from_rotvec(np.multiply.outer(t, RATE))


def scalar_first(rotation):
    return np.roll(rotation.as_quat(), 1, axis=-1)


@pytest.mark.parametrize("speed", [0.01, 0.3, 1.0])
def test_a_constant_rate_is_followed_through_whole_turns(speed):
    t = T / speed * 0.3
    q, rates = scalar_first(spinning(t * speed)), np.tile(RATE * speed, (len(t), 1))
    fine, found = attitude_between(t, q, rates, largest_turn=LARGEST_TURN)
    assert np.all(np.isin(np.round(t, 9), np.round(fine, 9))) and np.all(np.diff(fine) > 0.0)
    error = (Rotation.from_quat(np.roll(found, -1, axis=1)).inv() * spinning(fine * speed)).magnitude()
    assert np.max(error) < 1e-9
    attitudes = Rotation.from_quat(np.roll(found, -1, axis=1))
    assert np.max((attitudes[:-1].inv() * attitudes[1:]).magnitude()) <= LARGEST_TURN


def test_a_changing_rate_is_followed_to_fourth_order():
    """Two turns in sequence: 15 deg about z at a changing rate, and half that about x."""

    def attitude(t):
        return Rotation.from_euler("ZX", np.column_stack([0.6 * np.sin(t / 40.0), 0.3 * np.cos(t / 30.0)]))

    errors = []
    for step in (16.0, 8.0):
        t, h = np.arange(0.0, 161.0, step), 1e-5
        rates = (attitude(t - h).inv() * attitude(t + h)).as_rotvec() / (2 * h)
        fine, found = attitude_between(t, scalar_first(attitude(t)), rates, largest_turn=0.02)
        errors.append(np.max((Rotation.from_quat(np.roll(found, -1, axis=1)).inv() * attitude(fine)).magnitude()))
    assert errors[0] < 1e-4 and errors[1] < errors[0] / 12.0


def test_a_known_axis_in_earth_fixed_and_celestial_axes():
    """Body x along the equinox of date: Greenwich sees it at minus its own angle, the ICRF where the equinox is."""
    t = np.array([0.0, 3600.0])
    q = np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))
    fixed = Rotation.from_quat(fixed_from_body(EPOCH, t, q)).apply([1.0, 0.0, 0.0])
    for k in range(2):
        angle = greenwich_angle(EPOCH.shifted(float(t[k])))
        np.testing.assert_allclose(fixed[k], [np.cos(angle), -np.sin(angle), 0.0], atol=1e-9)
    equinox = np.linalg.inv(erfa.pnm06a(*EPOCH.tt()))[:, 0]
    for eme2000 in (False, True):
        x_axis = Rotation.from_quat(np.roll(icrf_quaternion(EPOCH, t, q, eme2000=eme2000), -1, axis=1)).apply([1, 0, 0])
        bias = np.linalg.norm(x_axis[0] - equinox)
        assert bias < 1e-15 if not eme2000 else 1e-9 < bias < 2e-7
    # EME2000 by another way: precession and nutation alone.
    _, _, _, _, precession, _, nutation, _ = erfa.pn06a(*EPOCH.tt())
    np.testing.assert_allclose(to_celestial(EPOCH, t, eme2000=True)[0], (nutation @ precession).T, atol=1e-14)


def test_the_document():
    position = 7e6 * np.column_stack([np.cos(T / 900), np.sin(T / 900), 0 * T])
    velocity = 7e6 / 900 * np.column_stack([-np.sin(T / 900), np.cos(T / 900), 0 * T])
    q, rates = scalar_first(spinning(T)), np.tile(RATE, (len(T), 1))
    document, packet = czml_document(
        "CUBE",
        EPOCH,
        T,
        position_eci_m=position,
        velocity_eci_m_s=velocity,
        q_inertial_from_body=q,
        angular_velocity=rates,
    )
    assert document["id"] == "document" and document["version"] == "1.0"
    assert packet["availability"] == "2001-01-18T04:54:15.000Z/2001-01-18T05:03:51.000Z"
    place, turn = packet["position"], packet["orientation"]
    assert place["referenceFrame"] == "INERTIAL"
    samples = np.reshape(place["cartesianVelocity"], (-1, 7))
    np.testing.assert_allclose(samples[:, 0], T)
    # The axes of 2001 lie 1' from those of the ICRF.
    apart = np.linalg.norm(samples[:, 1:4] - position, axis=1) / 7e6
    assert np.all((apart > 1e-5) & (apart < 4e-4))
    quaternions = np.reshape(turn["unitQuaternion"], (-1, 5))
    np.testing.assert_allclose(np.linalg.norm(quaternions[:, 1:], axis=1), 1.0, atol=1e-11)
    assert len(quaternions) > 5 * len(T)
    assert np.min(np.sum(quaternions[1:, 1:] * quaternions[:-1, 1:], axis=1)) > 0.9
    last = Rotation.from_quat(quaternions[-1, 1:])
    earth = Rotation.from_euler("z", -greenwich_angle(EPOCH.shifted(float(T[-1]))))
    assert (last.inv() * earth * spinning(T[-1])).magnitude() < 1e-8
