"""Sunlight that the Earth scatters onto the faces of a satellite, by a sum over the directions in which it sees her.

A Lambert sphere of reflectivity a shines with a/pi times the cosine of the Sun's height, in units of the sunlight; a
face gathers it over the solid angle of the Earth's disk, weighed with the cosine on the face.
"""

import numpy as np
from numpy.typing import NDArray

from experiments.twins.world import EARTH_RADIUS

Array = NDArray[np.float64]

RINGS, SECTORS = 40, 80
"""Directions from nadir to the limb, and around it: the largest sum is good to 1e-4 of itself."""


def directions(radius: float) -> tuple[Array, Array, Array]:
    """Directions in axes whose third one is up [n 3], their solid angles [n], and the ground's normals there [n 3]."""
    limb = np.sqrt(1.0 - (EARTH_RADIUS / radius) ** 2)
    nodes, weights = np.polynomial.legendre.leggauss(RINGS)
    down = 0.5 * (1.0 + limb) + 0.5 * (1.0 - limb) * nodes
    around = 2.0 * np.pi * (np.arange(SECTORS) + 0.5) / SECTORS
    side = np.sqrt(1.0 - down * down)
    look = np.stack(
        [np.outer(side, np.cos(around)), np.outer(side, np.sin(around)), np.outer(-down, np.ones(SECTORS))], axis=-1
    ).reshape(-1, 3)
    solid = np.repeat(0.5 * (1.0 - limb) * weights * 2.0 * np.pi / SECTORS, SECTORS)
    reach = radius * down - np.sqrt(np.maximum(EARTH_RADIUS**2 - (radius * side) ** 2, 0.0))
    ground = (np.array([0.0, 0.0, radius]) + np.repeat(reach, SECTORS)[:, None] * look) / EARTH_RADIUS
    return look, solid, ground


def earthlight(position: Array, sun: Array, normals: Array) -> Array:
    """Scattered light on faces over sunlight square on, for a reflectivity of one.

    `position` [3] m, `sun` [3] unit vector, `normals` [faces 3], all in one set of axes. Answers [faces].
    """
    radius = float(np.linalg.norm(position))
    up = position / radius
    first = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    first /= np.linalg.norm(first)
    axes = np.stack([first, np.cross(up, first), up])
    look, solid, ground = directions(radius)
    radiance = solid * np.maximum(ground @ (axes @ sun), 0.0) / np.pi
    return radiance @ np.maximum(look @ (axes @ normals.T), 0.0)
