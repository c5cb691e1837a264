"""The bank of Kalman filters: right about the Sun in noise, and right about how far it may be off."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax
from scipy.spatial.transform import Rotation

from jaxsat.estimation.sun.candidates import Candidates, sun_candidates
from jaxsat.estimation.sun.filter import SPREAD, SunFilter, blank_filter, corrected, predicted
from jaxsat.estimation.sun.tracker import blank_track, carried, followed
from jaxsat.math.scalars import elements, over_cases
from jaxsat.sensors.sun_sensor import PyramidSunSensor, combine_detectors, face_currents

SENSOR = PyramidSunSensor()
CASES, SAMPLES = 150, 200
GYRO = np.radians(0.005)
ALL = np.ones(4, bool)
quick = functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 0})
seen = quick(lambda v: face_currents(SENSOR, v))
possible = quick(lambda i, expected: sun_candidates(SENSOR, i, expected))


@quick
def alone(belief, i, candidates, sigma, threshold):
    """`corrected` with all faces alive."""
    return corrected(belief, SENSOR, i, candidates, sigma=sigma, alive=jnp.asarray(ALL), threshold=threshold)


def direction(angle_deg, azimuth_deg):
    """Directions at angles from the axis and azimuths from y toward z."""
    a, p = np.radians(angle_deg), np.radians(azimuth_deg)
    return np.stack(np.broadcast_arrays(np.cos(a), np.sin(a) * np.cos(p), np.sin(a) * np.sin(p)), axis=-1)


def apart(a, b):
    return 2 * np.arctan2(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1))


def session(rate_deg_s, noise, seed, dead=0):
    """Gyro turns, currents of the faces, whether each is alive, and Suns, all [samples cases ...]; one a second."""
    rng = np.random.default_rng(seed)
    first, axes = rng.normal(size=(2, CASES, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    first /= np.linalg.norm(first, axis=1)[:, None]
    turn = axes * np.radians(rng.uniform(*rate_deg_s, size=(CASES, 1)))
    suns = np.stack([Rotation.from_rotvec(-turn * k).apply(first) for k in range(SAMPLES)])
    clean = np.asarray(jax.jit(jax.vmap(lambda sun: face_currents(SENSOR, sun)))(suns.reshape(-1, 3)))
    alive = np.ones((CASES, 4), bool)
    alive[:dead, 0] = False
    readings = np.maximum(clean[..., None] + noise * rng.normal(size=(*clean.shape, 2)), 0.0)
    combined = np.asarray(jax.jit(jax.vmap(combine_detectors))(readings)).reshape(SAMPLES, CASES, 4)
    gyro = turn + (GYRO if noise else 0.0) * rng.normal(size=suns.shape)
    return gyro, np.where(alive, combined, 0.0), alive, suns


@quick
def both(gyro, currents, alive, noise):
    """Directions by the filter and the tracker, the filter's sigma, and whether a face was lit."""

    def one(state, turn, i, alive):
        belief, track = state
        limits = {"alive": alive, "threshold": 5 * noise, "tolerance": 4 * noise}
        belief = predicted(belief, turn, jnp.maximum(GYRO, noise * 1e-3))
        found = sun_candidates(SENSOR, i, belief.best(), **limits)
        sigma = jnp.full(4, jnp.maximum(noise / np.sqrt(2.0), 1e-5))
        belief = corrected(belief, SENSOR, i, found, sigma=sigma, alive=alive, threshold=5 * noise)
        track = carried(track, turn)
        track = followed(track, sun_candidates(SENSOR, i, track.best(), **limits), gain=jnp.where(noise > 0, 0.3, 1.0))
        return (belief, track), (belief.best(), track.best(), belief.sigma(), found.lit > 0)

    blank = jax.tree.map(lambda x: jnp.broadcast_to(x, (CASES, *x.shape)), (blank_filter(), blank_track()))
    step = jax.vmap(one, in_axes=(0, 0, 0, 0))
    return lax.scan(lambda state, x: step(state, *x, alive), blank, (gyro, currents))[1]


def results(rate_deg_s, noise, seed, dead=0):
    """Errors of filter and tracker [rad] and the filter's sigma, in view and 30 s or more after the first light."""
    gyro, currents, alive, suns = session(rate_deg_s, noise, seed, dead)
    best, track, sigma, lit = map(np.asarray, both(gyro, currents, alive, noise))
    first = np.where(lit.any(axis=0), np.argmax(lit, axis=0), SAMPLES)
    counted = lit & (np.arange(SAMPLES)[:, None] >= first + 30)
    assert np.mean(counted) > 0.25
    return apart(best, suns)[counted], apart(track, suns)[counted], sigma[counted]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rate_deg_s", "noise", "allowed", "tracker"),
    [((0.0, 0.2), 0.002, 0.04, 0.1), ((0.3, 2.0), 0.002, 0.002, 0.03), ((0.1, 0.5), 0.0, 0.005, 0.0)],
)
def test_fewer_are_off_by_a_degree(rate_deg_s, noise, allowed, tracker):
    error, followed_error, sigma = results(rate_deg_s, noise, 3)
    one_degree = np.radians(1.0)
    assert np.mean(error > one_degree) < allowed and np.mean(followed_error > one_degree) >= tracker
    if noise:
        # Two numbers of 1-sigma s1 and s2, sigma^2 = s1^2 + s2^2: 95 % lie within 1.73 to 1.96 of it.
        right = error < one_degree
        assert 0.9 < np.mean(error[right] < 1.85 * sigma[right]) < 0.985


@pytest.mark.slow
def test_a_dead_face_costs_less():
    error, followed_error, _ = results((0.1, 0.5), 0.002, 4, dead=CASES)
    assert np.mean(error > np.radians(1.0)) < 0.6 * np.mean(followed_error > np.radians(1.0))


def one_hypothesis(v, spread=0.02):
    """A belief in one direction alone."""
    beside = np.cross(v, [0.3, -0.5, 0.8])
    beside /= np.linalg.norm(beside)
    first, second = (jnp.tile(jnp.asarray(x), (3, 1)) for x in (v, beside))
    cost = jnp.asarray([0.0, np.inf, np.inf])
    return SunFilter(first, second, jnp.tile(spread**2 * jnp.eye(2), (3, 1, 1)), cost)


@pytest.mark.slow
@pytest.mark.parametrize("angle_deg", [12.0, 50.0, 80.0])
def test_correction_is_the_textbook_one(angle_deg):
    """All currents at once, matrices inverted, slopes by differences: P' = (P^-1 + H' R^-1 H)^-1."""
    true, v = direction(angle_deg, 35.0), direction(angle_deg + 0.2, 35.3)
    belief = one_hypothesis(v)
    i = np.asarray(seen(true))
    sigma = np.array([0.01, 0.012, 0.02, 0.03])
    none = Candidates(jnp.asarray(np.tile(v, (3, 1))), jnp.zeros(3, bool), jnp.asarray(2))
    after = alone(belief, i, none, sigma, 1e-9)

    lit = i > 0
    assert lit.sum() >= 2
    basis = np.stack([np.asarray(belief.beside[0]), np.cross(v, np.asarray(belief.beside[0]))])
    step = 1e-6
    H = np.stack(
        [(np.asarray(seen(v + step * e)) - np.asarray(seen(v - step * e))) / (2 * step) for e in basis],
        axis=1,
    )[lit]
    weights = np.diag(sigma[lit] ** -2)
    P = np.linalg.inv(np.eye(2) / 0.02**2 + H.T @ weights @ H)
    off = (i - np.asarray(seen(v)))[lit]
    moved = v + basis.T @ (P @ H.T @ weights @ off)
    np.testing.assert_allclose(after.covariance[0], P, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(after.direction[0], moved / np.linalg.norm(moved), atol=1e-9)
    square = off @ np.linalg.inv(H @ H.T * 0.02**2 + np.diag(sigma[lit] ** 2)) @ off
    assert float(after.cost[0]) == pytest.approx(square, rel=1e-6)
    assert float(after.direction[0] @ after.beside[0]) == pytest.approx(0.0, abs=1e-14)


@pytest.mark.slow
def test_nothing_is_learnt_in_the_dark_but_that_time_goes_by():
    belief = one_hypothesis(direction(100.0, 20.0), spread=0.0)
    dark = Candidates(jnp.eye(3), jnp.zeros(3, bool), jnp.asarray(0))
    turn = np.radians([0.0, 0.4, -0.3])

    def second(belief, _):
        belief = predicted(belief, jnp.asarray(turn), 1e-3)
        still = corrected(
            belief, SENSOR, jnp.zeros(4), dark, sigma=jnp.full(4, 0.01), alive=jnp.asarray(ALL), threshold=0.0
        )
        return still, None

    after, _ = quick(lambda belief: lax.scan(second, belief, None, length=100))(belief)
    expected = Rotation.from_rotvec(-100 * turn).apply(direction(100.0, 20.0))
    assert apart(np.asarray(after.best()), expected) < 1e-5 and bool(after.known())
    assert float(after.sigma()) == pytest.approx(1e-3 * np.sqrt(200.0), rel=1e-9)
    assert not bool(blank_filter().known())


@pytest.mark.slow
def test_a_jump_is_found_out_and_a_dark_face_speaks():
    """The Sun jumps: all begin anew. A face that should be lit and is dark pushes the belief to its edge alone."""
    sigma = np.full(4, 2e-3)
    there = seen(direction(50.0, 210.0))
    found = possible(there, direction(15.0, 100.0))
    after = alone(one_hypothesis(direction(15.0, 100.0), spread=1e-3), there, found, sigma, 0.01)
    off = apart(np.asarray(after.direction), direction(50.0, 210.0))[np.asarray(after.cost) < np.inf]
    assert off.min() < 1e-7 and float(after.covariance[0, 0, 0]) == pytest.approx(SPREAD**2)

    # Lit on three faces as believed, where the truth has light on two: the third is not.
    v = direction(20.0, 45.0)
    beyond = np.asarray(seen(direction(22.0, 45.0)))
    assert (beyond > 0).sum() == 2 and (np.asarray(seen(v)) > 0).sum() == 4
    nothing = Candidates(jnp.asarray(np.tile(v, (3, 1))), jnp.zeros(3, bool), jnp.asarray(2))
    after = alone(one_hypothesis(v, spread=0.05), beyond, nothing, sigma, 0.01)
    assert apart(np.asarray(after.direction[0]), direction(22.0, 45.0)) < np.radians(0.1)


@pytest.mark.slow
@pytest.mark.parametrize(("angle_deg", "azimuth_deg", "lit"), [(50.0, 35.0, 2), (79.0, 40.0, 2), (75.0, 0.5, 1)])
def test_slopes_against_differences(angle_deg, azimuth_deg, lit):
    """Of the direction after a correction, with the currents; in the light of two faces, in the shade, and of one."""
    v = direction(angle_deg, azimuth_deg)
    i = np.asarray(seen(v))
    belief, nothing = (
        one_hypothesis(v),
        Candidates(jnp.tile(jnp.asarray(v), (3, 1)), jnp.zeros(3, bool), jnp.asarray(2)),
    )
    sigma = np.full(4, 0.01)
    found = np.asarray(slopes(belief, i, nothing, sigma))
    assert (i > 0).sum() == lit and np.isfinite(found).all()
    for k in np.flatnonzero(i > 0):
        step = 1e-6 * np.eye(4)[k]
        ends = [np.asarray(alone(belief, i + way * step, nothing, sigma, 0.01).direction[0]) for way in (1, -1)]
        np.testing.assert_allclose(found[:, k], (ends[0] - ends[1]) / 2e-6, atol=1e-7)
        assert np.linalg.norm(found[:, k]) > 0.1


@quick
def slopes(belief, i, candidates, sigma):
    def moved(i):
        after = corrected(belief, SENSOR, i, candidates, sigma=sigma, alive=jnp.asarray(ALL), threshold=0.01)
        return after.direction[0]

    return jax.jacfwd(moved)(i)


@pytest.mark.slow
def test_replayed_over_all_cases():
    """One sample of beliefs that are blank, near, lost, or in the dark, by elements as the sweep runs it.

    The candidates have a test of their own.
    """
    rng = np.random.default_rng(7)
    v = direction(rng.uniform(0.0, 89.0, CASES), rng.uniform(0.0, 360.0, CASES))
    i = np.asarray(jax.jit(jax.vmap(lambda sun: face_currents(SENSOR, sun)))(v)) * (rng.random((CASES, 1)) < 0.8)
    belief = jax.vmap(lambda x: jnp.broadcast_to(x, (3, 3)))(jnp.asarray(v + 0.03 * rng.normal(size=v.shape)))
    # Two of the three are so close that they have met, and not so that rounding tells which is the better one.
    belief = np.asarray(belief) + 1e-3 * rng.normal(size=(CASES, 3, 3))
    belief /= np.linalg.norm(belief, axis=2, keepdims=True)
    belief[:, 1] = direction(rng.uniform(0.0, 80.0, CASES), rng.uniform(0.0, 360.0, CASES))
    beside = np.cross(belief, rng.normal(size=3))
    beside /= np.linalg.norm(beside, axis=2, keepdims=True)
    cost = rng.choice([0.0, 3.0, 500.0, np.inf], size=(CASES, 3))
    arrays = [belief, beside, np.tile(1e-4 * np.eye(2), (CASES, 3, 1, 1)), cost, 0.01 * rng.normal(size=v.shape), i]
    arrays += [belief[:, ::-1], rng.random((CASES, 3)) < 0.7, (i > 0).sum(axis=1)]
    cases = [jnp.asarray(x) for x in arrays]

    def numbers(direction, beside, covariance, cost, turn, i, *found):
        belief = predicted(SunFilter(direction, beside, covariance, cost), turn, 1e-4)
        after = corrected(
            belief, SENSOR, i, Candidates(*found), sigma=jnp.full(4, 1e-3), alive=jnp.asarray(ALL), threshold=1e-3
        )
        return jax.tree.leaves(after), after.best(), after.known()

    replayed = over_cases(numbers, *(jax.ShapeDtypeStruct(x.shape[1:], x.dtype) for x in cases))

    @quick
    def by_elements(*cases):
        split = (elements(jnp.moveaxis(x, 0, -1), element_rank=x.ndim - 1) for x in cases)
        leaves = jax.tree.leaves(replayed(*split))
        return [jnp.stack([jnp.broadcast_to(e, CASES) for e in x.reshape(-1)], axis=-1) for x in leaves]

    expected = jax.tree.leaves(quick(jax.vmap(numbers))(*cases))
    for one, other in zip(by_elements(*cases), expected, strict=True):
        np.testing.assert_allclose(np.reshape(one, other.shape), other, rtol=1e-9, atol=1e-11)
