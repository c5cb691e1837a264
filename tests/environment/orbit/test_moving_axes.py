"""Motion of the true axes: an ellipse among the stars, seen from axes of date by ERFA's matrices, is reproduced."""

import equinox as eqx
import erfa
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.environment import CentralGravity, frame_motion, orbit_from_elements_km_deg, propagate_orbit
from jaxsat.time import Epoch

EPOCH = Epoch.from_utc(2022, 1, 28)
DAYS = 5.0
STAR_ORBIT = orbit_from_elements_km_deg(a_km=7000, e=0.01, i_deg=51.6, raan_deg=10, argp_deg=0, mean_anomaly_deg=0)


def true_from_stars(days):
    tt1, tt2 = EPOCH.tt()
    return erfa.pnm06a(tt1, tt2 + days)


def test_angular_velocity_is_precession_with_nutation():
    year = 365.25 * 86400.0
    motion = frame_motion(EPOCH, start=0.0, stop=year)
    mean = np.mean(np.asarray(motion.angular_velocity), axis=0)
    # The turn that the matrices of a year apart leave, 2e-4 rad; commutators are 1e-4 of it.
    turn = Rotation.from_matrix(true_from_stars(365.25) @ true_from_stars(0.0).T).as_rotvec()
    np.testing.assert_allclose(mean, -turn / year, rtol=0, atol=3e-3 * 7.7e-12)
    # 50.29" a year backward about the pole of the ecliptic; the Moon's node adds up to 6" within 18.6 years.
    tilt = np.radians(23.437)
    expected = np.radians(50.29 / 3600) / year * np.array([0.0, np.sin(tilt), -np.cos(tilt)])
    np.testing.assert_allclose(mean, expected, rtol=0, atol=0.2 * 7.7e-12)


@pytest.mark.slow
def test_an_ellipse_among_the_stars():
    days = np.linspace(0.0, DAYS, 11)
    dcm = true_from_stars(days)
    motion = frame_motion(EPOCH, start=0.0, stop=DAYS * 86400)
    r, v = (np.asarray(x) for x in jax.jit(jax.vmap(STAR_ORBIT))(jnp.asarray(86400 * days)))
    w = np.asarray(motion.turning(jnp.zeros(1))[0][0])
    state = jnp.asarray(np.concatenate([dcm[0] @ r[0], dcm[0] @ v[0] - np.cross(w, dcm[0] @ r[0])]))
    run = eqx.filter_jit(lambda state, forces: propagate_orbit(state[:3], state[3:], forces, stop=DAYS * 86400))
    expected = np.einsum("nij,nj->ni", dcm, r)
    at = jax.jit(lambda orbit, times: jax.vmap(orbit)(times))
    found, _ = at(run(state, (CentralGravity(), motion)), jnp.asarray(86400 * days))
    # 0.1 mm of the integration over five days, found with 30 s as well as with 60 s.
    np.testing.assert_allclose(found, expected, rtol=0, atol=3e-4)
    # Without the motion of the axes the satellite is a hundred metres off.
    still, _ = at(run(state, (CentralGravity(), motion_of_still_axes(motion))), jnp.asarray(86400 * days))
    assert 100 < np.linalg.norm(still[-1] - expected[-1]) < 300


def motion_of_still_axes(motion):
    return eqx.tree_at(
        lambda m: (m.angular_velocity, m.angular_acceleration), motion, replace_fn=lambda x: jnp.zeros_like(x)
    )


def test_nothing_outside_the_span_and_no_empty_one():
    motion = frame_motion(EPOCH, start=-100.0, stop=86400.0)
    w, _ = eqx.filter_jit(motion.turning)(jnp.asarray([-100.0, 86400.0, -1e6, 1e6]))
    assert np.array_equal(np.isfinite(w[:, 0]), [True, True, False, False])
    with pytest.raises(ValueError, match="^stop must be later"):
        frame_motion(EPOCH, start=0.0, stop=0.0)
