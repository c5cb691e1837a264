"""The local method against attitudes made with plain NumPy."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fitting.local.roll_search import roll_minima
from fitting.local.shares import mirror_earth, mirror_light
from jaxsat.environment import LightTable
from jaxsat.spacecraft import SolarPanels, box_normals

quick = functools.partial(jax.jit, compiler_options={"xla_backend_optimization_level": 0})
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
        found = refine(
            jnp.asarray(measured), field_there, panels, mirror_earth(), light_there, limit, jnp.array([1.0, 0.0, 0.0])
        )
        best = Rotation.from_quat(np.asarray(found.fit.quaternion)[0], scalar_first=True)
        # The last scan steps by 5 deg / 4^6.
        assert np.degrees((best.inv() * true).magnitude()) < 1.3e-3
        assert float(found.along[0]) == sign
        assert float(found.fit.albedo[0]) == pytest.approx(0.4, abs=1e-4)
        rms = np.asarray(found.fit.rms).tolist()
        assert rms == sorted(rms)
        # Slope of the residual by the roll, the part across the two patterns: what the factors cannot follow.
        h = 1e-6
        pair = np.stack(currents(0.0), axis=1)
        for axis, slope_there in zip(true.as_matrix().T, np.asarray(found.slopes)[0].T, strict=True):
            ends = currents(h, axis), currents(-h, axis)
            slope = sum((ends[0][k] - ends[1][k]) * share for k, share in ((0, 1.0), (1, 0.4))) / (2 * h)
            across_both = slope - pair @ np.linalg.lstsq(pair, slope, rcond=None)[0]
            np.testing.assert_allclose(slope_there, across_both, atol=1e-3 * float(np.linalg.norm(slope)))
