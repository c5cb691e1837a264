"""Shadow: entry and exit on the Munin orbit, penumbra against direct integration over the disk, edges."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsat.constants import AU, SUN_RADIUS
from jaxsat.environment import (
    ConeShadow,
    CylinderShadow,
    apparent_sun,
    cone_illumination,
    cylinder_illumination,
    orbit_from_perigee_time_km_deg,
)
from jaxsat.environment.shadow import lens_area
from jaxsat.time import Epoch

R = 6371.2e3
SUN = np.array([1.0, 0.0, 0.0])
MUNIN = orbit_from_perigee_time_km_deg(
    a_km=7630.026457, e=0.072661, i_deg=95.438873, raan_deg=64.81879, argp_deg=16.675906, t_perigee_s=3230.533197
)
cone = jax.jit(lambda position, sun: ConeShadow()(position, sun))
cone_gradient = jax.jit(jax.grad(lambda position, sun: ConeShadow()(position, sun), argnums=(0, 1)))
area = jax.jit(lens_area)
area_gradient = jax.jit(jax.grad(lens_area, argnums=(0, 1, 2)))


def behind(angle_from_axis, distance=7.0e6):
    """Position whose direction is `angle_from_axis` [rad] off the shadow's axis."""
    return jnp.asarray(distance * np.array([-np.cos(angle_from_axis), np.sin(angle_from_axis), 0.0]))


def test_munin_entry_and_exit():
    times = np.arange(2500.0, 4300.0, 0.1)
    sun, _ = apparent_sun(Epoch.from_utc(2001, 1, 18, 4, 54, 15), times)
    position = jax.jit(jax.vmap(lambda t: MUNIN(t)[0]))(jnp.asarray(times))
    lit = np.asarray(jax.jit(jax.vmap(CylinderShadow()))(position, jnp.asarray(sun)))
    edges = times[np.flatnonzero(np.diff(lit))]
    # Reference 2746.0 and 4008.6 s; how the Sun is held (fixed, moving, mean or apparent place) moves these by 2 s.
    np.testing.assert_allclose(edges, [2746.0, 4008.6], atol=2.5)
    partial = np.asarray(jax.jit(jax.vmap(ConeShadow()))(position, jnp.asarray(sun)))
    assert np.all((partial >= 0.0) & (partial <= 1.0))
    # The cylinder's edge lies within the penumbra, where about half of the disk is seen.
    np.testing.assert_allclose(np.interp(edges, times, partial), 0.5, atol=0.3)


@pytest.mark.parametrize("offset, lit", [(1e-9, 1.0), (-1e-9, 0.0)])
def test_cylinder_is_sharp(offset, lit):
    position = jnp.asarray([-3.0e6, R * (1 + offset), 0.0])
    assert float(cylinder_illumination(position, jnp.asarray(SUN), R)) == lit
    assert float(cylinder_illumination(position * jnp.asarray([-1.0, 1, 1]), jnp.asarray(SUN), R)) == 1.0
    assert np.all(np.asarray(jax.grad(cylinder_illumination)(position, jnp.asarray(SUN), R)) == 0.0)


def test_penumbra_against_the_disk_seen_point_by_point():
    # Rays to a grid on the Sun's sphere's disk, blocked where the line of sight meets the Earth's sphere.
    u = (np.arange(400) + 0.5) / 200 - 1
    y, z = (c.ravel() for c in np.meshgrid(u, u))
    inside = y**2 + z**2 < 1
    points = np.stack([np.full(inside.sum(), AU), SUN_RADIUS * y[inside], SUN_RADIUS * z[inside]], axis=1)
    limb = np.arcsin(R / 7.0e6)
    for offset in np.array([-0.8, -0.4, 0.0, 0.3, 0.9]) * SUN_RADIUS / AU:
        position = np.asarray(behind(limb + offset))
        ray = points - position
        ray /= np.linalg.norm(ray, axis=1)[:, None]
        along = ray @ position
        clear = (along > 0) | (position @ position - along**2 > R**2)
        # A grid of 400 x 400 resolves the fraction to 1e-3; the flat-disk formula adds less than that.
        assert float(cone(jnp.asarray(position), jnp.asarray(SUN))) == pytest.approx(clear.mean(), abs=2e-3)


def test_umbra_full_light_and_annular_eclipse():
    assert float(cone(behind(0.0), jnp.asarray(SUN))) == 0.0
    assert float(cone(-behind(0.0), jnp.asarray(SUN))) == 1.0
    far = 2.0e9
    seen = float(cone(behind(0.0, far), jnp.asarray(SUN)))
    assert seen == pytest.approx(1 - (np.arcsin(R / far) / np.arcsin(SUN_RADIUS / (AU + far))) ** 2, rel=1e-12)


@pytest.mark.parametrize("contact", ["outer", "inner", "middle", "axis", "sunward"])
def test_gradients_are_finite_at_contact_and_match_differences(contact):
    limb, half_disk = np.arcsin(R / 7.0e6), np.arcsin(SUN_RADIUS / AU)
    angles = {"outer": limb + half_disk, "inner": limb - half_disk, "middle": limb, "axis": 0.0, "sunward": np.pi}
    position = behind(angles[contact])
    gradient, _ = cone_gradient(position, jnp.asarray(SUN))
    assert np.all(np.isfinite(gradient))
    step = 20.0
    moved = [float(cone(position + jnp.asarray([0.0, s, 0.0]), jnp.asarray(SUN))) for s in (-step, step)]
    largest = 2 / (np.pi * half_disk * 7.0e6)
    # At a contact the slope itself goes like a square root: 20 m of 65 km leave 2 % of its maximum.
    assert float(gradient[1]) == pytest.approx((moved[1] - moved[0]) / (2 * step), abs=0.03 * largest)


@pytest.mark.parametrize("a, b, c", [(1.0, 1.0, 1.0), (0.5, 1.0, 0.8), (1.0, 0.5, 1.2), (1.0, 0.5, 0.55)])
def test_lens_area_and_its_derivative(a, b, c):
    y = np.linspace(-1.0, 1.0, 200001)
    width = np.minimum(np.sqrt(np.maximum(a**2 - y**2, 0)), c + np.sqrt(np.maximum(b**2 - y**2, 0)))
    width -= np.maximum(-np.sqrt(np.maximum(a**2 - y**2, 0)), c - np.sqrt(np.maximum(b**2 - y**2, 0)))
    rows = np.where((np.abs(y) < a) & (np.abs(y) < b), np.maximum(width, 0), 0)
    arguments = [jnp.asarray(x) for x in (a, b, c)]
    assert float(area(*arguments)) == pytest.approx(np.trapezoid(rows, y), rel=1e-5)
    gradient = area_gradient(*arguments)
    for k in range(3):
        h = 1e-6
        ends = [area(*[x + s * (j == k) for j, x in enumerate(arguments)]) for s in (-h, h)]
        assert float(gradient[k]) == pytest.approx(float(ends[1] - ends[0]) / (2 * h), rel=1e-6)


def test_function_and_module_agree():
    position = behind(np.arcsin(R / 7.0e6))
    value = cone_illumination(position, jnp.asarray(SUN), AU, radius=R, sun_radius=SUN_RADIUS)
    assert float(value) == pytest.approx(float(cone(position, jnp.asarray(SUN))), rel=1e-12)
