"""Earth search: signals against rays cast at the Earth, signs by behaviour, no reliance on presence inside the disk."""

import dataclasses
import functools
import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.constants import EARTH_MU, EARTH_RADIUS_MEAN
from jaxsat.control.earth_search.cases import run_cases, run_one
from jaxsat.control.earth_search.draw import Dispersions, draw_cases, scene_at
from jaxsat.control.earth_search.law import APPROACH, SEARCH, TRACK, Signals, decide, first_memory, search_law
from jaxsat.control.earth_search.loop import LoopSettings, turn_quaternion
from jaxsat.control.earth_search.sensing import SunChoice, ground, sense
from jaxsat.control.earth_search.vehicle import nominal_vehicle
from jaxsat.environment.albedo.infrared import MEAN_BRIGHTNESS, MIN_BRIGHTNESS, VARIATION, random_brightness
from jaxsat.math import quaternion
from jaxsat.math.one_function import in_one_function
from jaxsat.sweep import case_keys

# Most of the time goes into compiling, and none of it has to be fast.
quick = functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 0})
LAW, VEHICLE = search_law("small"), nominal_vehicle("small")
RADIUS = EARTH_RADIUS_MEAN + 800e3
X = jnp.array([1.0, 0.0, 0.0])
SCENE = scene_at(jnp.asarray(RADIUS), X, X, jnp.asarray(1.0), jnp.asarray(60.0))
SAMPLES = 4000
NO_COIN = jnp.zeros(4)
PLAIN = LoopSettings(period_s=0.5, sun="none", moon=False)


def attitudes(count, seed=0):
    q = np.random.default_rng(seed).normal(size=(count, 4))
    return jnp.asarray(q / np.linalg.norm(q, axis=1)[:, None])


def seen_at(scene, q, up, *, sun: SunChoice = "none", moon=False, field=None):
    dcm = quaternion.to_dcm(q)
    return sense(VEHICLE, scene, dcm, up, X[:2], NO_COIN, inside="brightness", sun=sun, moon=moon, field=field)


def summed(brightness):
    """First and second harmonic of each sensor's scan from its samples, [cases 4], by plain NumPy."""
    phase = 2.0 * np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES
    return 2.0 * np.mean(brightness * np.sin(phase), axis=-1), 2.0 * np.mean(brightness * np.cos(2.0 * phase), axis=-1)


def lines_of_sight():
    """Of the four scans in body axes, [4 samples 3]."""
    v = np.sin(2.0 * np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES)
    cone = float(VEHICLE.sensor.cone_angle) - float(VEHICLE.sensor.amplitude) * v
    a = np.asarray(VEHICLE.azimuths)[:, None]
    flat = np.broadcast_to(np.cos(cone)[None, :, None], (4, SAMPLES, 1))
    return np.concatenate([a * np.sin(cone)[None, :, None], flat], axis=-1)


@functools.cache
def looks():
    """150 attitudes, and the lines of sight of each in inertial axes [attitudes 4 samples 3]."""
    q = attitudes(150)
    turn = Rotation.from_quat(np.array(q), scalar_first=True).as_matrix()
    return q, np.matmul(lines_of_sight()[None], turn.transpose(0, 2, 1)[:, None])


@pytest.mark.slow
@pytest.mark.parametrize("uneven", [False, True])
def test_signals_are_those_of_rays_cast_at_the_earth(uneven):
    """Every line of sight of 150 attitudes is turned to inertial axes and met with a sphere."""
    q, sight = looks()
    up, field = jnp.array([0.48, -0.6, 0.64]), random_brightness(0)
    look = functools.partial(seen_at, SCENE, up=up, field=field if uneven else None)
    found = quick(jax.vmap(lambda q: look(q)))(q)
    place = RADIUS / EARTH_RADIUS_MEAN * np.asarray(up)
    along = sight @ place
    discriminant = along**2 - (place @ place - 1.0)
    hit = (discriminant > 0.0) & (along < 0.0)
    bright = np.full(hit.shape, 60.0)
    if uneven:
        point = place + (-along - np.sqrt(np.maximum(discriminant, 0.0)))[..., None] * sight
        departure = np.asarray(quick(lambda ground: field.nearest(ground))(jnp.asarray(point.reshape(-1, 3)))).reshape(
            hit.shape
        )
        bright = np.maximum(60.0 * (1.0 + VARIATION * departure), MIN_BRIGHTNESS)
    first, second = summed(np.where(hit, bright, 0.0))
    assert 20 < np.sum(np.abs(first) > 6.0) < 400
    if not uneven:
        # A sample more or less at each edge.
        np.testing.assert_allclose(found.first, first, atol=60.0 * 4.0 / SAMPLES)
        clear = np.abs(first) > 6.0
        offset = -float(VEHICLE.sensor.amplitude) * second[clear] / first[clear]
        np.testing.assert_allclose(np.asarray(found.signals.offset)[clear], offset, atol=1e-3)
        return
    # Two values of the brightness stand for the whole scan.
    off = np.asarray(found.first) - first
    assert np.sqrt(np.mean(off[np.abs(first) > 6.0] ** 2)) < 2.0
    whole = np.asarray(found.inside)
    assert whole.sum() > 50
    assert 0.7 < np.std(np.asarray(found.first)[whole]) / np.std(first[whole]) < 1.4


def test_what_is_seen_lies_on_the_ground():
    nadir = jnp.array([0.06, -0.08, math.sqrt(0.99)])
    v = jnp.array([0.5, 0.9, 0.7, 1.0])
    azimuths = jnp.concatenate([VEHICLE.azimuths, jnp.zeros((4, 1))], axis=1)
    distance = jnp.asarray(RADIUS / EARTH_RADIUS_MEAN)
    place = np.asarray(ground(VEHICLE.sensor, azimuths, jnp.array([0.0, 0.0, 1.0]), v, nadir, distance))
    np.testing.assert_allclose(np.linalg.norm(place, axis=1), 1.0, atol=1e-9)


def sky(direction_body, *, lit=1.0):
    """The Earth behind the spacecraft (body -z), and one bright body in a body direction; attitude is the identity."""
    d = jnp.asarray(direction_body)
    return dataclasses.replace(SCENE, sun=d, moon=d, moon_lit=jnp.asarray(lit))


def toward(sensor, angle_deg):
    """Body direction on a sensor's scan, at an angle from its centre toward the axis."""
    cone = float(VEHICLE.sensor.cone_angle) - math.radians(angle_deg)
    return np.append(np.asarray(VEHICLE.azimuths)[sensor] * math.sin(cone), math.cos(cone))


def test_the_full_moon_alone_is_a_third_of_the_threshold_at_worst_and_fades_with_its_phase():
    look = quick(lambda scene: seen_at(scene, jnp.array([1.0, 0.0, 0.0, 0.0]), jnp.array([0.0, 0.0, 1.0]), moon=True))
    angles = np.concatenate([np.linspace(-13.0, 13.0, 105), [11.75, -11.75]])
    first = np.array([look(sky(toward(0, a))).first for a in angles])
    # Three times the Moon at the scan's end, where its first harmonic is largest (NOTES: 0.374319).
    assert np.abs(first).max() == pytest.approx(float(VEHICLE.sensor.threshold) / 3.0, rel=2e-5)
    assert np.all(np.sign(first[[20, 84], 0]) == [-1.0, 1.0]) and not np.any(first[:, 1:])
    quarter = look(sky(toward(0, 11.75), lit=0.25)).first[0]
    assert float(quarter) == pytest.approx(0.25 * np.abs(first).max(), rel=1e-9)
    # Behind the Earth there is none.
    hidden = dataclasses.replace(sky(toward(0, 11.75)), disk=jnp.asarray(1.5), cosine_of_disk=jnp.cos(1.5))
    below = quick(
        lambda scene: seen_at(scene, jnp.array([1.0, 0.0, 0.0, 0.0]), -jnp.asarray(toward(0, 11.75)), moon=True).first
    )
    alone = quick(lambda scene: seen_at(scene, jnp.array([1.0, 0.0, 0.0, 0.0]), -jnp.asarray(toward(0, 11.75))).first)
    np.testing.assert_array_equal(below(hidden), alone(hidden))


def test_the_sun_makes_presence_unless_its_sensor_is_replaced():
    q, up = jnp.array([1.0, 0.0, 0.0, 0.0]), jnp.array([0.0, 0.0, 1.0])
    look = {sun: quick(functools.partial(seen_at, q=q, up=up, sun=sun)) for sun in ("unblocked", "blocked")}
    for sensor in range(4):
        struck = sky(toward(sensor, 8.0))
        expected = np.arange(4) == sensor
        np.testing.assert_array_equal(look["unblocked"](struck).signals.present, expected)
        guarded = look["blocked"](struck)
        assert not np.any(guarded.signals.present)
        moved = np.any(np.asarray(guarded.azimuths) != np.asarray(VEHICLE.azimuths), axis=1)
        np.testing.assert_array_equal(moved, expected)
        np.testing.assert_allclose(guarded.azimuths[sensor], VEHICLE.spare_azimuths[sensor])


def told(present, offset=(0.0, 0.0, 0.0, 0.0)):
    return Signals(jnp.asarray(present), jnp.array(offset))


def walk(law, *steps, motion=(0.0, 0.0), period=0.5):
    """Memory and command after a row of presences, as text: `1..1` for +x and -y."""
    memory, command = first_memory(law), jnp.zeros(2)
    one = DECIDE(law)
    for step in steps:
        memory, command = one(memory, told([c == "1" for c in step]), jnp.array(motion))
    return memory, np.degrees(np.asarray(command))


@functools.lru_cache
def _decide():
    return quick(lambda law, memory, signals, motion: decide(law, memory, signals, VEHICLE.azimuths, motion, 0.5))


def DECIDE(law):  # noqa: N802
    return functools.partial(_decide(), law)


def test_the_six_published_steps():
    # 1. About x: z moves along y.
    memory, command = walk(LAW, "....")
    assert int(memory.mode) == SEARCH and command == pytest.approx([0.0, 2.0])
    # 2. Toward the sensor that signals, by its number.
    for sensor, expected in enumerate(([0.8, 0.0], [0.0, 0.8], [-0.8, 0.0], [0.0, -0.8])):
        memory, command = walk(LAW, "".join("1" if k == sensor else "." for k in range(4)))
        assert int(memory.mode) == APPROACH and command == pytest.approx(expected)
    # 3. On, whether its signal stays or not, until the opposite one comes.
    assert walk(LAW, "1...", "....", "....")[1] == pytest.approx([0.8, 0.0])
    assert walk(LAW, "1...", "1...")[1] == pytest.approx([0.8, 0.0])
    # 4. With a signal across along both; an axis stops with its opposite sensor.
    assert walk(LAW, "1...", "...1")[1] == pytest.approx([0.8, -0.8])
    assert walk(LAW, "1...", "...1", "..1.")[1] == pytest.approx([0.0, -0.8])
    # 5. and 6.
    memory, _ = walk(LAW, "1...", "1111")
    assert int(memory.mode) == TRACK
    memory, command = walk(LAW, "1...", "1111", "111.")
    assert int(memory.mode) == SEARCH and command == pytest.approx([0.0, 2.0])


def test_what_the_paper_leaves_open():
    # The other axis untold: on in the sense of the search.
    assert walk(LAW, "1.1.")[1] == pytest.approx([0.0, 0.8])
    guarded = search_law("small", "guarded")
    # Back where that made the last signal vanish, and what is lost while tracking is approached.
    assert walk(guarded, "1.1.", "....")[1] == pytest.approx([0.0, -2.0])
    memory, command = walk(guarded, "1...", "1111", "11.1")
    assert int(memory.mode) == APPROACH and command == pytest.approx([2.0, 0.0])
    # An approach without end is given up for a search across: 120 deg at 2 deg/s.
    memory, command = walk(guarded, "...1", *["...."] * 125)
    assert int(memory.mode) == SEARCH and command == pytest.approx([-2.0, 0.0])


@pytest.mark.slow
def test_z_moves_toward_the_commanded_side():
    """A step of the loop with the Earth at the sensor +y: body z comes nearer to it."""
    case = one_case(up_body=-np.array([0.0, math.sin(2.1), math.cos(2.1)]))
    _, samples = alone(PLAIN, 120)(LAW, case)
    assert bool(samples.present[0, 1]) and not np.any(np.asarray(samples.present[0])[[0, 2, 3]])
    error = np.asarray(samples.error)
    # 0.8 deg/s after the lag of 2 s; along the scan only, the orbit moves less than 0.1 deg/s.
    assert np.degrees(error[0] - error[100]) == pytest.approx(0.8 * 48.0, abs=5.0)


def one_case(up_body):
    zero = jnp.zeros((1, 3))
    up = jnp.asarray(up_body)[None]
    along = np.cross(up_body, [1.0, 0.0, 0.0])
    return dataclasses.replace(
        draw_one(),
        quaternion=jnp.array([[1.0, 0.0, 0.0, 0.0]]),
        angular_velocity=zero,
        up=up,
        along=jnp.asarray(along / np.linalg.norm(along))[None],
    )


@functools.lru_cache
def drawn():
    """24 cases over the Earth as it is."""
    return quick(functools.partial(draw_cases, Dispersions(size="small")))(case_keys(3, np.arange(24)))


def test_an_earth_that_stands_still_is_drawn_as_any_other():
    still = quick(functools.partial(draw_cases, Dispersions(size="small", still=True)))(case_keys(3, np.arange(24)))
    assert not np.asarray(still.orbital_rate).any() and np.asarray(drawn().orbital_rate).all()
    for name in ("quaternion", "up", "greenwich"):
        np.testing.assert_array_equal(getattr(still, name), getattr(drawn(), name))


def draw_many():
    """The same over an even one."""
    cases = drawn()
    return eqx.tree_at(lambda cases: cases.scene.brightness, cases, jnp.asarray(np.full(24, MEAN_BRIGHTNESS)))


def draw_one():
    cases = draw_many()
    own = {field.name: getattr(cases, field.name) for field in dataclasses.fields(cases) if field.name != "vehicle"}
    return dataclasses.replace(cases, **jax.tree.map(lambda leaf: leaf[:1], own))


@functools.lru_cache
def alone(settings, steps):
    return quick(lambda law, case: run_one(settings, law, case, None, steps))


@functools.lru_cache
def many(settings, steps):
    """Final states of cases by `run_one` under vmap, which compiles sooner than the replayed loop."""

    def one(law, case):
        return run_one(settings, law, jax.tree.map(lambda leaf: leaf[None], case), None, steps)[0]

    axes = eqx.tree_at(lambda cases: cases.vehicle, jax.tree.map(lambda _: 0, draw_many()), None)
    return quick(lambda law, cases: jax.vmap(one, in_axes=(None, axes))(law, cases))


def error_deg(state):
    nadir = -Rotation.from_quat(np.array(state.quaternion), scalar_first=True).inv().apply(np.array(state.up))
    return np.degrees(np.arccos(np.clip(nadir[:, 2], -1.0, 1.0)))


@pytest.mark.slow
@pytest.mark.parametrize("inside", ["always", "never", "random"])
def test_presence_inside_the_disk_does_not_matter(inside):
    """The same cases with presence inside forced, forbidden or thrown: every one ends at the nadir."""
    settings = dataclasses.replace(PLAIN, inside=inside)
    state = many(settings, 1600)(search_law("small", "guarded"), draw_many())
    assert np.all(np.asarray(state.memory.mode) == TRACK)
    # Even Earth: what is left is the observer's; the orbit's 0.06 deg/s is followed without lag.
    assert error_deg(state).max() < 0.2
    np.testing.assert_allclose(np.degrees(np.linalg.norm(state.angular_velocity, axis=1)), 0.0594, atol=0.02)


@pytest.mark.slow
def test_cases_together_are_those_alone():
    settings = LoopSettings(period_s=4.0)
    cases = drawn()
    field, law = random_brightness(0), search_law("small")
    together = quick(in_one_function(lambda cases: run_cases(settings, law, cases, field, 12)))(cases)
    one, samples = quick(lambda cases: run_one(settings, law, cases, field, 12, number=4))(cases)
    for a, b in zip(jax.tree.leaves(together), jax.tree.leaves(one), strict=True):
        np.testing.assert_allclose(a[4], b, rtol=1e-9, atol=1e-12)
    assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(samples))


def test_the_turn_of_a_step_is_that_of_the_rotation():
    rotations = np.random.default_rng(0).normal(size=(20, 3))
    rotations *= np.linspace(0.0, math.pi, 20)[:, None] / np.linalg.norm(rotations, axis=1)[:, None]
    expected = Rotation.from_rotvec(rotations).as_quat(scalar_first=True)
    found = quick(jax.vmap(lambda rotation: turn_quaternion(rotation)))(jnp.asarray(rotations))
    np.testing.assert_allclose(found, expected, atol=1e-13)


@pytest.mark.slow
def test_the_orbit_is_circular_at_its_rate():
    case = draw_one()
    rate = math.sqrt(EARTH_MU / RADIUS**3)
    assert float(case.orbital_rate[0]) == pytest.approx(rate, rel=1e-12)
    state, _ = alone(PLAIN, 120)(LAW, case)
    turned = math.cos(60.0 * rate) * case.up[0] + math.sin(60.0 * rate) * case.along[0]
    np.testing.assert_allclose(state.up, turned, atol=1e-12)
    np.testing.assert_allclose([state.up @ state.up, state.up @ state.along], [1.0, 0.0], atol=1e-13)
