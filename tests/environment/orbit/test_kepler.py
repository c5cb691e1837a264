"""Kepler orbit: Table 1 of Penkov (2009), numerical integration, invariants, exact derivatives."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from jaxsat.constants import EARTH_MU
from jaxsat.environment import (
    KeplerOrbit,
    elements_from_state,
    orbit_from_elements_km_deg,
    orbit_from_perigee_time_km_deg,
    solve_kepler,
)

at = eqx.filter_jit(lambda orbit, t: orbit(t))
from_state = jax.jit(elements_from_state)
kepler = jax.jit(solve_kepler)
kepler_gradient = jax.jit(jax.grad(solve_kepler, argnums=(0, 1)))

MUNIN = orbit_from_perigee_time_km_deg(
    a_km=7630.026457, e=0.072661, i_deg=95.438873, raan_deg=64.81879, argp_deg=16.675906, t_perigee_s=3230.533197
)


def test_munin_at_epoch():
    position, _ = at(MUNIN, jnp.zeros(()))
    np.testing.assert_allclose(np.asarray(position) / 1e3, [-3504.82055, -6809.61337, -2881.70577], atol=1e-5)
    assert float(MUNIN.mean_motion) == pytest.approx(9.47283e-4, abs=5e-10)
    assert float(MUNIN.period) == pytest.approx(6632.848, abs=5e-4)


@pytest.mark.parametrize("e", [0.0, 0.0727, 0.5, 0.9, 0.95])
def test_kepler_equation(e):
    m = np.concatenate([np.linspace(-20.0, 20.0, 4001), np.geomspace(1e-12, 1.0, 200)])
    anomaly = np.asarray(kepler(jnp.asarray(m), jnp.full(m.shape, e))).astype(np.longdouble)
    error = (anomaly - e * np.sin(anomaly) - m) / (1.0 - e * np.cos(anomaly))
    # A few units in the last place of E (|E| <= 20); near perigee the division by 1 - e magnifies rounding of M.
    assert np.max(np.abs(error)) < 4e-15 / (1.0 - e)


@pytest.mark.parametrize("e", [0.0, 0.3, 0.9])
@pytest.mark.parametrize("m", [0.0, 1e-9, 0.3, np.pi, 4.0])
def test_kepler_derivative_is_that_of_the_equation(m, e):
    d_m, d_e = kepler_gradient(jnp.asarray(m), jnp.asarray(e))
    h = 1e-6
    values = [np.asarray(kepler(jnp.asarray(m + s), jnp.asarray(e))) for s in (-h, h)]
    assert float(d_m) == pytest.approx((values[1] - values[0]) / (2 * h), rel=1e-6)
    anomaly = float(kepler(jnp.asarray(m), jnp.asarray(e)))
    assert float(d_e) == pytest.approx(np.sin(anomaly) / (1 - e * np.cos(anomaly)), rel=1e-12, abs=1e-15)


def test_against_numerical_integration():
    times = np.linspace(0.0, 6632.848, 8)
    position, velocity = (np.asarray(x) for x in jax.jit(jax.vmap(MUNIN))(jnp.asarray(times)))

    def gravity(_, y):
        return np.concatenate([y[3:], -EARTH_MU * y[:3] / np.linalg.norm(y[:3]) ** 3])

    start = np.concatenate([position[0], velocity[0]])
    path = solve_ivp(gravity, (0.0, times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-6).y.T
    # The integrator's own error at rtol 1e-12 over one revolution is of the order of a millimetre.
    np.testing.assert_allclose(position, path[:, :3], atol=0.02)
    np.testing.assert_allclose(velocity, path[:, 3:], atol=2e-5)


def test_circular_orbit_is_uniform_motion():
    orbit = orbit_from_elements_km_deg(a_km=7000, e=0, i_deg=90, raan_deg=0, argp_deg=0, mean_anomaly_deg=0)
    t = 1000.0
    position, velocity = at(orbit, jnp.asarray(t))
    n = np.sqrt(EARTH_MU / 7e6**3)
    np.testing.assert_allclose(position, 7e6 * np.array([np.cos(n * t), 0, np.sin(n * t)]), atol=1e-6)
    np.testing.assert_allclose(velocity, 7e6 * n * np.array([-np.sin(n * t), 0, np.cos(n * t)]), atol=1e-9)
    gradient = jax.jit(jax.jacrev(lambda o: o(jnp.asarray(t))))(orbit)
    assert all(np.all(np.isfinite(x)) for x in jax.tree.leaves(gradient))


@pytest.mark.parametrize("e, i_deg, argp_deg", [(0.072661, 95.4, 16.7), (0.7, 63.4, 270.0), (1e-6, 40.0, 10.0)])
@pytest.mark.parametrize("mean_anomaly_deg", [0.0, 80.0, 200.0, 340.0])
def test_elements_survive_the_round_trip(e, i_deg, argp_deg, mean_anomaly_deg):
    orbit = orbit_from_elements_km_deg(
        a_km=9000, e=e, i_deg=i_deg, raan_deg=300, argp_deg=argp_deg, mean_anomaly_deg=mean_anomaly_deg
    )
    back = from_state(*at(orbit, jnp.zeros(())))
    for t in (0.0, 1234.5):
        np.testing.assert_allclose(at(back, jnp.asarray(t))[0], at(orbit, jnp.asarray(t))[0], atol=1e-5)
    assert float(back.eccentricity) == pytest.approx(e, abs=1e-13)
    assert float(back.raan) == pytest.approx(float(orbit.raan), abs=1e-12)
    if e > 1e-3:
        assert float(back.argument_of_perigee) == pytest.approx(float(orbit.argument_of_perigee), abs=1e-11)


def test_gradient_in_the_elements_against_finite_differences():
    t = jnp.asarray(2000.0)
    jacobian = jax.jit(jax.jacfwd(lambda o: o(t)[0]))(MUNIN)
    leaves, tree = jax.tree.flatten(MUNIN)
    for k, (leaf, column) in enumerate(zip(leaves, jax.tree.leaves(jacobian), strict=True)):
        h = 1e-6 * max(1.0, abs(float(leaf)))
        moved = [jax.tree.unflatten(tree, [x + s * (j == k) for j, x in enumerate(leaves)]) for s in (-h, h)]
        difference = (at(moved[1], t)[0] - at(moved[0], t)[0]) / (2 * h)
        np.testing.assert_allclose(column, difference, rtol=1e-6, atol=1e-7 * np.max(np.abs(difference)))


@pytest.mark.parametrize(
    "e, i_deg",
    [(0.0, 51.0), (0.0, 0.0), (0.0, 180.0), (0.1, 0.0), (0.1, 180.0), (0.1, 51.0), (0.9, 90.0), (1e-9, 1e-9)],
)
def test_derivatives_through_a_state_are_those_of_the_motion(e, i_deg):
    """Whatever the orbit: position and velocity by those at t = 0, against the variational equations by SciPy."""
    orbit = orbit_from_elements_km_deg(a_km=9000, e=e, i_deg=i_deg, raan_deg=20, argp_deg=40, mean_anomaly_deg=70)
    start = np.concatenate(at(orbit, jnp.zeros(())))

    def variations(_, y):
        r, distance = y[:3], np.linalg.norm(y[:3])
        gradient = EARTH_MU / distance**5 * (3.0 * np.outer(r, r) - distance**2 * np.eye(3))
        matrix = y[6:].reshape(6, 6)
        rates = np.vstack([matrix[3:], gradient @ matrix[:3]])
        return np.concatenate([y[3:6], -EARTH_MU * r / distance**3, rates.ravel()])

    whole = np.concatenate([start, np.eye(6).ravel()])
    for t in (-3000.0, 11000.0):
        found, slopes = map(np.asarray, moved_by_state(jnp.asarray(start), jnp.asarray(t)))
        end = solve_ivp(variations, (0.0, t), whole, "DOP853", rtol=1e-12, atol=1e-9).y[:, -1]
        np.testing.assert_allclose(found[:3], end[:3], rtol=0, atol=0.02)
        # Metres and seconds: the columns of the velocity are longer by the time passed.
        scale = np.abs(end[6:].reshape(6, 6)).max(axis=0, keepdims=True)
        np.testing.assert_allclose(slopes / scale, end[6:].reshape(6, 6) / scale, rtol=0, atol=1e-7)


@jax.jit
def moved_by_state(state, t):
    def end(state):
        moved = jnp.concatenate(elements_from_state(state[:3], state[3:])(t))
        return moved, moved

    slopes, moved = jax.jacfwd(end, has_aux=True)(state)
    return moved, slopes


def test_refuses_what_is_no_ellipse():
    for given, words in (
        ({"e": 1.1}, "^e must be in 0..0.95, got 1.1"),
        ({"a_km": -7000}, "^a_km must be positive, got -7000"),
        ({"raan_deg": np.nan}, "^KeplerOrbit: raan must be finite, got nan"),
        ({"mean_anomaly_deg": np.inf}, "^KeplerOrbit: mean_anomaly must be finite, got inf"),
    ):
        elements = {"a_km": 7000, "e": 0.1, "i_deg": 0, "raan_deg": 0, "argp_deg": 0, "mean_anomaly_deg": 0, **given}
        with pytest.raises(ValueError, match=words):
            orbit_from_elements_km_deg(**elements)
    for place, value in ((1, 2.0), (0, -7e6), (4, np.nan)):
        numbers = [7e6, 0.1, 1.0, 0.0, 0.0, 0.0]
        numbers[place] = value
        with pytest.raises(
            ValueError, match="^KeplerOrbit: (eccentricity|semi_major_axis|argument_of_perigee) must be"
        ):
            KeplerOrbit(*numbers)
    position, fast = jnp.asarray([7e6, 0.0, 0.0]), np.sqrt(2.0 * EARTH_MU / 7e6)
    for velocity in ([0.0, 1.01 * fast, 0.0], [0.0, fast, 0.0], [1.0, 0.0, 0.0]):
        with pytest.raises(ValueError, match=r"^expected the state of an ellipse of e in 0..0.95, got e = 1"):
            elements_from_state(position, jnp.asarray(velocity))
    for r, v in ((jnp.zeros(3), position), (position, position * jnp.nan)):
        with pytest.raises(ValueError, match="^expected a finite state off the Earth's centre"):
            elements_from_state(r, v)
