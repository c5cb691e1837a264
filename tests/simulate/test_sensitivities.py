"""`Sensitivities` of a sphere that nothing turns, whose motion is known; what it refuses."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import OrbitTable
from jaxsat.simulate import Sensitivities, simulate, simulate_many
from jaxsat.spacecraft import HysteresisRods, Spacecraft

HERE = np.array([1.0, 0.0, 0.0, 0.0])
TIMES = np.array([60.0, 150.0])


def around(times):
    return OrbitTable(jnp.full((*times.shape, 3), 4e6), jnp.full((*times.shape, 3), 2e-5))


def sphere(x):
    """Unknowns are the rate about z, the moment of inertia, and its product of y and z beyond one, if at all."""
    product = jnp.where(x[2] >= 1.0, x[2] - 1.0, 0.0) * jnp.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
    state = AttitudeState(jnp.asarray(HERE), jnp.stack([0.0 * x[0], 0.0 * x[0], x[0]]))
    return Spacecraft(x[1] * jnp.eye(3) + product), state


@pytest.mark.slow
def test_steps_are_found_anew_for_a_faster_motion():
    """q = (cos wt/2, 0, 0, sin wt/2), to the tolerance, also at thirty times the rate that the steps were found for.

    A product of inertia p of y and z, which was nowhere before, begins w_x = w^2 p t / J to first order (Euler).
    """
    ways, moment = Sensitivities(sphere, around, TIMES, torques=(), tolerance=1e-7), 0.05
    for rate, product in ((0.004, 0.0), (0.12, 1.0)):
        found = ways(np.array([rate, moment, product]))
        half, by_rate = 0.5 * rate * TIMES, 0.5 * TIMES
        np.testing.assert_allclose(found.motion.quaternion[:, [0, 3]].T, [np.cos(half), np.sin(half)], atol=1e-7)
        expected = np.stack([-np.sin(half) * by_rate, np.cos(half) * by_rate])
        np.testing.assert_allclose(found.quaternion[:, [0, 3], 0].T, expected, atol=1e-5)
        assert found.quaternion.shape == (2, 4, 3)
        assert np.all(found.quaternion[..., 1] == 0.0)
        wobble = rate**2 * TIMES / moment * product
        np.testing.assert_allclose(found.angular_velocity[..., 2], np.outer(wobble, [1.0, 0.0, 0.0]), atol=1e-9)
    for unknowns, words in WRONG:
        with pytest.raises(ValueError, match=words):
            ways(unknowns)
        # Of a table it is one row, and the other is as it is alone.
        rows = ways(np.stack([unknowns, np.array([rate, moment, product])]))
        assert rows.motion.diverged == (0,)
        assert np.isnan(rows.quaternion[0]).all()
        np.testing.assert_array_equal(rows.quaternion[1], found.quaternion)


WRONG = [
    (np.array([0.1, -0.05, 0.0]), "case 0: spacecraft.inertia"),
    (np.array([0.1, 0.05, 1.04]), "case 0: spacecraft.inertia: no body has these principal moments"),
    (np.array([np.nan, 0.05, 0.0]), "case 0: the initial state is not finite"),
]


@pytest.mark.parametrize(
    ("unknowns", "words"),
    [
        (np.zeros((2, 2, 2)), r"\[n\] or \[cases, n\]"),
        *WRONG,
    ],
)
def test_unknowns_that_make_no_satellite(unknowns, words):
    with pytest.raises(ValueError, match=words):
        Sensitivities(sphere, around, TIMES, torques=(), max_step=10.0)(unknowns)


def test_rods_with_hysteresis_have_kinks():
    one = np.ones(1)
    rods = HysteresisRods(np.eye(3)[:1], one * 1e-6, one * 12.0, one * 0.004, one * 0.025)

    def lagging(x):
        return Spacecraft(x[0] * jnp.eye(3), hysteresis_rods=rods), AttitudeState(HERE, np.zeros(3), jnp.zeros(1))

    with pytest.raises(ValueError, match="kinks"):
        Sensitivities(lagging, around, TIMES, max_step=10.0)(one)


def one(q=(4,), w=(3,), times=TIMES, **options):
    return simulate(Spacecraft(jnp.eye(3)), AttitudeState(np.ones(q), np.ones(w)), around, times, **options)


def many(q=(2, 4), w=(2, 3), times=TIMES, **options):
    return simulate_many(Spacecraft(jnp.eye(3)), AttitudeState(np.ones(q), np.ones(w)), around, times, **options)


def slopes(times=TIMES, **options):
    return Sensitivities(sphere, around, times, **options)


@pytest.mark.parametrize("ask", [one, many, slopes])
@pytest.mark.parametrize("name", ["times", "start"])
@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_times_that_are_no_numbers(ask, name, wrong):
    with pytest.raises(ValueError, match=f"{name} must be"):
        ask(**{name: wrong if name == "start" else np.array([1.0, wrong])})


@pytest.mark.parametrize(
    ("ask", "asked", "words"),
    [
        (one, {"q": (3,)}, "initial.quaternion must"),
        (one, {"w": (4,)}, "initial.angular_velocity must"),
        (one, {"times": np.ones((2, 1))}, "times must be a vector"),
        (many, {"q": (0, 4), "w": (0, 3)}, "one case or more"),
        (many, {"q": (4,)}, "one case or more"),
        (many, {"w": (3, 3)}, "initial.angular_velocity must"),
        (many, {"chunk": 0}, "chunk must"),
        (slopes, {"times": np.zeros(0)}, "must lead away"),
        (slopes, {"times": np.zeros(1)}, "must lead away"),
    ],
)
def test_what_has_no_meaning_is_named(ask, asked, words):
    with pytest.raises(ValueError, match=words):
        ask(**asked)


@pytest.mark.parametrize("times", [np.zeros(0), np.zeros(2)])
def test_many_where_nothing_moves(times):
    """At the start the state is the first one, in unit length."""
    found = many(times=times)
    np.testing.assert_allclose(found.quaternion, np.full((2, len(times), 4), 0.5), atol=1e-15)
    np.testing.assert_allclose(found.angular_velocity, np.ones((2, len(times), 3)), atol=1e-15)
