"""The dipole of three coils: what lies across the field of a wanted torque, within limits, and only where it pays."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.control.magnetic_actuator import actuator_dipole, saturated

dipole_of = jax.jit(actuator_dipole)
FIELD = np.array([1.2e-5, -2.0e-5, 2.6e-5])


def test_torque_is_what_lies_across_the_field():
    rng = np.random.default_rng(0)
    for _ in range(20):
        torque = np.cross(FIELD, rng.normal(size=3)) * 10.0 + rng.normal() * FIELD
        dipole = np.asarray(dipole_of(jnp.asarray(torque), jnp.asarray(FIELD), 1e9))
        b = FIELD / np.linalg.norm(FIELD)
        np.testing.assert_allclose(np.cross(dipole, FIELD), torque - b * (b @ torque), atol=1e-15)
        assert dipole @ FIELD == pytest.approx(0.0, abs=1e-12)


def test_sign_by_behaviour():
    """A satellite turned by a small angle about x and asked back by -J k angle turns back."""
    dipole = np.asarray(dipole_of(jnp.array([-1e-3, 0.0, 0.0]), jnp.array([0.0, 3e-5, 0.0]), 300.0))
    assert np.cross(dipole, [0.0, 3e-5, 0.0])[0] == pytest.approx(-1e-3)


def test_saturation_keeps_the_direction():
    x = jnp.array([3.0, -6.0, 1.5])
    np.testing.assert_allclose(saturated(x, 2.0), [1.0, -2.0, 0.5])
    np.testing.assert_array_equal(saturated(x, 6.0), x)
    np.testing.assert_array_equal(saturated(jnp.zeros(3), 1.0), np.zeros(3))
    torque = 10.0 * np.cross(FIELD, [1.0, 2.0, 3.0]) / np.linalg.norm(FIELD)
    free, held = (np.asarray(dipole_of(jnp.asarray(torque), jnp.asarray(FIELD), limit)) for limit in (1e9, 300.0))
    assert np.abs(held).max() == pytest.approx(300.0)
    np.testing.assert_allclose(held / np.linalg.norm(held), free / np.linalg.norm(free), atol=1e-14)


def test_duty_is_asked_of_the_whole_torque():
    """44 deg from the field it stays off, 46 deg from it works; after the projection the angle would always be 90."""
    b = FIELD / np.linalg.norm(FIELD)
    across = np.cross(b, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(b, [0.0, 0.0, 1.0]))
    for angle_deg, works in ((44.0, False), (46.0, True), (134.0, True), (136.0, False)):
        a = np.radians(angle_deg)
        torque = 1e-3 * (np.cos(a) * b + np.sin(a) * across)
        assert np.any(np.asarray(dipole_of(jnp.asarray(torque), jnp.asarray(FIELD), 300.0))) == works
    assert not np.any(np.asarray(dipole_of(jnp.zeros(3), jnp.asarray(FIELD), 300.0)))
    assert not np.any(np.asarray(dipole_of(jnp.ones(3), jnp.zeros(3), 300.0)))


def test_slopes_against_differences():
    """By torque and field: free, at the limit of one coil, and where nothing is wanted."""
    full = jax.jit(jax.jacfwd(actuator_dipole, argnums=(0, 1)))
    for torque, limit in (([1e-3, 2e-3, -1e-3], 1e9), ([0.01, 0.02, -0.01], 100.0), ([0.0, 0.0, 0.0], 100.0)):
        torque = np.array(torque)
        found = full(jnp.asarray(torque), jnp.asarray(FIELD), limit)
        assert all(np.isfinite(x).all() for x in found)
        if not torque.any():
            continue
        for k, step in enumerate((1e-8, 1e-11)):
            for axis in range(3):
                ends = []
                for way in (1, -1):
                    inputs = [torque.copy(), FIELD.copy()]
                    inputs[k][axis] += way * step
                    ends.append(np.asarray(dipole_of(*map(jnp.asarray, inputs), limit)))
                slope = (ends[0] - ends[1]) / (2 * step)
                scale = np.abs(np.asarray(found[k])).max()
                np.testing.assert_allclose(np.asarray(found[k])[:, axis], slope, atol=1e-5 * scale)
