"""The Sun followed through ambiguous readings: every candidate is carried along by the gyro until the others fall away.

A wrong root moves otherwise than the satellite turns, and is left behind within degrees of motion. What is known is
kept where no face is lit, so that a Sun once seen is found again without a search.
"""

import equinox as eqx
import jax.numpy as jnp
from jax import lax
from jaxtyping import Array, Bool, Float

from jaxsat.estimation.sun.candidates import CANDIDATES, Candidates
from jaxsat.math import cross, unit

FORGETTING = 0.98
"""What is left of the mismatches so far at each new sample."""
LOST = 0.12
"""Mean mismatch [rad] of the best candidate beyond which all begin anew."""


class SunTrack(eqx.Module):
    """What is believed of the Sun."""

    direction: Float[Array, "3 3"]
    """[candidate axis] unit vectors in instrument axes."""
    mismatch: Float[Array, "3"]
    """Mean square of the angles [rad^2] by which samples missed a candidate; inf for none."""

    def best(self) -> Float[Array, "3"]:
        """The candidate that moved most like the satellite; of equal ones the nearest to the axis."""
        first = (self.mismatch[0] <= self.mismatch[1]) & (self.mismatch[0] <= self.mismatch[2])
        second = self.mismatch[1] <= self.mismatch[2]
        return jnp.where(first, self.direction[0], jnp.where(second, self.direction[1], self.direction[2]))

    def known(self) -> Bool[Array, ""]:
        """Whether the Sun has been seen at all."""
        return jnp.any(self.mismatch < jnp.inf)


def blank_track() -> SunTrack:
    """Nothing is known yet."""
    return SunTrack(jnp.tile(jnp.array([1.0, 0.0, 0.0]), (CANDIDATES, 1)), jnp.full(CANDIDATES, jnp.inf, float))


def carried(track: SunTrack, turn: Float[Array, "3"]) -> SunTrack:
    """The track after the instrument has turned by the small vector `turn` [rad], in its own axes."""
    return SunTrack(small_turn(track.direction, turn), track.mismatch)


def small_turn(directions: Float[Array, "any 3"], turn: Float[Array, "3"]) -> Float[Array, "any 3"]:
    """Directions seen from an instrument that has turned by the small vector `turn` [rad], in its own axes."""
    # By the quaternion (1, -turn / 2), but for its length: a rotation, by the turn less a twelfth of its cube.
    half = 0.5 * turn
    share = 2.0 / (1.0 + jnp.sum(half**2))
    moved = []
    for v in directions:
        across = cross(half, v)
        moved.append(v + share * (cross(half, across) - across))
    return jnp.stack(moved)


def followed(track: SunTrack, candidates: Candidates, *, gain: float | Float[Array, ""] = 1.0) -> SunTrack:
    """The track, `carried` to this instant, with what its currents leave possible.

    `gain` is the share of the candidate in the new direction, the rest being that of the gyro: 1 for a sensor without
    noise.
    """
    directions, mismatches = [], []
    for k in range(CANDIDATES):
        expected = track.direction[k]
        off = jnp.sum((candidates.direction - expected[None]) ** 2, axis=1)
        off = lax.optimization_barrier(jnp.where(candidates.possible, off, jnp.inf))
        square, nearest = jnp.asarray(jnp.inf, expected.dtype), expected
        for n in range(CANDIDATES):
            closer = off[n] < square
            square, nearest = jnp.where(closer, off[n], square), jnp.where(closer, candidates.direction[n], nearest)
        whole = isinstance(gain, float) and gain == 1.0
        directions.append(nearest if whole else unit(expected + gain * (nearest - expected)))
        mismatches.append(FORGETTING * track.mismatch[k] + (1.0 - FORGETTING) * square)
    directions, mismatches = lax.optimization_barrier((directions, mismatches))
    best = jnp.minimum(jnp.minimum(mismatches[0], mismatches[1]), mismatches[2])
    seen, anew = candidates.lit > 0, best > LOST**2
    fresh = [jnp.where(candidates.possible[k], 0.0, jnp.inf) for k in range(CANDIDATES)]
    found, missed = [], []
    for k in range(CANDIDATES):
        found.append(jnp.where(anew, candidates.direction[k], directions[k]))
        missed.append(jnp.where(anew, fresh[k], mismatches[k]))
    return SunTrack(
        jnp.where(seen, jnp.stack(found), track.direction), jnp.where(seen, jnp.stack(missed), track.mismatch)
    )
