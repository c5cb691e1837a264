"""Photodiodes, panels and the pyramid against NumPy; slopes at every edge of their laws; the Sun found back."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from sample_views import FACES, LIT, SUNS, VIEWS, body, earthlight, readings, slopes, some, told, view_of
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

from jaxsat.sensors import Panels, Photodiodes, PyramidSensor, PyramidSunSensor, stepped
from jaxsat.sensors.sunlight.panels import axes_across
from jaxsat.spacecraft import tilted

WINGS = np.array([[0.6, 0.0, 0.8], [-0.48, 0.6, 0.64]])
NORMALS = np.vstack([FACES, WINGS])
GAIN = np.linspace(0.9, 1.2, 8)
LIMIT, EXPONENT = np.radians(72.0), 3.4
TABLE = np.array([[0.0, 0.5, 1.0, 1.4], [1.0, 0.9, 0.5, 0.1]])
TILTS = np.random.default_rng(8).normal(scale=0.1, size=(8, 2))
COSINE = Photodiodes(NORMALS, GAIN)
POWER = Photodiodes(NORMALS, GAIN, LIMIT, EXPONENT, response="power")
BY_TABLE = Photodiodes(NORMALS, GAIN, None, None, TABLE[0], TABLE[1], response="table", earthlight=False)
PANELS, TILTED = Panels(NORMALS, 0.5, GAIN), Panels(NORMALS, 0.5, GAIN, TILTS)
TURN, AXES = np.array([0.1, -0.2, 0.3]), np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
PYRAMID = PyramidSensor(PyramidSunSensor(max_current=0.02), TURN, AXES)


def angles():
    return np.arccos(np.clip(body(SUNS) @ NORMALS.T, -1.0, 1.0))


def of_sun(response):
    return LIT[:, None] * response


def by_power():
    return GAIN * (of_sun(np.where(angles() < LIMIT, 1.0 - (angles() / LIMIT) ** EXPONENT, 0.0)) + earthlight(NORMALS))


def by_table():
    line = make_interp_spline(*TABLE, k=1)
    return GAIN * of_sun(np.where(angles() <= TABLE[0, -1], line(angles()), 0.0))


def by_cosine(normals):
    return GAIN * (of_sun(np.maximum(body(SUNS) @ normals.T, 0.0)) + earthlight(normals))


def tilted_normals():
    """Each turned by a rotation vector across it: of two body axes, without their parts along the normal."""
    found = []
    for normal, tilt in zip(NORMALS, TILTS, strict=True):
        two = sorted(sorted(range(3), key=lambda k, normal=normal: abs(normal[k]))[:2])
        across = [np.eye(3)[k] - normal[k] * normal for k in two]
        found.append(Rotation.from_rotvec(tilt @ np.array(across)).apply(normal))
    return np.array(found)


def by_pyramid():
    """Zhukov 2019, equations 1 to 7, of one Sun at a time."""
    lean, cutoff, hood = np.radians([22.0, 83.0, 74.0])
    s, c, found = np.sin(lean), np.cos(lean), []
    for sun, lit in zip(Rotation.from_rotvec(TURN).inv().apply(body(SUNS)) @ AXES.T, LIT, strict=True):
        x, share = sun[0], 1.0
        if x < np.cos(hood):
            x = max(x, 0.0)
            share = np.sin(lean + hood) / np.cos(hood) * x / (s * x + c * np.sqrt(1.0 - x * x))
        cosines = np.array(
            [s * sun[0] + c * sun[2], s * sun[0] - c * sun[2], s * sun[0] + c * sun[1], s * sun[0] - c * sun[1]]
        )
        seen = (np.arccos(np.clip(cosines, -1.0, 1.0)) < cutoff) & (sun[0] > 0.0)
        found.append(0.02 * lit * share * np.where(seen, cosines, 0.0))
    return np.array(found)


@pytest.mark.parametrize(
    ("sensor", "expected"),
    [
        (COSINE, lambda: by_cosine(NORMALS)),
        (POWER, by_power),
        (BY_TABLE, by_table),
        (PANELS, lambda: 0.5 * by_cosine(NORMALS)),
        (TILTED, lambda: 0.5 * by_cosine(tilted_normals())),
        (PYRAMID, by_pyramid),
    ],
    ids=["cosine", "power", "table", "panels", "tilted", "pyramid"],
)
def test_reading_is_that_of_numpy(sensor, expected):
    np.testing.assert_allclose(readings(sensor), expected(), rtol=1e-11, atol=1e-14)
    assert sensor.needs == {"light"} and sensor.sees == "sun"


def test_tilts_of_a_box_are_those_of_its_panels():
    box = Panels(FACES, 0.5, np.ones(6), TILTS[:6])
    np.testing.assert_allclose(box.tilted_normals(), tilted(jnp.asarray(FACES), jnp.asarray(TILTS[:6])), atol=1e-15)
    across = np.asarray(jax.vmap(axes_across)(jnp.asarray(WINGS)))
    np.testing.assert_allclose(np.einsum("wka,wa->wk", across, WINGS), 0.0, atol=1e-15)


@pytest.mark.parametrize(
    "sensor", [COSINE, POWER, BY_TABLE, TILTED, PYRAMID], ids=["cosine", "power", "table", "tilted", "pyramid"]
)
def test_slopes_are_differences(sensor):
    """By gains, laws, normals, tilts and turns of the satellite, where no ray is at an edge."""
    forward, reverse, differences = slopes(sensor, some(1, 4, 9))
    np.testing.assert_allclose(forward, differences, atol=2e-9 * np.abs(forward).max())
    np.testing.assert_allclose(reverse, forward, atol=1e-12 * np.abs(forward).max())


EDGES = np.array([0.0, 0.6, 1.2, 0.5 * np.pi, np.pi])
"""On the axis, at a row of the table, at the limit of the laws, on the horizon, behind."""
Z = [[0.0, 0.0, 1.0]]


def at(*angles):
    """Views with the Sun at angles from body z."""
    suns = [(np.sin(angle), 0.0, np.cos(angle)) for angle in angles]
    return jax.tree.map(lambda *x: jnp.stack(x), *(view_of(Rotation.identity(), sun=sun) for sun in suns))


LAWS = {
    "cosine": lambda n: Photodiodes(n, [1.0]),
    "power": lambda n: Photodiodes(n, [1.0], 1.2, 2.0, response="power"),
    "steep": lambda n: Photodiodes(n, [1.0], 1.2, 0.5, response="power"),
    "table": lambda n: Photodiodes(n, [1.0], None, None, [0.0, 0.6, 1.2], [1.0, 0.7, 0.0], response="table"),
    "panel": lambda n: Panels(n, 1.0, [1.0], [[0.0, 0.0]]),
}
VALUES = {
    "cosine": np.cos,
    "power": lambda a: np.maximum(1.0 - (a / 1.2) ** 2, 0.0),
    "steep": lambda a: np.maximum(1.0 - (a / 1.2) ** 0.5, 0.0),
    "table": lambda a: np.interp(a, [0.0, 0.6, 1.2], [1.0, 0.7, 0.0]),
    "panel": np.cos,
}


@pytest.mark.parametrize("law", LAWS)
def test_slopes_are_finite_at_the_edges_and_lie_between_those_of_both_sides(law):
    sensor, views = LAWS[law](Z), at(*EDGES)

    def value(angle):
        return np.maximum(VALUES[law](np.abs(angle)), 0.0)

    # An angle of zero comes out within rounding, of which the steep law takes the root.
    found = np.asarray(jax.jit(jax.vmap(sensor))(views))[:, 0]
    np.testing.assert_allclose(found, value(EDGES), atol=1e-7 if law == "steep" else 1e-12)
    forward, reverse, _ = slopes(sensor, views)
    assert np.all(np.isfinite(forward)) and np.all(np.isfinite(reverse))
    # A turn about y takes the cell toward a Sun in the plane of x and z; on the axis an even law is flat.
    h = 1e-6
    sides = np.array([value(EDGES) - value(EDGES - h), value(EDGES + h) - value(EDGES)]) / h
    least, most = np.sort(sides, axis=0) + np.array([[-1e-5], [1e-5]])
    assert np.all((least <= -forward[:, 0, 1]) & (-forward[:, 0, 1] <= most))


@pytest.mark.parametrize("law", ["power", "steep"])
def test_slopes_by_the_law_itself_are_right_on_the_axis_and_beyond_the_limit(law):
    sensor, angles = LAWS[law](Z), np.array([0.0, 1.19, 1.3])
    slope = jax.jit(jax.vmap(jax.grad(lambda s, view: s(view)[0]), (None, 0)))(sensor, at(*angles))
    p, r = {"power": 2.0, "steep": 0.5}[law], angles[1] / 1.2
    np.testing.assert_allclose(slope.limit, [0.0, p * r**p / 1.2, 0.0], atol=1e-12)
    np.testing.assert_allclose(slope.exponent, [0.0, -(r**p) * np.log(r), 0.0], atol=1e-12)


LONELY = [
    Photodiodes(FACES, np.ones(6), earthlight=False),
    Photodiodes(NORMALS, GAIN, LIMIT, 2.0, response="power", earthlight=False),
    Photodiodes(NORMALS, GAIN, None, None, [0.0, 0.8, 1.5], [1.0, 0.6, 0.0], response="table", earthlight=False),
    Panels(NORMALS, 0.5, GAIN, TILTS, earthlight=False),
]


@pytest.mark.parametrize("sensor", LONELY, ids=["cosine", "power", "table", "panels"])
def test_the_sun_is_found_back(sensor):
    """Without noise and earthlight; where the cells leave more than one direction the stated error says so."""
    bright = eqx.tree_at(lambda v: v.light.illumination, VIEWS, jnp.ones_like(VIEWS.light.illumination))
    found, sigma = told(sensor, np.asarray(jax.jit(jax.vmap(sensor))(bright)), 1e-4)
    apart = np.arccos(np.clip(np.sum(found * body(SUNS), axis=1), -1.0, 1.0))
    sure = sigma < 0.01
    assert np.mean(sure) > 0.5 and apart[sure].max() < 1e-6
    assert np.all(apart[np.isfinite(sigma)] < 4.0 * sigma[np.isfinite(sigma)] + 1e-6)


def test_the_pyramid_finds_the_sun_before_it():
    found, sigma = told(PYRAMID, readings(PYRAMID) / LIT[:, None], 1e-5)
    apart = np.linalg.norm(found - body(SUNS), axis=1)
    three = np.sum(readings(PYRAMID) > 0.0, axis=1) >= 3
    assert three.sum() > 4 and np.all(sigma[three] < 0.01) and apart[three].max() < 1e-6
    # Of two solutions of two currents either may be the true one, and the stated error says so.
    assert np.all(apart[np.isfinite(sigma)] < 3.0 * sigma[np.isfinite(sigma)])
    assert np.all(np.isnan(sigma[~np.any(readings(PYRAMID) > 0.0, axis=1)]))


@pytest.mark.parametrize(
    ("sensor", "full"), [(COSINE, 1.0), (POWER, 1.0), (PANELS, 0.5)], ids=["cosine", "power", "panels"]
)
def test_stated_errors_hold_the_light_of_the_earth(sensor, full):
    """Noise of 2 %, light of the Earth as it comes and suns that are partly hidden: errors within what is stated."""
    keys = jax.random.split(jax.random.key(1), len(SUNS))
    noisy = jax.jit(jax.vmap(lambda view, key: sensor.noisy(sensor(view), 0.02 * full, key)))(VIEWS, keys)
    found, sigma = told(sensor, np.asarray(noisy), 0.02 * full)
    clear = np.isfinite(sigma) & (LIT == 1.0)
    apart = np.arccos(np.clip(np.sum(found * body(SUNS), axis=1), -1.0, 1.0))[clear]
    assert np.mean(clear) > 0.7 and sigma[clear].min() >= np.radians(9.99)
    assert np.sqrt(np.mean((apart / sigma[clear]) ** 2) / 2.0) < 1.3
    assert np.max(apart / sigma[clear]) < 4.0


def test_in_the_dark_and_from_nonsense_there_is_no_sun():
    dark = np.abs(np.random.default_rng(3).normal(scale=0.02, size=(20, 8)))
    assert np.all(np.isnan(told(COSINE, dark, 0.02)[1]))
    # Three of eight cells at full, though none of them looks where another does.
    nonsense = np.array([[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0], [999.9, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
    assert np.all(np.isnan(told(COSINE, nonsense, 0.02)[1]))
    unknown = np.full((2, 8), np.nan)
    unknown[1, 0] = 1.0
    found, sigma = told(COSINE, unknown, 0.02)
    assert np.all(np.isnan(sigma)) and np.all(np.isnan(found))


def test_a_missing_cell_is_left_out_and_a_full_battery_is_allowed_for():
    whole = told(LONELY[3], 0.5 * GAIN * np.maximum(body(SUNS) @ tilted_normals().T, 0.0), 1e-3)
    limited = 0.5 * GAIN * np.maximum(body(SUNS) @ tilted_normals().T, 0.0) * 0.5
    limited[:, 7] = np.nan
    found, sigma = told(LONELY[3], limited, 1e-3)
    three = np.isfinite(sigma) & (np.sum(limited[:, :7] > 0.02, axis=1) >= 4)
    apart = np.arccos(np.clip(np.sum(found * body(SUNS), axis=1), -1.0, 1.0))
    assert three.sum() > 10 and np.all(apart[three] < 0.05) and np.all(apart[three] < 4.0 * sigma[three])
    assert np.isfinite(whole[1]).all()


def test_laws_want_their_numbers():
    with pytest.raises(ValueError, match="response 'power' wants exponent"):
        Photodiodes(FACES, np.ones(6), 1.0, response="power")
    with pytest.raises(ValueError, match="response 'table' wants table_angle and table_value"):
        Photodiodes(FACES, np.ones(6), response="table")


def test_noise_of_panels_leaves_the_dark_ones_dark_and_steps_are_whole():
    reading, keys = jnp.asarray([0.0, 0.001, 0.5]), jax.random.split(jax.random.key(0), 500)
    panels = Panels(FACES[:3], 0.5, np.ones(3))
    noisy = np.asarray(jax.jit(jax.vmap(lambda key: panels.noisy(reading, 0.01, key)))(keys))
    assert np.all(noisy[:, 0] == 0.0) and np.all(noisy >= 0.0)
    assert np.std(noisy[:, 2]) == pytest.approx(0.01, rel=0.1)
    np.testing.assert_allclose(stepped(jnp.asarray([0.12, -0.26, 0.3]), 0.1), [0.1, -0.3, 0.3], atol=1e-15)
    np.testing.assert_array_equal(stepped(reading, 0.0), reading)
