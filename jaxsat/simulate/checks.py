"""What `simulate` and `simulate_many` can be asked for: one place that says in words why not."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, PyTree

from jaxsat.dynamics import AttitudeState
from jaxsat.environment import OrbitTable
from jaxsat.environment.surroundings import Surroundings
from jaxsat.physical import check_inertia, is_attitude, is_of_a_body, unit_quaternion
from jaxsat.spacecraft import Spacecraft


def check_tolerance(tolerance: float, caller: str) -> None:
    """Raise ValueError unless an attitude may be wrong by so much [rad]."""
    if not 0.0 < tolerance < 1.0:
        raise ValueError(f"{caller}: tolerance must be between 0 and 1 rad, got {tolerance}")


def check_times(times: object, start: float, caller: str) -> np.ndarray:
    """The times [s] as a vector; ValueError unless they and the start are finite numbers."""
    found = np.asarray(times, float)
    if found.ndim != 1 or not np.isfinite(found).all():
        raise ValueError(f"{caller}: times must be a vector of finite numbers [s], got {found} of shape {found.shape}")
    if not np.isfinite(start):
        raise ValueError(f"{caller}: start must be a finite number [s], got {start}")
    return found


def check_shapes(spacecraft: Spacecraft, initial: AttitudeState, cases: tuple[int, ...], caller: str) -> None:
    """Raise ValueError unless state and inertia are of one case, or of so many."""
    for name, got, wanted in (
        ("initial.quaternion", initial.quaternion, ((*cases, 4),)),
        ("initial.angular_velocity", initial.angular_velocity, ((*cases, 3),)),
        ("spacecraft.inertia", spacecraft.inertia, ((3, 3), (*cases, 3, 3))),
    ):
        if np.shape(got) not in wanted:
            expected = " or ".join(map(str, dict.fromkeys(wanted)))
            raise ValueError(f"{caller}: {name} must have the shape {expected}, got {np.shape(got)}")


SINGLE_TOLERANCE = 1e-3
"""Of attitudes [rad]: no tighter one is held in single precision through more than some minutes of a tumble."""


def check_precision(initial: AttitudeState, tolerance: float, caller: str) -> None:
    """Raise ValueError where states are in single precision and the caller does not say that errors may be large.

    A tumble magnifies what is wrong at its start: of 10 000 over 4500 s the roundings of a float32 state alone, moved
    in float64, grow to 1e-2 rad in the worst, so that no method can keep 1e-4; the method's own come to more than 1
    (`experiments/benchmarks/precision.py`).
    """
    single = np.finfo(initial.quaternion.dtype).eps > np.finfo(np.float64).eps
    if single and not tolerance >= SINGLE_TOLERANCE:
        raise ValueError(
            f"{caller}: the initial states are {initial.quaternion.dtype}, of which a tumble magnifies the roundings "
            "up to wrong attitudes: give them in float64 (jax.config.update('jax_enable_x64', True)), or, where rough "
            f"attitudes will do, a tolerance of {SINGLE_TOLERANCE:g} rad or more, got {tolerance:g}"
        )


def check_satellite(spacecraft: Spacecraft, caller: str) -> None:
    """Raise ValueError where the inertia is that of no body, or where a number of the satellite is NaN."""
    try:
        check_inertia(np.asarray(spacecraft.inertia))
    except ValueError as error:
        raise ValueError(f"{caller}: spacecraft.inertia: {error}") from None
    check_numbers(spacecraft, f"{caller}: spacecraft")


def check_numbers(tree: PyTree, what: str) -> None:
    """Raise ValueError naming the array that holds NaN."""
    _refuse(tree, lambda leaf: np.isnan(leaf).any(), what, "is not a number")


def check_surroundings(surroundings: object, start: float, times: np.ndarray, caller: str) -> None:
    """Raise ValueError where orbit or Sun are not known at all the times [s]."""
    if isinstance(surroundings, Surroundings):
        ends = np.array([start, times[0], times[-1]]) if len(times) else np.array([start])
        for name in ("orbit", "sun"):
            path = getattr(surroundings, name)
            if path is not None:
                _said_by(path.check_span, ends, f"{caller}: surroundings.{name}")


def check_table(table: OrbitTable, caller: str) -> None:
    """Raise ValueError naming what of the surroundings is not finite."""
    known = dataclasses.replace(table, commands=None)
    _refuse(known, lambda leaf: not np.isfinite(leaf).all(), f"{caller}: surroundings, table", "is not finite")


def in_unit_length(initial: AttitudeState, caller: str) -> AttitudeState:
    """The state with a quaternion of length one; ValueError where it is none or the state is not finite."""
    if not all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(initial)):
        raise ValueError(f"{caller}: the initial state is not finite: {_told(initial)}")
    if not is_attitude(np.asarray(initial.quaternion)):
        raise ValueError(f"{caller}: the initial quaternion is zero, which is no attitude")
    return with_unit_length(initial)


def with_unit_length(initial: AttitudeState) -> AttitudeState:
    """States with quaternions of length one; those to the bit that are."""
    return dataclasses.replace(initial, quaternion=jnp.asarray(unit_quaternion(np.asarray(initial.quaternion))))


def sound_cases(spacecraft: Spacecraft, initial: AttitudeState, *, satellite_varies: bool) -> Bool[np.ndarray, "cases"]:
    """Whether each case has a finite state, an attitude and, where the satellites differ, one that can be."""
    sound = is_attitude(np.asarray(initial.quaternion))
    cases = sound.shape[0]
    for leaf in jax.tree.leaves(initial):
        sound &= np.isfinite(leaf).reshape(cases, -1).all(axis=1)
    if satellite_varies:
        sound &= is_of_a_body(np.asarray(spacecraft.inertia))
        for leaf in jax.tree.leaves(eqx.filter(spacecraft, eqx.is_inexact_array)):
            sound &= ~np.isnan(leaf).reshape(cases, -1).any(axis=1)
    return sound


def is_known(spacecraft: Spacecraft, initial: AttitudeState) -> Bool[Array, ""]:
    """As `sound_cases`, of one case and without its inertia, where numbers are traced."""
    numbers = jax.tree.leaves(eqx.filter(spacecraft, eqx.is_inexact_array))
    known = [jnp.any(initial.quaternion != 0.0)]
    known += [jnp.all(jnp.isfinite(leaf)) for leaf in jax.tree.leaves(initial)]
    known += [~jnp.any(jnp.isnan(leaf)) for leaf in numbers]
    return jnp.all(jnp.stack(known))


def _refuse(tree: PyTree, is_wrong, what: str, why: str) -> None:
    for path, leaf in jax.tree_util.tree_leaves_with_path(tree):
        if eqx.is_array(leaf) and is_wrong(np.asarray(leaf)):
            raise ValueError(f"{what}{jax.tree_util.keystr(path)} {why}")


def _said_by(check, times: np.ndarray, what: str) -> None:
    try:
        check(times)
    except ValueError as error:
        raise ValueError(f"{what}: {error}") from None


def _told(initial: AttitudeState) -> str:
    return f"quaternion {np.asarray(initial.quaternion)}, angular velocity {np.asarray(initial.angular_velocity)} rad/s"
