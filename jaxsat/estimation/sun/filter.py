"""The Sun from noisy, quantised or missing readings: a bank of Kalman filters, one for each root that may be true.

Near 60 deg from the axis the two directions that explain the currents of two faces meet, and a reading says next to
nothing of where along their line the Sun stands; a single lit face says it of one line at all times. A candidate
taken as it is, as by `sun_tracker`, carries that error along. Here each hypothesis has a covariance, so that what the
currents do not see comes from the gyro, and its squared innovations tell it from the others.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxsat.estimation.sun.candidates import CANDIDATES, Candidates
from jaxsat.estimation.sun.tracker import small_turn
from jaxsat.math import cross, unit
from jaxsat.sensors.sun_sensor import PyramidSunSensor, lit_fraction

FORGETTING = 0.97
"""What is left of the sum of squared innovations at each new sample."""
LOST = 200.0
"""Sum of squared innovations of the best hypothesis from which all begin anew: six and more of each sample."""
BEHIND = 25.0
"""What a hypothesis begins with over the best one."""
APART, MERGED = 0.1, 0.01
"""Distance [rad] from all others at which a candidate becomes a hypothesis, and that of two which are one."""
SPREAD = 0.3
"""1-sigma of a new hypothesis before its first reading [rad]."""


class SunFilter(eqx.Module):
    """What is believed of the Sun."""

    direction: Float[Array, "3 3"]
    """[hypothesis axis] unit vectors in instrument axes."""
    beside: Float[Array, "3 3"]
    """[hypothesis axis] unit vectors across the directions; the third axis is direction x beside."""
    covariance: Float[Array, "3 2 2"]
    """Of each direction along `beside` and the third axis [rad^2]."""
    cost: Float[Array, "3"]
    """Fading sum of squared innovations over their variances; inf for none."""

    def best(self) -> Float[Array, "3"]:
        """The direction of the least cost; of equal ones the first."""
        return _chosen(_least(self.cost), self.direction)

    def known(self) -> Bool[Array, ""]:
        """Whether the Sun has been seen at all."""
        return jnp.any(self.cost < jnp.inf)

    def sigma(self) -> Float[Array, ""]:
        """1-sigma of `best` in its worse direction, at most [rad]."""
        return jnp.sqrt(jnp.trace(_chosen(_least(self.cost), self.covariance)))


def blank_filter() -> SunFilter:
    """Nothing is known yet."""
    axes = jnp.tile(jnp.eye(3), (CANDIDATES, 1, 1))
    return SunFilter(axes[:, 0], axes[:, 1], jnp.zeros((CANDIDATES, 2, 2)), jnp.full(CANDIDATES, jnp.inf, float))


def predicted(belief: SunFilter, turn: Float[Array, "3"], sigma: float | Float[Array, ""]) -> SunFilter:
    """The belief after the instrument has turned by the small vector `turn` [rad], of 1-sigma `sigma` [rad] an axis."""
    both = small_turn(jnp.concatenate([belief.direction, belief.beside]), turn)
    return SunFilter(both[:3], both[3:], belief.covariance + sigma**2 * jnp.eye(2)[None], belief.cost)


def corrected(
    belief: SunFilter,
    sensor: PyramidSunSensor,
    currents: Float[Array, "4"],
    candidates: Candidates,
    *,
    sigma: Float[Array, "4"],
    alive: Bool[Array, "4"],
    threshold: float | Float[Array, ""],
) -> SunFilter:
    """The belief, `predicted` for this instant, with its currents [A] of 1-sigma `sigma` [A].

    `candidates` are what the same currents leave possible: a hypothesis that nobody has is taken up. Faces that are not
    `alive` say nothing; currents up to `threshold` [A] count as none.
    """
    i, variance = currents / sensor.max_current, (sigma / sensor.max_current) ** 2
    lit = (currents > threshold) & alive
    directions, besides, covariances, costs = [], [], [], []
    for k in range(CANDIDATES):
        frame = belief.direction[k], belief.beside[k], belief.covariance[k]
        *frame, square = _by_faces(sensor, *frame, i, lit, alive, variance)
        for found, one in zip((directions, besides, covariances), frame, strict=True):
            found.append(one)
        costs.append(FORGETTING * belief.cost[k] + square)
    direction, beside, covariance, cost = jax.lax.optimization_barrier(
        tuple(map(jnp.stack, (directions, besides, covariances, costs)))
    )

    # The hypothesis that has fallen farthest behind gives way to a candidate that nobody follows.
    least = jnp.min(cost)
    fresh = candidates.direction
    near = jnp.sum((fresh[:, None] - direction[None]) ** 2, axis=2) < APART**2
    alone = candidates.possible & ~jnp.any(near & (cost < jnp.inf)[None], axis=1)
    taken = _least(-cost) & jnp.any(alone) & (cost > least + BEHIND)
    direction = jnp.where(taken[:, None], _chosen(_first(alone), fresh), direction)
    cost = jnp.where(taken, least + BEHIND, cost)
    # Of two that have met, the better one is enough.
    for k, other in ((0, 1), (0, 2), (1, 2)):
        met = jnp.sum((direction[k] - direction[other]) ** 2) < MERGED**2
        gone = jnp.where(cost[k] <= cost[other], jnp.arange(3) == other, jnp.arange(3) == k)
        cost = jnp.where(met & gone, jnp.inf, cost)

    anew = ~(least < LOST)
    direction = jnp.where(anew, fresh, direction)
    cost = jnp.where(anew, jnp.where(candidates.possible, 0.0, jnp.inf), cost)
    new = anew | taken
    beside = jnp.where(new[:, None], _beside(direction), beside)
    covariance = jnp.where(new[:, None, None], SPREAD**2 * jnp.eye(2)[None], covariance)
    after = SunFilter(direction, beside, covariance, cost)
    return jax.tree.map(lambda new, old: jnp.where(jnp.any(lit), new, old), after, belief)


def _by_faces(sensor, direction, beside, P, i, lit, alive, variance):
    """Direction, the one beside it, covariance and squared innovation after the relative currents `i`, face by face.

    A face that is dark corrects a direction only where that should light it, and then to the angle of total reflection.
    """
    third = cross(direction, beside)
    normals, edge = sensor.normals(), jnp.cos(sensor.cutoff_angle)
    share, rise = jax.jvp(lambda x: lit_fraction(sensor, x), (direction[0],), (jnp.ones_like(direction[0]),))
    cosine = normals @ direction
    axes = jnp.stack([beside, third], axis=1)
    slopes = share * (normals @ axes) + rise * jnp.outer(cosine, axes[0])
    slopes, cosine, share = jax.lax.optimization_barrier((slopes, cosine, share))
    step, square = jnp.zeros_like(direction, shape=2), jnp.zeros_like(share)
    for face in range(4):
        slope = slopes[face]
        expected = share * cosine[face] + slope @ step
        off = jnp.where(lit[face], i[face] - expected, jnp.minimum(share * edge - expected, 0.0))
        says = alive[face] & (lit[face] | (off < 0.0))
        seen = P @ slope
        inverse = jnp.where(says, 1.0 / (slope @ seen + variance[face]), 0.0)
        step = step + seen * (inverse * off)
        P = P - jnp.outer(inverse * seen, seen)
        square = square + inverse * off**2
        step, P, square = jax.lax.optimization_barrier((step, P, square))
    after = unit(direction + axes @ step)
    return after, unit(beside - (beside @ after) * after), P, square


def _beside(directions):
    """Unit vectors across directions [3 3], none of which is -x."""
    x, y, z = directions.T
    down = y / (1.0 + x)
    return jnp.stack([-y, 1.0 - y * down, -z * down], axis=1)


def _first(mask):
    """The first of three that are true, alone."""
    return jnp.stack([mask[0], mask[1] & ~mask[0], mask[2] & ~mask[0] & ~mask[1]])


def _least(values):
    """Where the least of three values is; of equal ones the first."""
    return _first(values <= jnp.min(values))


def _chosen(one, arrays):
    """That of three arrays for which `one` is true; the last where it is for none."""
    return jnp.where(one[0], arrays[0], jnp.where(one[1], arrays[1], arrays[2]))
