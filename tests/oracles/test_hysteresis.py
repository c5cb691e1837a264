"""Hysteresis rods against the loop of Flatley & Henretty integrated in its own variable, B over H, by scipy.

The law under test is kept in another variable (the lag) and stepped in time; the truth is dB/dH between turning points.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from jaxsat.dynamics import AttitudeState, derivative, rigid_body
from jaxsat.environment import OrbitTable
from jaxsat.spacecraft import HysteresisRods, MagneticRods, SolarPanels, Spacecraft, box_normals
from jaxsat.torques import HysteresisRodsTorque, induction_from_lag, lag_from_induction, lag_rate

MU0 = 1.25663706127e-6
SLENDER = (12.0, 0.004, 0.025)
CLOSED = (12.0, 0.35, 0.73)
STEPS = 100
"""RK4 steps to a quarter of a cycle."""


def rods_of(hc, br, bs, q0=0.0, p=2.0, volume=1.0):
    v, hc, br, bs = (np.array([x]) for x in (volume, hc, br, bs))
    return HysteresisRods(np.eye(3)[:1], v, hc, br, bs, q0, p)


def rk4(slope, y, t, h):
    """One step of the classical method, its stages in a loop: they are traced once."""

    def stage(carry, inputs):
        reach, weight = inputs
        k, total = carry
        k = slope(jax.tree.map(lambda a, b: a + reach * h * b, y, k), t + reach * h)
        return (k, jax.tree.map(lambda a, b: a + weight * h / 6.0 * b, total, k)), None

    start = (jax.tree.map(jnp.zeros_like, y), y)
    (_, total), _ = jax.lax.scan(stage, start, (jnp.asarray([0, 0.5, 0.5, 1]), jnp.asarray([1.0, 2, 2, 1])))
    return total


@eqx.filter_jit
def driven(rods, amplitude, start, quarters):
    """H, B and lag at each step under H = amplitude sin t, from induction `start` at t = 0."""
    h = 0.5 * np.pi / STEPS

    def field(t, function):
        return jnp.stack([MU0 * amplitude * function(t), 0.0 * t, 0.0 * t])

    def step(z, t):
        z = rk4(lambda z, t: lag_rate(rods, z, field(t, jnp.cos)), z, t, h)
        b_field = field(t + h, jnp.sin)
        return z, (b_field[0] / MU0, induction_from_lag(rods, z, b_field)[0], z[0])

    z = lag_from_induction(rods, jnp.stack([start]), jnp.zeros(3))
    _, samples = jax.lax.scan(step, z, h * jnp.arange(1.0 * STEPS * quarters.shape[0]))
    return samples


def cycle(rods, amplitude, start=0.0, quarters=21):
    samples = driven(rods, jnp.asarray(float(amplitude)), jnp.asarray(float(start)), jnp.zeros(quarters))
    return tuple(np.asarray(x) for x in samples)


def published_slope(h, b, direction, hc, br, bs, q0, p):
    """dB/dH: slope of a boundary loop at this B, times what is left of it away from that loop."""
    k = np.tan(0.5 * np.pi * br / bs) / hc
    left_behind = np.tan(0.5 * np.pi * b / bs) / k - direction * hc
    share = q0 + (1 - q0) * np.clip(direction * (h - left_behind) / (2 * hc), 0.0, 1.0) ** p
    return share * 2 / np.pi * k * bs * np.cos(0.5 * np.pi * b / bs) ** 2


def truth(amplitude, start, quarters, material, q0, p):
    """B at the quarter's steps, each monotone stretch of H integrated apart."""
    phases = 0.5 * np.pi / STEPS * np.arange(STEPS * quarters + 1)
    b, found = start, []
    for first, last, direction in [(0, 1, 1)] + [(k, k + 2, (-1) ** ((k + 1) // 2)) for k in range(1, quarters, 2)]:
        h = amplitude * np.sin(phases[first * STEPS : last * STEPS + 1])
        h[-1] = direction * amplitude
        solution = solve_ivp(
            lambda h, b, d=direction: published_slope(h, b, d, *material, q0=q0, p=p),
            (h[0], h[-1]), [b], method="DOP853", t_eval=h, rtol=1e-12, atol=1e-17,
        )  # fmt: skip
        assert solution.success
        b = solution.y[0, -1]
        found.append(solution.y[0, 1:])
    return np.concatenate(found)


@pytest.mark.parametrize(
    ("material", "amplitude", "start", "q0", "p"),
    [
        (SLENDER, 25.0, 0.0, 0.0, 2.0),
        (SLENDER, 25.0, 0.002, 0.085, 4.75),
        (SLENDER, 6.0, 0.001, 0.1, 2.0),
        (SLENDER, 150.0, 0.0, 0.0, 1.0),
        (CLOSED, 30.0, -0.2, 0.05, 3.0),
        (SLENDER, 25.0, 0.007, 0.05, 2.0),
        (SLENDER, 25.0, -0.012, 0.0, 4.75),
    ],
    ids=["earth field", "late joining", "minor", "saturated", "closed circuit", "outward", "from outside"],
)
def test_induction_through_five_turning_points(material, amplitude, start, q0, p):
    h, b, _ = cycle(rods_of(*material, q0=q0, p=p), amplitude, start, quarters=11)
    expected = truth(amplitude, start, 11, material, q0, p)
    # RK4 at 100 steps a quarter: at worst 4.5e-8 of the saturation (where it changes by 2.4 A/m in a step), as h^4.
    np.testing.assert_allclose(b, expected, atol=1e-7 * material[2])
    assert np.abs(h).max() == pytest.approx(amplitude, rel=1e-12)


def loop(h, b):
    """Area of the last cycle, the integral of H dB, and its samples."""
    h, b = h[-4 * STEPS - 1 :], b[-4 * STEPS - 1 :]
    # A chain of chords at n equal phases has sin(2 pi / n) / (2 pi / n) of the area, whatever harmonics B has.
    return np.sum(0.5 * (h[1:] + h[:-1]) * np.diff(b)) / np.sinc(2 / (4 * STEPS)), h, b


def exact_minor_loop(amplitude, hc, br, bs, q0):
    """Lag at the turn and loop area for p = 2, where s = (1 + z) / 2 = tanh(a (H - H1)), a = (1 - q0) / (2 Hc)."""
    a, k = (1 - q0) / (2 * hc), np.tan(0.5 * np.pi * br / bs) / hc
    s = 0.5
    for _ in range(200):
        # The rising branch starts where the falling one, its mirror image, ended.
        s = np.tanh(2 * a * amplitude + np.arctanh(1 - s)) if s < 1 else s

    def lag(h):
        return 2 * np.tanh(a * (h + amplitude) + np.arctanh(1 - s)) - 1

    def b(h):
        return 2 * bs / np.pi * np.arctan(k * (h - hc * lag(h)))

    # The loop is symmetric: its area is the integral over H of the falling branch less the rising one.
    area = quad(lambda h: -b(-h) - b(h), -amplitude, amplitude, epsrel=1e-11, limit=400)[0]
    return 2 * s - 1, area


@pytest.mark.parametrize("amplitude", [3.0, 12.0, 25.0, 100.0])
def test_closed_minor_loops_have_the_analytic_width_and_area(amplitude):
    h, b, z = cycle(rods_of(*SLENDER, 0.1), amplitude, quarters=101)
    area, h, b = loop(h, b)
    lag, expected = exact_minor_loop(amplitude, *SLENDER, 0.1)
    # After 25 cycles the narrowest is within 1e-7 of its end; RK4's own error is 1e-9.
    assert z[-4 * STEPS :].max() == pytest.approx(lag, abs=2e-7)
    np.testing.assert_allclose(b[0], b[-1], atol=2e-8 * SLENDER[2])
    # Positive: the field does work on the rod. Harmonics above the 200th are under 1e-7.
    assert area == pytest.approx(expected, rel=1e-6) and expected > 0


@pytest.mark.parametrize("material", [SLENDER, CLOSED], ids=["slender", "closed circuit"])
def test_major_loop_costs_the_area_between_its_branches(material):
    """4 Hc Bs in a swing without end: 2 Hc wide at any B. Up to H0 it is the integral of B(H + Hc) - B(H - Hc)."""
    hc, br, bs = material
    k = np.tan(0.5 * np.pi * br / bs) / hc
    swings = hc * np.array([20.0, 100.0, 1000.0])
    between = [quad(lambda x: 4 * bs / np.pi * np.arctan(k * x), s - hc, s + hc)[0] for s in swings]
    # What is missing: the tails of the atan, and the corner that each turn cuts off the branch.
    missing = 1.0 - np.array(between) / (4 * hc * bs)
    np.testing.assert_allclose(missing[1:], 2 / (np.pi * k * swings[1:]), rtol=0.1)
    corners = 1.0 - np.array([exact_minor_loop(s, *material, q0=0.0)[1] for s in swings]) / between
    assert np.all(corners > 0) and np.all(corners < [0.011, 4e-4, 4e-6])
    h, b, z = cycle(rods_of(*material), swings[0], quarters=9)
    assert loop(h, b)[0] == pytest.approx(between[0] * (1 - corners[0]), rel=1e-6)
    assert 1 - 1e-12 < np.abs(z).max() <= 1 + 1e-12


def test_remanence_and_coercive_field():
    hc, br, bs = CLOSED
    rods = rods_of(*CLOSED)
    h, b, _ = cycle(rods, 40 * hc, quarters=9)
    # H = 0 is a sample: B there is the remanence, the steps' own error aside.
    assert b[2 * STEPS - 1] == pytest.approx(br, rel=1e-9) and b[4 * STEPS - 1] == pytest.approx(-br, rel=1e-9)
    for sign in (1.0, -1.0):
        at_coercive = jnp.asarray([sign * hc * MU0, 0.0, 0.0])
        np.testing.assert_allclose(induction_from_lag(rods, jnp.asarray([sign]), at_coercive), 0.0, atol=1e-14)


def test_loop_lies_inside_the_major_one_in_steps_of_up_to_hc():
    hc, br, bs = SLENDER
    k = np.tan(0.5 * np.pi * br / bs) / hc
    # The last swing moves by up to Hc in a step: longer ones end beyond the loop and stay there until the field turns.
    for amplitude, start in ((25.0, 0.003), (4.0, -0.001), (760.0, 0.0)):
        h, b, _ = cycle(rods_of(*SLENDER, 0.1), amplitude, start)
        high, low = (2 * bs / np.pi * np.arctan(k * (h + s * hc)) for s in (1, -1))
        assert np.all(b <= high + 1e-17) and np.all(b >= low - 1e-17)


B_FIELD = 3.1e-5
VOLUME = 2e-6
INERTIA = 0.02


@eqx.filter_jit
def spin(rods, rate, turns):
    """Rate at the end of each turn of a satellite about z, its rod along x, in a constant field across the axis."""
    panels = SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6))
    none = MagneticRods(jnp.zeros(0), jnp.zeros((0, 3)), jnp.asarray(3e-5))
    craft = Spacecraft(INERTIA * jnp.eye(3), jnp.zeros(3), none, panels, hysteresis_rods=rods)
    body = rigid_body(craft, (HysteresisRodsTorque(),))
    b_field = jnp.asarray([B_FIELD, 0.0, 0.0])
    point = OrbitTable(jnp.asarray([7e6, 0.0, 0.0]), b_field, b_rate_eci=jnp.zeros(3))
    lag = lag_from_induction(rods, jnp.zeros(1), b_field)
    initial = AttitudeState(jnp.asarray([1.0, 0, 0, 0]), rate * jnp.asarray([0.0, 0.0, 1.0]), lag)

    def slope(state, _):
        # By the angle turned, so that turns and turning points fall on steps although the spin slows down.
        return jax.tree.map(lambda x: x / jnp.abs(state.angular_velocity[2]), derivative(state, point, body))

    def step(y, _):
        y = rk4(slope, y, jnp.zeros(()), 2 * np.pi / (4 * STEPS))
        return y, y.angular_velocity

    _, rates = jax.lax.scan(step, initial, None, length=4 * STEPS * turns.shape[0])
    return jnp.concatenate([initial.angular_velocity[None], rates])[:: 4 * STEPS]


@pytest.mark.slow
@pytest.mark.parametrize("q0", [0.0, 0.1])
def test_spinning_satellite_loses_the_loop_area_a_turn(q0):
    rates = np.asarray(spin(rods_of(*SLENDER, q0, volume=VOLUME), jnp.asarray(0.05), jnp.zeros(10)))
    np.testing.assert_array_equal(rates[:, :2], 0.0)
    loss = -np.diff(0.5 * INERTIA * rates[:, 2] ** 2)
    expected = VOLUME * exact_minor_loop(B_FIELD / MU0, *SLENDER, q0)[1]
    # It begins outside, without flux in twice Hc. From the sixth turn the loop is closed; RK4 at 400 steps a turn
    # leaves 4e-10.
    np.testing.assert_allclose(loss[5:], expected, rtol=2e-9)
    assert np.all(loss > 0)
    # The signs: the spin slows down, whichever way it goes.
    back = np.asarray(spin(rods_of(*SLENDER, q0, volume=VOLUME), jnp.asarray(-0.05), jnp.zeros(1)))
    assert 0 < expected < 0.5 * INERTIA * 0.05**2 / 20 and -0.05 < back[-1, 2] < 0


@pytest.mark.slow
def test_slopes_of_a_damped_spin_against_differences():
    """The rate after two turns by Hc, Br, Bs, volume, q0, p and the initial rate; starts on a turning point of H."""
    scale = np.array([*SLENDER, VOLUME, 0.1, 2.5, 0.05])

    def final(x):
        hc, br, bs, volume, q0, p, rate = x * scale
        rods = HysteresisRods(jnp.eye(3)[:1], volume[None], hc[None], br[None], bs[None], q0, p)
        return spin(rods, rate, jnp.zeros(2))[-1, 2]

    h, slopes = 1e-4, jax.jit(jax.jacfwd(lambda x: (final(x),) * 2, has_aux=True))
    found, _ = slopes(jnp.ones(7))
    moved = [[float(slopes(jnp.asarray(np.ones(7) + s * h * np.eye(7)[k]))[1]) for s in (1, -1)] for k in range(7)]
    difference = np.array([(plus - minus) / (2 * h) for plus, minus in moved])
    assert np.all(np.abs(difference) > 1e-7)
    # Truncation h^2 of slopes near 1e-3, rounding 1e-17 / h.
    np.testing.assert_allclose(found, difference, atol=1e-6 * np.abs(difference[:6]).max())


@pytest.mark.slow
def test_slopes_of_the_induction_in_reverse_against_differences():
    """Of B a third of a cycle after the third turn, by Hc, Br, Bs, q0, p, the amplitude and the initial induction."""
    scale = np.array([*SLENDER, 0.1, 2.5, 25.0, 0.001])

    def induction(x):
        hc, br, bs, q0, p, amplitude, start = x * scale
        rods = HysteresisRods(jnp.eye(3)[:1], jnp.ones(1), hc[None], br[None], bs[None], q0, p)
        return driven(rods, amplitude, start, jnp.zeros(6))[1][-STEPS // 3] / SLENDER[2]

    h, slopes = 1e-4, jax.jit(jax.value_and_grad(induction))
    _, found = slopes(jnp.ones(7))
    moved = [[float(slopes(jnp.asarray(np.ones(7) + s * h * np.eye(7)[k]))[0]) for s in (1, -1)] for k in range(7)]
    difference = np.array([(plus - minus) / (2 * h) for plus, minus in moved])
    assert np.all(np.abs(difference) > 1e-5)
    np.testing.assert_allclose(found, difference, atol=1e-7)
