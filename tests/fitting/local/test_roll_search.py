"""The local method against attitudes made with plain NumPy."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fitting.local.roll_search import field_aligned, roll_minima, search_roll
from fitting.local.shares import mirror_earth, mirror_light
from jaxsat.environment import LightTable
from jaxsat.spacecraft import SolarPanels, box_normals

quick = functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 0})
search, aligned = quick(search_roll), quick(field_aligned)
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


@pytest.mark.slow
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("albedo", [0.0, 0.4])
def test_roll_of_a_field_aligned_satellite_is_found(sign, albedo):
    rng = np.random.default_rng(7)
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
                np.asarray(aligned(jnp.asarray(field), jnp.asarray(roll), jnp.asarray(sign)))[[1, 2, 3, 0]]
            )
            for roll in (0.0, 0.7)
        ]
        for turn in turns:
            np.testing.assert_allclose(turn.apply([1.0, 0, 0]), sign * field / np.linalg.norm(field), atol=1e-14)
        np.testing.assert_allclose((turns[0].inv() * turns[1]).as_rotvec(), [0.7, 0, 0], atol=1e-14)


@pytest.mark.slow
def test_minima_end_at_the_exact_roll_and_tell_their_error():
    rng = np.random.default_rng(3)
    refine = quick(roll_minima)
    panels = SolarPanels(box_normals(), jnp.asarray(0.24), jnp.ones(6))
    for sign in (1.0, -1.0):
        field, across = unit(rng.normal(size=3)), unit(rng.normal(size=3))
        across = unit(across - (across @ field) * field)
        sun = unit(0.5 * field + across)
        mirror = unit(-0.4 * field - 0.3 * across + 0.8 * np.cross(field, across))
        y = unit(np.cross(rng.normal(size=3), field))
        true = Rotation.from_matrix(np.stack([sign * field, y, np.cross(sign * field, y)], axis=1))

        def currents(turn, axis=sign * field, sun=sun, mirror=mirror, true=true):
            normals = NORMALS @ (Rotation.from_rotvec(turn * axis) * true).as_matrix().T
            lit, back = np.maximum(normals @ sun, 0.0), np.maximum(normals @ mirror, 0.0)
            return 0.24 * lit, 0.24 * 0.7 * back

        light_there = mirror_light(light(sun, mirror, 0.7))
        measured = currents(0.0)[0] + 0.4 * currents(0.0)[1]
        field_there, limit = jnp.asarray(4e-5 * field), jnp.asarray(1.0)
        found = refine(jnp.asarray(measured), field_there, panels, mirror_earth(), light_there, limit)
        best = Rotation.from_quat(np.asarray(found.fit.quaternion)[0], scalar_first=True)
        # The last scan steps by 5 deg / 4^6.
        assert np.degrees((best.inv() * true).magnitude()) < 1.3e-3
        assert float(found.along[0]) == sign
        assert float(found.fit.albedo[0]) == pytest.approx(0.4, abs=1e-4)
        rms = np.asarray(found.fit.rms).tolist()
        assert rms == sorted(rms)
        # Slope of the residual by the roll, the part across the two patterns: what the factors cannot follow.
        h = 1e-6
        slope = sum((currents(h)[k] - currents(-h)[k]) * share for k, share in ((0, 1.0), (1, 0.4))) / (2 * h)
        pair = np.stack(currents(0.0), axis=1)
        across_both = slope - pair @ np.linalg.lstsq(pair, slope, rcond=None)[0]
        assert float(found.information[0]) == pytest.approx(across_both @ across_both, rel=1e-3)
