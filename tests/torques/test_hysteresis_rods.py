"""Hysteresis rods at one instant: loop and moment from the textbook, the way back, slopes at turns and boundaries."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.spacecraft import HysteresisRods, MagneticRods, SolarPanels, Spacecraft, box_normals
from jaxsat.torques import (
    BodyEnvironment,
    HysteresisRodsTorque,
    hysteresis_dipole,
    induction_from_lag,
    lag_from_induction,
    lag_rate,
)

MU0 = 1.25663706127e-6
AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.6, 0.8]])
VOLUMES = np.array([3e-7, 5e-7])
HC, BR, BS = np.array([12.0, 1.59]), np.array([0.004, 0.35]), np.array([0.025, 0.73])
K = np.tan(np.pi * BR / (2 * BS)) / HC
Q0, P = 0.085, 4.75
RODS = HysteresisRods(AXES, VOLUMES, HC, BR, BS, Q0, P)
FIELD = np.array([1.4e-5, -2.1e-5, 1.5e-5])
LINEAR = MagneticRods(jnp.zeros(0), jnp.zeros((0, 3)), jnp.asarray(3e-5))
PANELS = SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6))


def craft_with(rods: HysteresisRods | None = RODS):
    return Spacecraft(jnp.eye(3), jnp.zeros(3), LINEAR, PANELS, hysteresis_rods=rods)


def around(lag, field=FIELD):
    lag = None if lag is None else jnp.asarray(lag)
    return BodyEnvironment(jnp.asarray([7e6, 0, 0]), jnp.asarray(field), jnp.zeros(3), rod_lag=lag)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_lags_of_one_are_the_boundary_loops(sign):
    for field in (FIELD, -3 * FIELD, np.zeros(3)):
        h = AXES @ field / MU0
        expected = 2 * BS / np.pi * np.arctan(K * (h - sign * HC))
        found = jax.jit(induction_from_lag)(RODS, sign * jnp.ones(2), jnp.asarray(field))
        np.testing.assert_allclose(found, expected, rtol=1e-13)
        # Beyond them it is a parallel of the loop.
        beyond = induction_from_lag(RODS, 1.7 * sign * jnp.ones(2), jnp.asarray(field))
        expected = 2 * BS / np.pi * np.arctan(K * (h - 1.7 * sign * HC))
        np.testing.assert_allclose(beyond, expected, rtol=1e-13)
    # Without a field they are the remanence: a rod that has lagged behind a falling field keeps Br.
    np.testing.assert_allclose(induction_from_lag(RODS, -sign * jnp.ones(2), jnp.zeros(3)), sign * BR, rtol=1e-13)


def test_way_from_induction_to_lag_and_back():
    field = jnp.asarray([1.4e-5, 1e-6, -1.2e-6])
    for lag in ([0.0, 0.0], [0.7, -0.9], [-1.0, 1.0], [2.1, -3.0]):
        induction = induction_from_lag(RODS, jnp.asarray(lag), field)
        np.testing.assert_allclose(jax.jit(lag_from_induction)(RODS, induction, field), lag, atol=1e-13)
    # Demagnetised: H = Hc z, here within the loop for both rods.
    found = lag_from_induction(RODS, jnp.zeros(2), field)
    np.testing.assert_allclose(found, AXES @ np.asarray(field) / MU0 / HC, rtol=1e-13)
    # The atan reaches full saturation nowhere: 0.999 of it stands for it, and no slope goes through.
    h, most = AXES @ np.asarray(field) / MU0, np.tan(0.999 * np.pi / 2) / K
    for induction, effective in ((BS, most), (-2 * BS, -most)):
        found, slope = jax.jit(jax.value_and_grad(lambda b: jnp.sum(lag_from_induction(RODS, b, field))))(induction)
        np.testing.assert_allclose(found, np.sum((h - effective) / HC), rtol=1e-12)
        np.testing.assert_array_equal(slope, 0.0)


def test_rate_of_induction_is_the_published_one():
    """dB/dt by the chain rule through H and the lag against slope of the boundary at this B times Q, times dH/dt."""
    rng = np.random.default_rng(2)
    induction = jax.jit(lambda lag, field, rate, lag_rate: jax.jvp(
        lambda z, b: induction_from_lag(RODS, z, b), (lag, field), (lag_rate, rate)
    ))  # fmt: skip
    beyond = []
    for _ in range(12):
        lag, field, rate = rng.uniform(-2, 2, 2), 2e-5 * rng.normal(size=3), 1e-6 * rng.normal(size=3)
        z_rate = jax.jit(lag_rate)(RODS, jnp.asarray(lag), jnp.asarray(rate))
        b, b_rate = map(np.asarray, induction(*map(jnp.asarray, (lag, field, rate)), z_rate))
        h, h_rate = AXES @ field / MU0, AXES @ rate / MU0
        left_behind = np.tan(np.pi * b / (2 * BS)) / K - np.sign(h_rate) * HC
        distance = np.sign(h_rate) * (h - left_behind) / (2 * HC)
        share = Q0 + (1 - Q0) * np.clip(distance, 0.0, 1.0) ** P
        slope = 2 / np.pi * K * BS * np.cos(np.pi * b / (2 * BS)) ** 2
        np.testing.assert_allclose(b_rate, share * slope * h_rate, rtol=1e-9)
        beyond += np.sign(distance - np.clip(distance, 0.0, 1.0)).tolist()
    # Outward, along a parallel of the loop; back; and between the loops.
    assert set(beyond) == {1.0, -1.0, 0.0}


def test_moment_and_torque():
    lag = np.array([0.3, -0.8])
    h = AXES @ FIELD / MU0
    b = 2 * BS / np.pi * np.arctan(K * (h - HC * lag))
    moment = sum(v * x / MU0 * e for v, x, e in zip(VOLUMES, b, AXES, strict=True))
    np.testing.assert_allclose(
        hysteresis_dipole(RODS, jnp.asarray(lag), jnp.asarray(FIELD)), moment, rtol=1e-12, atol=1e-17
    )
    stacked = jax.tree.map(lambda x: jnp.stack([x, x]), around(lag))
    found = jax.jit(jax.vmap(HysteresisRodsTorque(), (None, 0)))(craft_with(), stacked)
    np.testing.assert_allclose(found, [np.cross(moment, FIELD)] * 2, rtol=1e-12)


def differences(function, x, h):
    return np.stack([(function(x + h * e) - function(x - h * e)) / (2 * h) for e in np.eye(len(x))], axis=-1)


def test_slopes_of_the_torque_against_differences():
    def function(x):
        rods = HysteresisRods(
            jnp.asarray(AXES), *(jnp.asarray(a) * (1 + x[k]) for k, a in enumerate((VOLUMES, HC, BR, BS)))
        )
        return HysteresisRodsTorque()(
            craft_with(rods), around(jnp.asarray([0.3, -0.8]) + x[4], jnp.asarray(FIELD) * (1 + x[5]))
        )

    # Steps of 1e-4: truncation 1e-8, rounding 1e-12.
    expected = differences(lambda x: np.asarray(jax.jit(function)(jnp.asarray(x))), np.zeros(6), 1e-4)
    assert np.all(np.any(expected != 0, axis=0))
    for jacobian in (jax.jacfwd, jax.jacrev):
        found = jax.jit(jacobian(function))(jnp.zeros(6))
        np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max())


rate_of = jax.jit(lambda z, rate, q0, p: lag_rate(HysteresisRods(AXES, VOLUMES, HC, BR, BS, q0, p), z, rate))
rate_slopes = jax.jit(jax.jacrev(lambda *a: rate_of(*a), argnums=(0, 1, 2, 3)))


@pytest.mark.parametrize("p", [1.0, 2.0, 4.75])
@pytest.mark.parametrize(
    "lag",
    [(0.3, -0.8), (1.0, -1.0), (-1.0, 1.0), (1.4, -1.2), (-1.4, 1.2)],
    ids=["inside", "boundary", "turned", "beyond", "back"],
)
def test_slopes_of_the_rate_against_differences(lag, p):
    """On the boundary too, where a rod follows its loop or has just left it, and beyond."""
    z, rate, q0, p = map(jnp.asarray, (lag, [1e-6, -2e-6, 1e-6], Q0, p))
    by_lag, by_rate, by_slope, by_exponent = map(np.asarray, rate_slopes(z, rate, q0, p))
    h, scale = 1e-5, np.abs(AXES @ np.asarray(rate) / MU0 / HC).max()
    for k in range(2):
        e = h * jnp.eye(2)[k]
        # The rate has corners on the boundaries: there the slope is the mean of the two sides, each to second order.
        sides = []
        for side in (1, -1):
            near, far = (np.asarray(rate_of(z + side * n * e, rate, q0, p)) for n in (1, 2))
            here = np.asarray(rate_of(z, rate, q0, p))
            sides.append(side * (4 * near - far - 3 * here) / (2 * h))
        np.testing.assert_allclose(by_lag[:, k], np.mean(sides, axis=0), atol=1e-8 * scale)
        # Linear in the field's rate: rounding alone, a millionth of 1 / (mu0 Hc).
        step = 1e-11
        e = step * jnp.asarray(AXES)[k]
        plus, minus = np.asarray(rate_of(z, rate + e, q0, p)), np.asarray(rate_of(z, rate - e, q0, p))
        np.testing.assert_allclose(by_rate @ AXES[k], (plus - minus) / (2 * step), atol=1e-6 / MU0 / 1.59)
    plus, minus = np.asarray(rate_of(z, rate, q0 + h, p)), np.asarray(rate_of(z, rate, q0 - h, p))
    np.testing.assert_allclose(by_slope, (plus - minus) / (2 * h), atol=1e-8 * scale)
    plus, minus = np.asarray(rate_of(z, rate, q0, p + h)), np.asarray(rate_of(z, rate, q0, p - h))
    np.testing.assert_allclose(by_exponent, (plus - minus) / (2 * h), atol=1e-8 * scale)


def test_slopes_where_the_field_stands_still_are_those_of_a_rising_one():
    """At dH/dt = 0 the rate is zero, with a corner: its slope is that of the side of rising fields, and finite."""
    for lag in ([0.3, -0.8], [1.0, -1.0]):
        z, zero = jnp.asarray(lag), jnp.zeros(3)
        np.testing.assert_array_equal(rate_of(z, zero, jnp.asarray(Q0), jnp.asarray(P)), 0.0)
        by_lag, by_rate, by_slope, by_exponent = rate_slopes(z, zero, jnp.asarray(Q0), jnp.asarray(P))
        for slope in (by_lag, by_slope, by_exponent):
            np.testing.assert_array_equal(slope, 0.0)
        distance = ((1 + np.array(lag)) / 2) ** P
        expected = ((1 - Q0) * (1 - distance) / HC / MU0)[:, None] * AXES
        np.testing.assert_allclose(by_rate, expected, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("p", [1.0, 2.0, 4.75])
@pytest.mark.parametrize("step", [0.3, 3.0, 40.0], ids=["fine", "coarse", "absurd"])
def test_lag_stays_bounded_in_steps_of_any_length(step, p):
    """RK4 of an oscillating field in steps of up to 40 Hc: never further out than a step moves."""

    @jax.jit
    def run():
        h, amplitude = 2 * np.pi / 40, step * 40 / (2 * np.pi) * 12.0
        rods = HysteresisRods(AXES[:1], VOLUMES[:1], HC[:1], BR[:1], BS[:1], 0.0, p)

        def f(z, t):
            return lag_rate(rods, z, jnp.stack([MU0 * amplitude * jnp.cos(t + 0.1), 0 * t, 0 * t]))

        def advance(z, t):
            k1 = f(z, t)
            k2 = f(z + 0.5 * h * k1, t + 0.5 * h)
            k3 = f(z + 0.5 * h * k2, t + 0.5 * h)
            z = z + h / 6 * (k1 + 2 * k2 + 2 * k3 + f(z + h * k3, t + h))
            return z, z[0]

        return jax.lax.scan(advance, jnp.zeros(1), h * jnp.arange(800.0))[1]

    largest = np.abs(np.asarray(run())).max()
    assert largest <= (1 + 1e-9 if step < 1 else 1 + step)


def test_absent_entries_are_named():
    with pytest.raises(ValueError, match=r"HysteresisRodsTorque needs Spacecraft\.hysteresis_rods"):
        HysteresisRodsTorque()(craft_with(None), around([0.0, 0.0]))
    with pytest.raises(ValueError, match=r"HysteresisRodsTorque needs AttitudeState\.rod_lag, .*lag_from_induction"):
        HysteresisRodsTorque()(craft_with(), around(None))


def test_single_precision_stays_single():
    single = jax.tree.map(lambda x: jnp.asarray(x, jnp.float32), (craft_with(), around([0.3, -0.8])))
    assert HysteresisRodsTorque()(*single).dtype == jnp.float32
    rods, place = single[0].hysteresis_rods, single[1]
    assert lag_rate(rods, place.rod_lag, place.b_field_body).dtype == jnp.float32
    assert lag_from_induction(rods, place.rod_lag, place.b_field_body).dtype == jnp.float32
