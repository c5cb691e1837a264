"""The sigma that a design is to lower, as a smooth function of what the readings tell.

sigma^2 = tr(A C) of the covariance C of all errors, with A the mean of the turns T^T T of the attitude, or s s^T of a
number with slopes s. Where considered numbers count, their shift of the estimate is in it
(`fitting.sensitivity.information`).
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.sensitivity.analysis import Sensitivity
from jaxsat.errors import InputError

ATTITUDE = "attitude"
"""The RMS over the arc of the attitude's error, three axes together."""


@dataclass(frozen=True)
class Aim:
    """What a design is to lower: sigma^2 is the trace of `matrix` times the covariance of all errors."""

    name: str
    unit: str
    matrix: np.ndarray
    """[fitted + considered, fitted + considered], of the errors of the fitted and of the considered numbers."""


def aim_of(found: Sensitivity, name: str = ATTITUDE) -> Aim:
    """The attitude, in degrees, or a fitted number by its name, in its unit; raises `InputError` for other names."""
    if name == ATTITUDE:
        known = found.found
        turn = np.degrees(np.concatenate([known.turn_by_free, known.turn_of_motion], axis=-1))
        return Aim(name, "deg", np.einsum("sku,skv->uv", turn, turn) / len(turn))
    names = [row.name for row in found.quoted.rows]
    if name not in names:
        raise InputError(f"no number that is fitted; there are {ATTITUDE}, {', '.join(names)}", field=name)
    row = names.index(name)
    slopes = np.concatenate([found.quoted.slopes[row], np.zeros(len(found.choice.considered))])
    return Aim(name, found.quoted.rows[row].unit, np.outer(slopes, slopes))


def squared_sigma(
    told: Float[Array | np.ndarray, "numbers numbers"],
    aim: Float[Array | np.ndarray, "numbers numbers"],
    prior: Float[Array | np.ndarray, " fitted"],
) -> Float[Array, ""]:
    """sigma^2 of an aim where the readings tell `told`, the sum of [J_f J_c]^T W [J_f J_c]; NaN where singular."""
    fitted = len(prior)
    factor = _factor(told, prior)
    told = jnp.asarray(told)
    noise = jax.scipy.linalg.cho_solve(factor, jnp.asarray(aim)[:fitted, :fitted])
    shift = jax.scipy.linalg.cho_solve(factor, told[:fitted, fitted:])
    # Estimated less true number for one sigma of each considered one.
    error = jnp.concatenate([shift, -jnp.eye(told.shape[0] - fitted)])
    return jnp.trace(noise) + jnp.sum(error * (jnp.asarray(aim) @ error))


def log_volume(
    told: Float[Array | np.ndarray, "numbers numbers"], prior: Float[Array | np.ndarray, " fitted"]
) -> Float[Array, ""]:
    """Logarithm of the determinant of the covariance from noise: what a D-optimal design makes least."""
    return -2.0 * jnp.sum(jnp.log(jnp.diagonal(_factor(told, prior)[0])))


def _factor(told, prior):
    fitted = len(prior)
    return jax.scipy.linalg.cho_factor(told[:fitted, :fitted] + jnp.diag(jnp.asarray(prior)), lower=True)
