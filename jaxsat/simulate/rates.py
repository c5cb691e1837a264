"""How fast a motion goes: what the length of its steps follows."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import OrbitTable
from jaxsat.spacecraft import Spacecraft

ROUND_MU = 4.0e14
"""The Earth's gravitational parameter [m^3/s^2], rounded: what it enters is a scale of rates."""


def fastest_rate(spacecraft: Spacecraft, initial: AttitudeState, table: OrbitTable) -> Float[Array, ""]:
    """Rate scale of the coming motion [rad/s]: root of the squares of spin, swing in the field and orbital rate."""
    smallest = jnp.linalg.eigvalsh(spacecraft.inertia)[0]
    # Over an orbit the field grows to twice what it is at the start, or falls.
    pull = squared_pull(spacecraft, smallest, 2.0 * table.b_field_eci[0], table.position_eci[0])
    return jnp.sqrt(jnp.sum(initial.angular_velocity**2) + pull)


def squared_pull(
    spacecraft: Spacecraft, smallest: Float[Array, ""], b_field: Float[Array, "3"], position: Float[Array, "3"]
) -> Float[Array, ""]:
    """Square of the rate of swinging in a field [T] at a place [m], and of the orbital one [1/s^2].

    A dipole m in a field B swings at sqrt(m B / J), `smallest` of the moments of inertia; a satellite turns about the
    vertical at the orbit's own rate.
    """
    r, b = (jnp.sqrt(jnp.sum(x**2)) for x in (position, b_field))
    magnet = 0.0 if spacecraft.magnet is None else jnp.sqrt(jnp.sum(spacecraft.magnet**2))
    rods = 0.0 if spacecraft.rods is None else jnp.sum(jnp.abs(spacecraft.rods.moments))
    return (magnet + rods) * b / smallest + ROUND_MU / r**3
