"""The local method against attitudes made with plain NumPy, and its bounded factors against SciPy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

from fitting.local.roll_search import bounded_factors, field_aligned, search_roll
from jaxsat.environment import LightTable
from jaxsat.spacecraft import SolarPanels, box_normals

NORMALS = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])


def unit(v):
    return v / np.linalg.norm(v)


def light(sun, mirror, factor):
    return LightTable(
        sun_eci=jnp.asarray(sun),
        illumination=jnp.asarray(1.0),
        specular_direction_eci=jnp.asarray(mirror),
        specular_factor=jnp.asarray(factor),
        diffuse_direction_eci=jnp.asarray(mirror[None]),
        diffuse_weight=jnp.zeros(1),
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("albedo", [0.0, 0.4])
def test_roll_of_a_field_aligned_satellite_is_found(sign, albedo):
    rng = np.random.default_rng(7)
    search = jax.jit(search_roll)
    panels = SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6))
    for _ in range(5):
        # Sun and mirror image well away from the field: along it every roll would look the same.
        field, across = unit(rng.normal(size=3)), unit(rng.normal(size=3))
        across = unit(across - (across @ field) * field)
        sun = unit(0.5 * field + across)
        mirror = unit(-0.4 * field - 0.3 * across + 0.8 * np.cross(field, across))
        y = unit(np.cross(rng.normal(size=3), field))
        dcm_eci_from_body = np.stack([sign * field, y, np.cross(sign * field, y)], axis=1)
        normals = NORMALS @ dcm_eci_from_body.T
        factor = 0.7
        currents = 0.24 * (np.maximum(normals @ sun, 0.0) + albedo * factor * np.maximum(normals @ mirror, 0.0))
        found = search(
            jnp.asarray(currents), jnp.asarray(4e-5 * field), panels, light(sun, mirror, factor), jnp.asarray(1.0)
        )
        best = Rotation.from_quat(np.asarray(found.quaternion)[0, [1, 2, 3, 0]])
        off = best.inv() * Rotation.from_matrix(dcm_eci_from_body)
        # Steps of 4 deg: 2 deg off at most, half as much again for the albedo's freedom to lean towards one side.
        assert np.degrees(off.magnitude()) < 3.0
        np.testing.assert_allclose(best.apply([1.0, 0.0, 0.0]), sign * field, atol=1e-12)
        # 2 deg of a panel's slope: 0.24 A sin(2 deg) = 8 mA.
        rms = np.asarray(found.rms).tolist()
        assert rms[0] < 8e-3 and rms == sorted(rms)
        assert float(found.direct[0]) == pytest.approx(1.0, abs=0.1)
        assert float(found.albedo[0]) == pytest.approx(albedo, abs=0.1)


@pytest.mark.parametrize("field", [*np.eye(3), [0.2, -3.0, 0.1]])
def test_field_aligned_attitudes_turn_evenly_about_the_field(field):
    field = 1e-5 * np.asarray(field)
    for sign in (1.0, -1.0):
        turns = [
            Rotation.from_quat(
                np.asarray(field_aligned(jnp.asarray(field), jnp.asarray(roll), jnp.asarray(sign)))[[1, 2, 3, 0]]
            )
            for roll in (0.0, 0.7)
        ]
        for turn in turns:
            np.testing.assert_allclose(turn.apply([1.0, 0, 0]), sign * field / np.linalg.norm(field), atol=1e-14)
        np.testing.assert_allclose((turns[0].inv() * turns[1]).as_rotvec(), [0.7, 0, 0], atol=1e-14)


def test_bounded_factors_are_the_least_squares_under_the_bound():
    rng = np.random.default_rng(2)
    solve = jax.jit(bounded_factors)
    edges = set()
    for _ in range(300):
        direct = np.maximum(rng.normal(size=6), 0.0) + 1e-3
        albedo = np.maximum(rng.normal(size=6), 0.0)
        limit = rng.uniform(0.2, 1.5)
        measured = rng.uniform(0, 2) * direct + rng.normal() * albedo + 0.3 * rng.normal(size=6)
        found = [float(k) for k in solve(*(jnp.asarray(v) for v in (direct, albedo, measured)), jnp.asarray(limit))]
        # The cone 0 <= albedo <= limit * direct is spanned by its edges (1, 0) and (1, limit) with factors >= 0.
        (low, high), _ = nnls(np.stack([direct, direct + limit * albedo], axis=1), measured)
        np.testing.assert_allclose(found, [low + high, limit * high], atol=1e-9)
        edges.add((low > 0, high > 0))
    assert len(edges) >= 3, "the cases must reach the inside and both edges"


@pytest.mark.parametrize("albedo", [np.zeros(6), np.arange(1.0, 7.0)], ids=["no albedo", "parallel patterns"])
def test_bounded_factors_of_patterns_that_cannot_be_told_apart(albedo):
    direct = np.arange(1.0, 7.0)
    a, b = bounded_factors(jnp.asarray(direct), jnp.asarray(albedo), jnp.asarray(2.0 * direct), jnp.asarray(0.5))
    np.testing.assert_allclose(float(a) * direct + float(b) * albedo, 2.0 * direct, rtol=1e-12)
    assert 0.0 <= float(b) <= 0.5 * float(a) + 1e-12


def test_bounded_factors_in_the_dark_are_finite():
    dark = jnp.zeros(6)
    assert [float(k) for k in bounded_factors(dark, dark, dark, jnp.asarray(1.0))] == [0.0, 0.0]
