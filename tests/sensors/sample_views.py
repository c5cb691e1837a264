"""Views of any instants in NumPy and SciPy, and what every sensor is asked: slopes against differences."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from scipy.spatial.transform import Rotation

from jaxsat.environment import LightTable
from jaxsat.math import quaternion
from jaxsat.sensors import Albedo, View

COUNT, PATCHES = 60, 5
RNG = np.random.default_rng(21)
SPECULAR, DIFFUSE = 0.1, 0.35
FACES = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])


def directions(*shape):
    v = RNG.normal(size=(*shape, 3))
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


ATTITUDES = Rotation.random(COUNT, rng=RNG)
RATES = RNG.normal(scale=0.1, size=(COUNT, 3))
POSITIONS, VELOCITIES = 7e6 * directions(COUNT), 7.5e3 * directions(COUNT)
FIELDS = 4e-5 * directions(COUNT)
SUNS, LIT = directions(COUNT), np.where(RNG.random(COUNT) < 0.8, 1.0, RNG.uniform(0.2, 0.9, COUNT))
MIRRORS, MIRRORED = directions(COUNT), RNG.uniform(0.0, 0.3, COUNT)
PATCH_DIRECTIONS, PATCH_WEIGHTS = directions(COUNT, PATCHES), RNG.uniform(0.0, 0.2, (COUNT, PATCHES))
CURRENTS = {"i1": RNG.uniform(0.0, 0.5, COUNT), "i2": RNG.uniform(0.0, 0.5, COUNT)}


def body(vectors):
    """Body components of inertial vectors, one a view."""
    return ATTITUDES.inv().apply(vectors)


def view(motion, light, columns):
    """One view, of arrays in the order of the fields."""
    q, rate, time, position, velocity, field = motion
    albedo = Albedo(jnp.asarray(SPECULAR), jnp.asarray(DIFFUSE))
    return View(q, rate, time, position, velocity, field, light_of(*light), albedo, columns)


def light_of(sun, lit, mirror, mirrored, patches, weights):
    return LightTable(sun, lit, mirror, mirrored, patches, weights)


VIEWS = jax.jit(jax.vmap(view))(
    (ATTITUDES.as_quat(scalar_first=True), RATES, np.arange(COUNT, dtype=float), POSITIONS, VELOCITIES, FIELDS),
    (SUNS, LIT, MIRRORS, MIRRORED, PATCH_DIRECTIONS, PATCH_WEIGHTS),
    CURRENTS,
)


def view_of(attitude: Rotation, sun=(0.0, 0.0, 1.0), *, position=(7e6, 0.0, 0.0), illumination=1.0):
    """One view with the Sun alone for light."""
    zero, down = np.zeros(3), np.array([[0.0, 0.0, -1.0]])
    motion = attitude.as_quat(scalar_first=True), zero, np.zeros(()), np.asarray(position, float), zero, zero
    light = np.asarray(sun, float), np.asarray(illumination), down[0], np.zeros(()), down, np.zeros(1)
    return view(tuple(map(jnp.asarray, motion)), tuple(map(jnp.asarray, light)), {})


def readings(sensor):
    return np.asarray(_readings(sensor))


@eqx.filter_jit
def _readings(sensor):
    return jax.vmap(sensor)(VIEWS)


def told(sensor, read, sigma):
    """What a sensor says that readings say."""
    found = sensor.direct(read, sigma)
    assert found is not None
    return found


def earthlight(normals):
    """[views faces] of the Earth over the Sun square on, by the cosine of each ray from in front."""
    rays = np.einsum("vpk,fk->vpf", np.stack([body(d) for d in PATCH_DIRECTIONS.swapaxes(0, 1)], axis=1), normals)
    mirror = MIRRORED[:, None] * np.maximum(body(MIRRORS) @ normals.T, 0.0)
    return SPECULAR * mirror + DIFFUSE * np.sum(PATCH_WEIGHTS[..., None] * np.maximum(rays, 0.0), axis=1)


def turned(seen, rotation):
    """The view after a small turn of the satellite, body axes."""
    attitude = quaternion.multiply(seen.attitude, quaternion.from_rotation_vector(rotation))
    return dataclasses.replace(seen, attitude=attitude)


def slopes(sensor, seen, *, step=1e-6):
    """Derivatives by three small turns and all numbers of the sensor, in many views: forward, reverse, differences.

    A number is counted in its own size, which is how it is moved.
    """
    numbers = np.asarray(ravel_pytree(sensor)[0])
    size = np.maximum(np.abs(numbers), SMALL)
    at = np.concatenate([np.zeros(3), numbers / size])
    return tuple(np.asarray(found) for found in _all_three(sensor, at, size, seen, step))


@eqx.filter_jit
def _all_three(sensor, at, size, seen, step):
    """One program for all sensors of a kind and a shape."""
    whole = ravel_pytree(sensor)[1]

    def reading(x, seen):
        return whole(x[3:] * size)(turned(seen, x[:3]))

    def of_one(seen):
        ahead, behind = (jax.vmap(reading, (0, None))(at[None, :] + h * jnp.eye(len(at)), seen) for h in (step, -step))
        return jax.jacfwd(reading)(at, seen), jax.jacrev(reading)(at, seen), (ahead - behind).T / (2.0 * step)

    return jax.vmap(of_one)(seen)


def some(*numbers):
    """Views of these numbers."""
    return jax.tree.map(lambda x: x[np.array(numbers)], VIEWS)


SMALL = 1e-6
"""In which numbers that are zero are counted: microteslas and microradians."""
