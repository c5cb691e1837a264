"""The Sun-ecliptic frame and the start of the transition in it, against ERFA and plane geometry."""

import erfa
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.control.emergency_mode.draw import Dispersions, draw_cases
from jaxsat.control.emergency_mode.start import held_attitude, sun_ecliptic_axes, transition_start
from jaxsat.control.emergency_mode.vehicle import START_UTC
from jaxsat.environment import apparent_sun
from jaxsat.time import Epoch

EPOCH = Epoch.from_utc(*START_UTC)


def pole():
    """Of the ecliptic of date in true equatorial axes, by ERFA."""
    tt = EPOCH.tt()
    return erfa.pnm06a(*tt) @ erfa.ecm06(*tt)[2]


def test_axes_are_those_of_erfa():
    sun = apparent_sun(EPOCH, np.zeros(1))[0][0]
    found = np.asarray(sun_ecliptic_axes(jnp.asarray(sun), jnp.asarray(EPOCH.tt_centuries())))
    np.testing.assert_allclose(found[:, 2], pole(), atol=3e-7)
    np.testing.assert_allclose(found[:, 0], sun, atol=1e-5)
    np.testing.assert_allclose(found.T @ found, np.eye(3), atol=1e-14)
    assert np.linalg.det(found) == pytest.approx(1.0)


@pytest.mark.slow
@pytest.mark.parametrize("side", ["coming", "going"])
def test_the_start_is_eleven_degrees_off_and_turns_with_the_sun(flight, legs, side):
    period, off, rate = transition_start(flight, 11.0, side)
    around = legs(period)
    position, normal = np.asarray(around.position_eci[0]), np.asarray(around.normal_eci[0])
    up = position / np.linalg.norm(position)
    wanted = Rotation.from_matrix(np.stack([-normal, up, np.cross(up, normal)], axis=1))
    body = wanted * Rotation.from_quat([*off[1:], off[0]])
    # Half a period's turn of the orbit is 0.5 deg.
    error = Rotation.from_quat([*off[1:], off[0]]).magnitude()
    assert np.degrees(error) == pytest.approx(11.0, abs=0.5)
    x, y, _ = body.as_matrix().T
    np.testing.assert_allclose(y, pole(), atol=1e-6)
    # x is as near to the antinormal as it can be across the pole: by the angle of that from the ecliptic.
    assert np.arccos(-x @ normal) == pytest.approx(abs(np.arcsin(normal @ y)), abs=1e-6)
    assert np.degrees(np.arcsin(normal @ y)) == pytest.approx(6.65, abs=0.05)
    # The vertical is before the pole or behind it.
    assert np.sign(np.cross(normal, up) @ y) == (1.0 if side == "coming" else -1.0)
    suns = apparent_sun(EPOCH, 16.0 * period + np.array([0.0, 3600.0]))[0]
    turned = np.arctan2(pole() @ np.cross(suns[0], suns[1]), suns[0] @ suns[1]) / 3600.0
    np.testing.assert_allclose(rate, [0.0, turned, 0.0], rtol=1e-3, atol=1e-12)


@pytest.mark.slow
def test_no_start_nearer_than_the_plane_passes_the_pole(flight):
    with pytest.raises(ValueError, match=r"off_deg must be more than 6\.6\d deg, the nearest of the turn, got 5"):
        transition_start(flight, 5.0)


def test_slopes_against_differences():
    """Of the attitude held by the Sun's direction and the orbit's normal."""
    centuries = jnp.asarray(EPOCH.tt_centuries())

    def held(x):
        return held_attitude(sun_ecliptic_axes(x[:3], centuries), x[3:])[0].ravel()

    x = np.concatenate([apparent_sun(EPOCH, np.zeros(1))[0][0], [0.769, -0.6228, -0.1438]])
    both = jax.jit(lambda x: (held(x), jax.jacfwd(held)(x)))
    slopes = np.asarray(both(jnp.asarray(x))[1])
    for k in range(6):
        step = 1e-6 * np.eye(6)[k]
        ends = [np.asarray(both(jnp.asarray(x + way * step))[0]) for way in (1, -1)]
        np.testing.assert_allclose(slopes[:, k], (ends[0] - ends[1]) / 2e-6, atol=1e-8)


@pytest.mark.slow
def test_a_start_may_turn_with_the_orbit(around):
    spread = Dispersions(max_error_deg=40.0, max_rate_deg_s=0.002, orbital=True)
    draw = jax.jit(
        lambda around, keys: draw_cases(spread, around, keys).state.seen.rate_error,
        compiler_options={"xla_backend_optimization_level": 0},
    )
    rates = np.linalg.norm(draw(around, jax.random.split(jax.random.key(0), 50)), axis=1)
    assert 0.001 < np.degrees(rates.max()) <= 0.002
