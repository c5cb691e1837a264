"""A motion that is known beforehand: quaternions of a table, or axes fixed to the orbital frame."""

import numpy as np
from jaxtyping import Array, Float
from scipy.spatial.transform import Rotation

from jaxsat.environment import AbstractOrbit
from jaxsat.satellites.satellite import Satellite
from jaxsat.telemetry.table.axes import without_leaps
from jaxsat.telemetry.table.orbit import MARGIN_S
from jaxsat.telemetry.table.session import TableSession

_STEP_S = 10.0


def motion_for(
    satellite: Satellite, session: TableSession, orbit: AbstractOrbit
) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n 4"]] | None:
    """Times [s] and quaternions, inertial from body, where the motion is known beforehand; None where it is free."""
    if satellite.motion.kind != "orbital":
        return session.motion
    first, last = session.span_s
    return orbital_motion(orbit, start=first - MARGIN_S, stop=last + MARGIN_S)


def orbital_motion(
    orbit: AbstractOrbit, *, start: float, stop: float
) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n 4"]]:
    """Times [s] and quaternions, inertial from body, of a body fixed to the orbital frame, every 10 s or less.

    Body axes: z to the Earth's centre, y against the orbit's normal, x along the motion (in a circular orbit along the
    velocity): the local vertical, local horizontal of stations and Earth watchers. Sensors turned in them have `turn`
    or `axes` of their own.
    """
    import jax
    import jax.numpy as jnp

    times = np.linspace(start, stop, max(int(np.ceil((stop - start) / _STEP_S)), 1) + 1)
    position, velocity = (np.asarray(each) for each in jax.vmap(orbit)(jnp.asarray(times)))
    return times, orbital_attitude(position, velocity)


def orbital_attitude(
    position: Float[np.ndarray | Array, "n 3"], velocity: Float[np.ndarray | Array, "n 3"]
) -> Float[np.ndarray, "n 4"]:
    """Quaternions, inertial from body, of `orbital_motion` at states."""
    down = -np.asarray(position) / np.linalg.norm(position, axis=1, keepdims=True)
    normal = np.cross(position, velocity)
    across = -normal / np.linalg.norm(normal, axis=1, keepdims=True)
    axes = np.stack([np.cross(across, down), across, down], axis=2)
    return without_leaps(np.roll(Rotation.from_matrix(axes).as_quat(), 1, axis=1))
