"""Sampled orbit: Hermite's remainder along Kepler ellipses, exact derivatives, ends of the span announced."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.environment import KeplerOrbit, SampledOrbit, orbit_from_elements_km_deg, sample_orbit

RADIUS, MU = 7e6, 3.986004415e14
RATE = np.sqrt(MU / RADIUS**3)
at_many = eqx.filter_jit(lambda orbit, times: jax.vmap(orbit)(times))


def circle(times):
    """States on a circle in the plane of a 3-4-5 triangle: a closed form that owes nothing to the code."""
    c, s = np.cos(RATE * times), np.sin(RATE * times)
    position = RADIUS * np.stack([c, 0.6 * s, 0.8 * s], axis=1)
    velocity = RADIUS * RATE * np.stack([-s, 0.6 * c, 0.8 * c], axis=1)
    return position, velocity


def sampled_circle(step, samples=40, start=0.0):
    return SampledOrbit(start, step, *circle(start + step * np.arange(samples)))


@pytest.mark.parametrize("step", [60.0, 180.0, 600.0])
def test_error_is_that_of_hermites_remainder(step):
    times = np.linspace(0.0, 39 * step, 2001)
    position, velocity = at_many(sampled_circle(step), jnp.asarray(times))
    error = np.linalg.norm(position - circle(times)[0], axis=1)
    inner = (times > step) & (times < 38 * step)
    # (u + 1)^2 u^2 (u - 1)^2 (u - 2)^2 / 8! has its maximum 0.316/8! at u = 1/2, and 0.89/8! between the end nodes;
    # 4 ulp of 7e6 m are rounding.
    remainder = (RATE * step) ** 8 * RADIUS / 40320
    assert np.max(error[inner]) < 0.32 * remainder + 4e-9
    assert np.max(error) < 1.01 * remainder + 4e-9
    # The documented figures for this orbit, and the velocity: a derivative costs a factor of 8/h at most.
    assert np.max(error[inner]) < {60.0: 2e-8, 180.0: 1.2e-4, 600.0: 1.7}[step]
    np.testing.assert_allclose(velocity, circle(times)[1], atol=8 * remainder / step + 1e-8)


def test_perigee_of_an_eccentric_orbit():
    orbit = orbit_from_elements_km_deg(a_km=26600, e=0.72, i_deg=63, raan_deg=1, argp_deg=9, mean_anomaly_deg=-20)
    times = 60.0 * np.arange(40)
    sampled = SampledOrbit(0.0, 60.0, *at_many(orbit, jnp.asarray(times)))
    between = jnp.linspace(0.0, times[-1], 1000)
    np.testing.assert_allclose(at_many(sampled, between)[0], at_many(orbit, between)[0], atol=5e-5)


def test_samples_are_met_and_velocity_is_the_derivative():
    orbit = sampled_circle(180.0, start=-500.0)
    times = -500.0 + 180.0 * np.arange(40)
    position, velocity = at_many(orbit, jnp.asarray(times))
    np.testing.assert_allclose(position, orbit.position_eci, atol=4e-9)
    np.testing.assert_allclose(velocity, orbit.velocity_eci, atol=1e-9)
    rate = jax.jit(jax.vmap(jax.jacfwd(lambda t: orbit(t)[0])))
    for t in (jnp.asarray(times), jnp.linspace(-500.0, 6520.0, 77)):
        # Also at the nodes, where the window moves on, and at both ends.
        np.testing.assert_allclose(rate(t), at_many(orbit, t)[1], atol=1e-9)


def test_gradients_against_differences():
    orbit = sampled_circle(180.0)
    toward = jax.tree.map(lambda x: jnp.asarray(np.random.default_rng(4).normal(size=x.shape)), orbit)
    # A change of the step moves the late samples forty times as far.
    toward = eqx.tree_at(lambda o: (o.start, o.step), toward, (jnp.asarray(1e-3), jnp.asarray(1e-5)))

    def moved(s, t):
        return jnp.concatenate(jax.tree.map(lambda x, d: x + s * d, orbit, toward)(t))

    value, forward, backward = (jax.jit(f) for f in (moved, jax.jacfwd(moved), jax.jacrev(moved)))
    # First and last interval, a node, where the window moves on, and the middle of one.
    for t in (1.0, 180.0, 3330.0, 7019.0):
        found = forward(0.0, t)
        np.testing.assert_allclose(found, backward(0.0, t), rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(found, (value(1.0, t) - value(-1.0, t)) / 2.0, rtol=1e-5, atol=1e-6)


def test_times_outside_are_announced_and_never_extrapolated():
    orbit = sampled_circle(60.0, samples=11, start=100.0)
    orbit.check_span(np.linspace(100.0, 700.0, 50))
    # Rounding of summed steps at the ends is no error.
    orbit.check_span(np.array([100.0 - 1e-9, 700.0 + 1e-9]))
    assert np.all(np.isfinite(at_many(orbit, jnp.asarray([100.0 - 1e-9, 700.0 + 1e-9]))[0]))
    for bad in (99.9, 700.1, np.nan):
        with pytest.raises(ValueError, match=r"^times must lie in 100\.\.700 s, where samp.*got (99.9|700.1|nan)"):
            orbit.check_span(np.array([300.0, bad]))
        assert all(np.all(np.isnan(x)) for x in at_many(orbit, jnp.asarray([bad])))
    KeplerOrbit(7e6, 0.0, 0.0, 0.0, 0.0, 0.0).check_span(np.array([-1e9, 1e9]))


def test_single_precision_stays_single():
    orbit = jax.tree.map(lambda x: x.astype(jnp.float32), sampled_circle(60.0))
    position, velocity = at_many(orbit, jnp.asarray([100.0, 1000.0], jnp.float32))
    assert position.dtype == velocity.dtype == jnp.float32
    # Half a metre is one unit in the last place of 7e6.
    np.testing.assert_allclose(position, circle(np.array([100.0, 1000.0]))[0], atol=3.0)


@pytest.mark.slow
def test_samples_of_another_orbit():
    orbit = orbit_from_elements_km_deg(a_km=384400, e=0.055, i_deg=25, raan_deg=1, argp_deg=9, mean_anomaly_deg=-5)
    sampled = sample_orbit(orbit, start=-100.0, stop=86400.0, step=3600.0)
    assert float(sampled.step) == pytest.approx(86500 / 25) and float(sampled.end) == pytest.approx(86400.0)
    t = jnp.linspace(-100.0, 86400.0, 333)
    # (n h)^8 = 7e-17 of 4e8 m: rounding alone.
    np.testing.assert_allclose(at_many(sampled, t)[0], at_many(orbit, t)[0], atol=1e-6)
    for bad in ({"stop": -200.0}, {"step": 0.0}):
        with pytest.raises(ValueError, match="start < stop"):
            sample_orbit(orbit, **{"start": -100.0, "stop": 86400.0, "step": 60.0, **bad})


@pytest.mark.parametrize("step, samples, named", [(60.0, 3, "position_eci"), (0.0, 9, "step"), (-60.0, 9, "step")])
def test_refuses_what_is_no_orbit(step, samples, named):
    with pytest.raises(ValueError, match=f"^{named} must"):
        SampledOrbit(0.0, step, *circle(60.0 * np.arange(samples)))
