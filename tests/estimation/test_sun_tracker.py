"""The Sun followed by the gyro: wrong roots fall behind, nothing is forgotten out of view, jumps are found out."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax
from scipy.spatial.transform import Rotation

from jaxsat.estimation.sun.candidates import Candidates, sun_candidates
from jaxsat.estimation.sun.published import published_direction
from jaxsat.estimation.sun.tracker import SunTrack, blank_track, carried, followed
from jaxsat.math.scalars import elements, over_cases
from jaxsat.sensors.sun_sensor import PyramidSunSensor, face_currents

SENSOR = PyramidSunSensor()
CASES, SAMPLES = 200, 200
quick = functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 0})


def direction(angle_deg, azimuth_deg):
    """Directions at angles from the axis and azimuths from y toward z."""
    a, p = np.radians(angle_deg), np.radians(azimuth_deg)
    return np.stack(np.broadcast_arrays(np.cos(a), np.sin(a) * np.cos(p), np.sin(a) * np.sin(p)), axis=-1)


def apart_deg(a, b):
    return np.degrees(2 * np.arctan2(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1)))


def motions(rate_deg_s, step_s, seed):
    """Turns of a sample [cases 3] and Suns [samples cases 3] of random constant rates and first directions."""
    rng = np.random.default_rng(seed)
    first, axes = rng.normal(size=(2, CASES, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    turn = axes * np.radians(rng.uniform(*rate_deg_s, size=(CASES, 1))) * step_s
    first /= np.linalg.norm(first, axis=1)[:, None]
    # Seen from the turning instrument the Sun turns the other way.
    return turn, np.stack([Rotation.from_rotvec(-turn * k).apply(first) for k in range(SAMPLES)])


def one_sample(track, turn, sun, gain):
    """The track one sample on, and what the published algorithm says."""
    track = carried(track, turn)
    currents = face_currents(SENSOR, sun)
    found = sun_candidates(SENSOR, currents, track.best())
    track = followed(track, found, gain=gain)
    return track, (track.best(), track.known(), found.lit, published_direction(SENSOR, currents).direction)


@quick
def follow(turn, suns, gain):
    one = jax.vmap(one_sample, in_axes=(0, 0, 0, None))
    blank = jax.tree.map(lambda x: jnp.broadcast_to(x, (len(turn), *x.shape)), blank_track())
    return lax.scan(lambda track, sun: one(track, turn, sun, gain), blank, suns)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rate_deg_s", "seed", "gain"), [((0.3, 2.0), 1, 1.0), ((0.1, 0.5), 2, 1.0), ((0.3, 2.0), 3, 0.3)]
)
def test_random_motions(rate_deg_s, seed, gain):
    """Under 1 % of samples in view are off by more than a degree 30 s after the first light; published, over 30 %."""
    turn, suns = motions(rate_deg_s, 1.0, seed)
    _, (best, known, lit, published) = jax.tree.map(np.asarray, follow(turn, suns, gain))
    np.testing.assert_array_equal(known, np.maximum.accumulate(lit > 0, axis=0))
    first = np.where(known.any(axis=0), np.argmax(known, axis=0), SAMPLES)
    later = np.arange(SAMPLES)[:, None] >= first + 30
    assert np.mean(later) > 0.4
    in_view = later & (lit > 0)
    assert np.mean(apart_deg(best, suns)[in_view] > 1.0) < 0.01
    assert np.mean(apart_deg(published, suns)[in_view] > 1.0) > 0.3
    # Out of view the gyro alone knows, of some Suns that were seen in a corner only.
    assert np.mean(apart_deg(best, suns)[later & (lit == 0)] > 1.0) < 0.06


@pytest.mark.slow
def test_nothing_is_forgotten_out_of_view():
    """Around the axis's own cross axis: half of each turn is dark, and the Sun is where it was left."""
    turn = np.broadcast_to(np.radians([0.0, 1.0, 0.8]), (CASES, 3))
    first = np.tile(direction(30.0, 70.0), (CASES, 1))
    suns = np.stack([Rotation.from_rotvec(-turn[0] * k).apply(first) for k in range(SAMPLES)])
    _, (best, known, lit, _) = jax.tree.map(np.asarray, follow(turn, suns, 1.0))
    dark = lit[:, 0] == 0
    assert 50 < dark.sum() < 150 and known.all()
    # The turn to second order: 4e-7 rad a sample.
    assert np.max(apart_deg(best, suns)[:, 0]) < np.degrees(150 * 4e-7 * 5)

    track = SunTrack(jnp.asarray(direction(np.array([10.0, 80.0, 120.0]), 33.0)), jnp.asarray([0.1, 0.2, jnp.inf]))
    nothing = Candidates(jnp.eye(3), jnp.zeros(3, bool), jnp.asarray(0))
    after = quick(followed)(track, nothing)
    np.testing.assert_array_equal(after.direction, track.direction)
    np.testing.assert_array_equal(after.mismatch, track.mismatch)


def test_carried_against_the_rotation_itself():
    track = SunTrack(jnp.asarray(np.eye(3)), jnp.asarray([0.0, 1.0, jnp.inf]))
    turn = np.array([0.02, -0.03, 0.01])
    found = quick(carried)(track, jnp.asarray(turn))
    # Third order: (0.04)^3 / 6.
    np.testing.assert_allclose(found.direction, Rotation.from_rotvec(-turn).apply(np.eye(3)), atol=2e-5)
    np.testing.assert_array_equal(found.mismatch, track.mismatch)
    np.testing.assert_allclose(np.linalg.norm(found.direction, axis=1), 1.0, atol=1e-15)


@pytest.mark.slow
def test_wrong_root_falls_behind():
    """Beyond the fold the nearer root is taken first, as published; within degrees of motion the true one is."""
    angles = 69.0 - 0.25 * np.arange(SAMPLES)
    suns = np.broadcast_to(direction(angles, 45.0)[:, None], (SAMPLES, CASES, 3))
    turn = np.radians(0.25) * np.cross([1.0, 0.0, 0.0], direction(90.0, 45.0))
    assert np.max(abs(Rotation.from_rotvec(-turn).apply(suns[0, 0].copy()) - suns[1, 0])) < 1e-12
    track, (best, _, lit, published) = follow(np.broadcast_to(turn, (CASES, 3)), suns, 1.0)
    off = apart_deg(np.asarray(best), suns)[:, 0]
    assert lit[0, 0] == 2 and off[0] == pytest.approx(2 * (69.0 - 60.257244), abs=1e-5)
    assert off[1] < 1e-3 and np.max(off[1:]) < 1e-2
    assert apart_deg(np.asarray(published), suns)[20, 0] == pytest.approx(2 * (64.0 - 60.257244), abs=1e-5)
    assert np.asarray(track.mismatch)[0].min() < 1e-8


@pytest.mark.slow
def test_a_jump_is_found_out():
    """Where no candidate is near any more all begin anew: a jump of 58 deg is followed at once."""
    suns = np.broadcast_to(direction(15.0, 100.0), (SAMPLES, CASES, 3)).copy()
    suns[100:] = direction(50.0, 210.0)
    _, (best, _, _, _) = follow(np.zeros((CASES, 3)), suns, 0.1)
    off = apart_deg(np.asarray(best), suns)[:, 0]
    assert apart_deg(suns[99, 0], suns[100, 0]) > 50.0 and np.max(off) < 1e-6


@pytest.mark.slow
def test_gain_shares_between_gyro_and_sensor():
    before = direction(np.array([40.0, 41.0, 42.0]), 30.0)
    track = SunTrack(jnp.asarray(before), jnp.asarray([0.0, 1e-4, jnp.inf]))
    sun = direction(43.0, 30.0)
    # The second is nearer and not possible.
    found = np.stack([sun, before[1], direction(70.0, 30.0)])
    found = Candidates(jnp.asarray(found), jnp.asarray([True, False, True]), jnp.asarray(2))
    after = quick(lambda track: followed(track, found, gain=0.25))(track)
    expected = before + 0.25 * (sun - before)
    np.testing.assert_allclose(after.direction, expected / np.linalg.norm(expected, axis=1)[:, None], atol=1e-12)
    square = np.sum((before - sun) ** 2, axis=1)
    np.testing.assert_allclose(after.mismatch[:2], [0.02 * square[0], 0.98e-4 + 0.02 * square[1]], rtol=1e-9)
    assert np.isinf(after.mismatch[2]) and not bool(blank_track().known()) and bool(after.known())


@pytest.mark.slow
def test_replayed_over_cases():
    """One sample of tracks that are blank, near a candidate, and lost; the candidates have a test of their own."""
    rng = np.random.default_rng(7)
    direct, found = rng.normal(size=(2, CASES, 3, 3))
    mismatch = rng.choice([0.0, 1e-4, 0.03, np.inf], size=(CASES, 3))
    found = np.where(rng.random((CASES, 1, 1)) < 0.5, direct[:, ::-1] + 0.05 * found, found)
    possible, lit = rng.random((CASES, 3)) < 0.6, rng.integers(0, 3, CASES)
    direct, found = (x / np.linalg.norm(x, axis=2, keepdims=True) for x in (direct, found))
    cases = [jnp.asarray(x) for x in (direct, mismatch, 0.02 * rng.normal(size=(CASES, 3)), found, possible, lit)]

    def numbers(direction, mismatch, turn, found, possible, lit):
        track = carried(SunTrack(direction, mismatch), turn)
        track = followed(track, Candidates(found, possible, lit), gain=0.5)
        return track.direction, track.mismatch, track.best(), track.known()

    replayed = over_cases(numbers, *(jax.ShapeDtypeStruct(x.shape[1:], x.dtype) for x in cases))

    @quick
    def by_elements(*cases):
        split = (elements(jnp.moveaxis(x, 0, -1), element_rank=x.ndim - 1) for x in cases)
        return [jnp.stack(list(x.reshape(-1)), axis=-1) for x in replayed(*split)]

    expected = quick(jax.vmap(numbers))(*cases)
    assert 0 < np.mean(expected[1][:, 0] == 0.0) < 1 and 0 < np.mean(expected[3]) < 1
    for one, other in zip(by_elements(*cases), expected, strict=True):
        np.testing.assert_allclose(np.reshape(one, other.shape), other, atol=1e-14)
