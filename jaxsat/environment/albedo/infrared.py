"""Infrared brightness of the Earth: a random field over the globe, tabulated once and read by bilinear interpolation.

Variations fall off as exp(-L / R_B) with the distance L on the ground, R_B = 700 km and 15 % (Melnikov et al. 2022).
"""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.constants import EARTH_RADIUS_MEAN

CORRELATION_RADIUS = 700e3
"""At which the correlation of the brightness has fallen to 1/e [m]."""
MEAN_BRIGHTNESS, MIN_BRIGHTNESS = 60.0, 25.0
"""6 and 2.5 mW/(cm^2 sr) [W/(m^2 sr)]."""
VARIATION = 0.15
"""1-sigma of the brightness over its mean."""
CELLS = 256
"""Of the table along each side of the square: about 0.7 deg or 78 km."""
_WAVES = 500


class BrightnessMap(eqx.Module):
    """Relative departure of the brightness from its mean over the globe, Earth-fixed, of 1-sigma one."""

    table: Float[Array, "nodes"]
    """At the nodes of the octahedral square, row by row."""

    def __call__(self, ground_ecef: Float[Array, "points 3"]) -> Float[Array, "points"]:
        """Return the departure in directions from the Earth's centre, bilinear between nodes."""
        u, v = _square(ground_ecef)
        column, right = _cell(u)
        row, up = _cell(v)
        first, step = row * (CELLS + 1) + column, CELLS + 1
        a, b, c, d = (self._read(first + k) for k in (0, 1, step, step + 1))
        below = a + right * (b - a)
        return below + up * (c + right * (d - c) - below)

    def nearest(self, ground_ecef: Float[Array, "points 3"]) -> Float[Array, "points"]:
        """Return the departure at the nearest nodes: a third of the time, for loops over many cases."""
        u, v = _square(ground_ecef)
        column, row = (jnp.floor(0.5 * CELLS * (x + 1.0) + 0.5).astype(jnp.int32) for x in (u, v))
        return self._read(row * (CELLS + 1) + column)

    def _read(self, number):
        # Held: the table is not to be read anew for each use of a value.
        hold = jax.lax.optimization_barrier
        return hold(self.table.at[hold(number)].get(mode="promise_in_bounds"))


def _square(direction):
    """Coordinates in [-1, 1] on the octahedron |x| + |y| + |z| = 1 unfolded into a square."""
    x, y, z = direction[:, 0], direction[:, 1], direction[:, 2]
    size = jnp.abs(x) + jnp.abs(y) + jnp.abs(z)
    u, v = x / size, y / size
    folded_u = jnp.where(u < 0.0, -1.0, 1.0) * (1.0 - jnp.abs(v))
    folded_v = jnp.where(v < 0.0, -1.0, 1.0) * (1.0 - jnp.abs(u))
    south = z < 0.0
    return jnp.where(south, folded_u, u), jnp.where(south, folded_v, v)


def _cell(u):
    """Number of the cell of a coordinate in [-1, 1], and the place within it."""
    place = (0.5 * CELLS) * (u + 1.0)
    number = jnp.clip(jnp.floor(place), 0.0, CELLS - 1.0)
    return number.astype(jnp.int32), place - number


@functools.cache
def random_brightness(seed: int = 0, correlation_radius: float = CORRELATION_RADIUS) -> BrightnessMap:
    """Return one draw of the field: a sum of waves whose spectrum is that of the exponential correlation.

    Wave vectors are of the three-dimensional Cauchy distribution, the Fourier transform of exp(-|d| / R_B) (random
    features: Rahimi & Recht 2007); distances are chords of the globe, 0.1 % short of the arc at 700 km.
    """
    generator = np.random.default_rng(seed)
    waves = generator.normal(size=(_WAVES, 3)) / np.abs(generator.normal(size=(_WAVES, 1)))
    waves *= EARTH_RADIUS_MEAN / correlation_radius
    phases = generator.uniform(0.0, 2.0 * np.pi, _WAVES)
    nodes = octahedral_nodes()
    table = np.empty(len(nodes))
    # In pieces: all phases at once would take 70 MB.
    for begin in range(0, len(nodes), 2048):
        part = nodes[begin : begin + 2048]
        table[begin : begin + 2048] = np.sqrt(2.0 / _WAVES) * np.cos(part @ waves.T + phases).sum(axis=1)
    return BrightnessMap(jnp.asarray(table))


def octahedral_nodes() -> Float[np.ndarray, "nodes 3"]:
    """Return the directions of the table's nodes: those of a square of `CELLS` cells a side."""
    u, v = np.meshgrid(*[np.linspace(-1.0, 1.0, CELLS + 1)] * 2)
    z = 1.0 - np.abs(u) - np.abs(v)
    south = z < 0.0
    x = np.where(south, np.where(u < 0.0, -1.0, 1.0) * (1.0 - np.abs(v)), u)
    y = np.where(south, np.where(v < 0.0, -1.0, 1.0) * (1.0 - np.abs(u)), v)
    nodes = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    return nodes / np.linalg.norm(nodes, axis=1)[:, None]
