"""Panel currents: closed forms for single directions, exact zeros, slopes with and without patches of diffuse light."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxsat.environment import KeplerOrbit, LightTable, diffuse_albedo, specular_albedo
from jaxsat.math import quaternion
from jaxsat.sensors.solar_panels import Albedo, albedo_currents, direct_currents, panel_currents
from jaxsat.spacecraft import SolarPanels, box_normals

R = 6371.2e3
R_MUNIN = 7630.026457e3
GAINS = np.array([1.0, 0.9, 1.1, 1.05, 0.95, 1.2])
I_MAX = 0.24
PANELS = SolarPanels(box_normals(), jnp.asarray(I_MAX), jnp.asarray(GAINS))
ALBEDO = Albedo(jnp.asarray(0.2), jnp.asarray(0.3))
NORMALS = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
ATTITUDE = Rotation.from_rotvec([0.7, -1.1, 0.4])
Q = jnp.asarray(ATTITUDE.as_quat(scalar_first=True))
UPRIGHT = jnp.asarray([1.0, 0.0, 0.0, 0.0])

direct = jax.jit(direct_currents)
reflected = jax.jit(albedo_currents)
total = jax.jit(panel_currents)


def light(
    sun=(0.0, 0, 1), illumination=1.0, mirror=(0.0, 0, -1), mirror_factor=0.0, patches=((0.0, 0, -1),), weights=(0.0,)
):
    """Light in inertial axes, from explicit directions."""
    return LightTable(*(jnp.asarray(x, float) for x in (sun, illumination, mirror, mirror_factor, patches, weights)))


def scene(sun_deg, radius=R_MUNIN):
    """Position above the north pole and the light of a Sun at an angle from it, both albedos computed."""
    position = jnp.asarray([0.0, 0.0, radius])
    sun = jnp.asarray([np.sin(np.radians(sun_deg)), 0.0, np.cos(np.radians(sun_deg))])
    return lit_scene(position, sun)


@jax.jit
def lit_scene(position, sun):
    return LightTable(sun, jnp.ones(()), *specular_albedo(position, sun, R), *diffuse_albedo(position, sun, R, 10, 20))


def unit(*v):
    return np.array(v) / np.linalg.norm(v)


SUN = unit(0.3, -0.5, 0.8)
PATCHES = np.array([unit(0.2, 0.1, -1), unit(-0.5, 0.3, -0.7), unit(0.1, -0.9, -0.3)])
WEIGHTS = np.array([0.12, 0.05, 0.08])
MIRROR = unit(0.4, 0.2, -0.9)


def test_direct_current_is_the_cosine_in_front_and_zero_behind():
    expected = I_MAX * GAINS * 0.8 * np.maximum(NORMALS @ ATTITUDE.inv().apply(SUN), 0)
    found = direct(Q, PANELS, light(SUN, 0.8))
    np.testing.assert_allclose(found, expected, rtol=1e-14)
    assert np.count_nonzero(found) == 3


@pytest.mark.parametrize("k", range(6))
def test_each_face_sees_the_sun_in_its_own_direction(k):
    # Head on, edge on, at 60 deg; opposite and neighbouring faces stay dark.
    found = np.asarray(direct(UPRIGHT, PANELS, light(NORMALS[k])))
    expected = np.zeros(6)
    expected[k] = I_MAX * GAINS[k]
    np.testing.assert_array_equal(found, expected)
    neighbour = (k + 2) % 6
    found = np.asarray(direct(UPRIGHT, PANELS, light(0.5 * NORMALS[k] + np.sqrt(0.75) * NORMALS[neighbour])))
    expected[[k, neighbour]] = I_MAX * GAINS[[k, neighbour]] * np.array([0.5, np.sqrt(0.75)])
    np.testing.assert_allclose(found, expected, rtol=1e-15)


def test_nothing_in_shadow_and_nothing_from_a_black_earth():
    np.testing.assert_array_equal(direct(Q, PANELS, light(SUN, 0.0)), 0.0)
    black = Albedo(jnp.zeros(()), jnp.zeros(()))
    np.testing.assert_array_equal(total(Q, PANELS, black, light(SUN, 0.0, MIRROR, 0.4, PATCHES, WEIGHTS)), 0.0)


def test_albedo_current_is_the_sum_over_directions():
    found = total(Q, PANELS, ALBEDO, light(SUN, 1.0, MIRROR, 0.4, PATCHES, WEIGHTS))
    to_body = ATTITUDE.inv()
    expected = np.maximum(NORMALS @ to_body.apply(SUN), 0) + 0.2 * 0.4 * np.maximum(NORMALS @ to_body.apply(MIRROR), 0)
    for direction, weight in zip(PATCHES, WEIGHTS, strict=True):
        expected += 0.3 * weight * np.maximum(NORMALS @ to_body.apply(direction), 0)
    np.testing.assert_allclose(found, I_MAX * GAINS * expected, rtol=1e-14, atol=1e-17)
    # Earthlight does not need the Sun itself to be visible.
    dark = total(Q, PANELS, ALBEDO, light(SUN, 0.0, MIRROR, 0.4, PATCHES, WEIGHTS))
    np.testing.assert_array_equal(dark, reflected(Q, PANELS, ALBEDO, light(SUN, 1.0, MIRROR, 0.4, PATCHES, WEIGHTS)))


LIMIT = np.arccos(R / R_MUNIN)


def tilted(angle):
    """Six panels at an angle from the zenith, all around."""
    azimuth = np.arange(6) + 0.3
    normals = np.stack(
        [np.sin(angle) * np.cos(azimuth), np.sin(angle) * np.sin(azimuth), np.cos(angle) + 0 * azimuth], 1
    )
    return SolarPanels(jnp.asarray(normals), jnp.asarray(I_MAX), jnp.ones(6))


@pytest.mark.parametrize("sun_deg", [0.0, 30.0, 60.0, 100.0, 140.0])
def test_no_earthlight_on_a_panel_that_looks_over_the_horizon(sun_deg):
    assert np.degrees(LIMIT) == pytest.approx(33.382416, abs=5e-7)
    for angle in (0.0, 0.5 * LIMIT, LIMIT):
        np.testing.assert_array_equal(reflected(UPRIGHT, tilted(angle), ALBEDO, scene(sun_deg)), 0.0)


def test_earthlight_past_the_horizon():
    # With the Sun overhead the whole limb is lit; the outermost ring of patches stands 0.3 deg inside it.
    found = reflected(UPRIGHT, tilted(LIMIT + np.radians(2.0)), ALBEDO, scene(0.0))
    assert np.all(np.asarray(found) > 0.0)
    # Beyond the reach of light, even the nadir is dark.
    np.testing.assert_array_equal(reflected(UPRIGHT, tilted(np.pi), ALBEDO, scene(150.0)), 0.0)


def test_currents_of_a_batch():
    table = jax.tree.map(lambda x: jnp.stack([x, x]), light(SUN, 1.0, MIRROR, 0.4, PATCHES, WEIGHTS))
    q = jnp.stack([Q, UPRIGHT])
    found = jax.jit(jax.vmap(panel_currents, (0, None, None, 0)))(q, PANELS, ALBEDO, table)
    for k in range(2):
        alone = total(q[k], PANELS, ALBEDO, light(SUN, 1.0, MIRROR, 0.4, PATCHES, WEIGHTS))
        np.testing.assert_allclose(found[k], alone, atol=1e-16)


def perturbed(x, table):
    """Currents after a small turn x[:3] in the body, with gains, I_max and both reflectivities scaled by 1 + x[3:]."""
    q = quaternion.multiply(Q, quaternion.from_rotation_vector(x[:3]))
    panels = SolarPanels(
        PANELS.normals, PANELS.max_current * (1 + x[3]), PANELS.gains * (1 + x[4] * jnp.asarray(GAINS))
    )
    return panel_currents(q, panels, Albedo(ALBEDO.specular * (1 + x[5]), ALBEDO.diffuse * (1 + x[6])), table)


currents_at = jax.jit(perturbed)
SLOPES = {"forward": jax.jit(jax.jacfwd(perturbed)), "reverse": jax.jit(jax.jacrev(perturbed))}


@pytest.mark.slow
@pytest.mark.parametrize("way", SLOPES)
@pytest.mark.parametrize("sun_deg", [40.0, 75.0])
def test_slopes_against_differences(way, sun_deg):
    table, h = scene(sun_deg), 1e-6
    # No patch may cross a panel's horizon within the step: there the slope has a (tiny) step itself.
    cosines = NORMALS @ ATTITUDE.inv().apply(np.array(table.diffuse_direction_eci)).T
    assert np.min(np.abs(cosines)) > 10 * h
    slope = np.asarray(SLOPES[way](jnp.zeros(7), table))
    steps = h * np.eye(7)
    ends = [[np.asarray(currents_at(jnp.asarray(s * step), table)) for s in (1, -1)] for step in steps]
    difference = np.stack([(plus - minus) / (2 * h) for plus, minus in ends], axis=-1)
    assert np.all(np.linalg.norm(slope, axis=0) > 1e-3 * I_MAX)
    # Rounding: eps x 0.3 A / 1e-6 = 1e-10; truncation is 1e-13.
    np.testing.assert_allclose(slope, difference, atol=3e-10)


def test_slope_by_the_light_itself():
    """Weights, factors and directions are traced when elements of the orbit are fitted: none may be cut off."""
    table = light(SUN, 0.9, MIRROR, 0.4, PATCHES, WEIGHTS)
    slope = jax.jit(jax.jacrev(total, argnums=3))(Q, PANELS, ALBEDO, table)
    cosines = np.maximum(NORMALS @ ATTITUDE.inv().apply(PATCHES).T, 0)
    scale = (I_MAX * GAINS)[:, None]
    np.testing.assert_allclose(
        slope.specular_factor, scale[:, 0] * 0.2 * np.maximum(NORMALS @ ATTITUDE.inv().apply(MIRROR), 0), atol=1e-16
    )
    np.testing.assert_allclose(
        slope.illumination, scale[:, 0] * np.maximum(NORMALS @ ATTITUDE.inv().apply(SUN), 0), atol=1e-16
    )
    np.testing.assert_allclose(slope.diffuse_weight, 0.3 * scale * cosines, atol=1e-16)
    normals_eci = ATTITUDE.apply(NORMALS)
    by_direction = (
        0.3 * scale[:, :, None] * WEIGHTS[None, :, None] * (cosines > 0)[:, :, None] * normals_eci[:, None, :]
    )
    np.testing.assert_allclose(slope.diffuse_direction_eci, by_direction, atol=1e-16)


@pytest.mark.slow
def test_slope_by_the_orbit_through_diffuse_light():
    # The Sun 30 deg from the vertical: no terminator in sight, where the slope would be that of the integral only.

    def position_at(a):
        return KeplerOrbit(a, 0.01, 1.2, 0.3, 0.4, 0.5)(jnp.asarray(300.0))[0]

    position = np.asarray(jax.jit(position_at)(jnp.asarray(R_MUNIN)))
    vertical = position / np.linalg.norm(position)
    across = unit(*np.cross(vertical, [0.0, 0.0, 1.0]))
    sun = jnp.asarray(np.cos(np.pi / 6) * vertical + np.sin(np.pi / 6) * across)

    def current(a):
        zero = jnp.zeros(())
        table = LightTable(sun, zero, sun, zero, *diffuse_albedo(position_at(a), sun, R, 4, 6))
        only_diffuse = Albedo(jnp.zeros(()), jnp.asarray(0.3))
        return albedo_currents(Q, PANELS, only_diffuse, table)

    value, a, h = jax.jit(current), jnp.asarray(R_MUNIN), 10.0
    slope = jax.jit(jax.jacfwd(current))(a)
    difference = (np.asarray(value(a + h)) - np.asarray(value(a - h))) / (2 * h)
    # 0.02 A over 1e6 m is the scale: earthlight thins with height.
    assert np.max(np.abs(difference)) > 1e-9
    np.testing.assert_allclose(slope, difference, rtol=1e-5, atol=1e-14)


def test_sun_on_the_horizon_of_a_panel():
    """Exactly edge on the current is zero, and its slope lies between those of the two sides: 0 and I_max g."""

    def current(angle, table):
        return direct_currents(quaternion.from_rotation_vector(angle * jnp.asarray([0.0, 1.0, 0.0])), PANELS, table)

    # The Sun along z; turning about y by an angle brings +x away from it and -x toward it.
    table = light((0.0, 0.0, 1.0))
    slope = jax.jit(jax.jacfwd(current))
    current = jax.jit(current)
    np.testing.assert_array_equal(current(jnp.zeros(()), table)[:4], 0.0)
    sides = {s: np.asarray(slope(jnp.asarray(s * 1e-9), table)) for s in (-1, 1)}
    lit_at = {s: np.asarray(current(jnp.asarray(s * 1e-3), table)) for s in (-1, 1)}
    for s in (-1, 1):
        one_sided = lit_at[s] / (s * 1e-3)
        # sin(h)/h and its slope cos(h) differ by h^2 / 3.
        np.testing.assert_allclose(sides[s][:4], one_sided[:4], atol=1e-6 * I_MAX)
    between = np.asarray(slope(jnp.zeros(()), table))[:4]
    assert np.all(np.isfinite(between))
    low, high = np.minimum(sides[-1], sides[1])[:4], np.maximum(sides[-1], sides[1])[:4]
    assert np.all((between >= low - 1e-15) & (between <= high + 1e-15))
    assert np.count_nonzero(high - low) == 2


def test_every_number_can_be_fitted():
    leaves = jax.tree.leaves(eqx.filter((PANELS, ALBEDO), eqx.is_inexact_array))
    assert sum(leaf.size for leaf in leaves) == 18 + 1 + 6 + 2
