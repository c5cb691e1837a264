"""A minimum looked at from all sides: readings, their derivatives, and what covariance makes of them."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from fitting.measurements.problem import Problem
from fitting.outcome.uncertainty import at_bound, attitude_covariance, covariance
from fitting.parameters.free import FreeLeaves, FreeParameters
from fitting.parameters.names import STATE
from fitting.solvers.least_squares import Point, prior_information
from fitting.stored import Stored
from jaxsat.math import put
from jaxsat.satellites.model import POLAR_PLACE, Model, Spot, array_at


def _look(
    problem: Problem,
    parameters: FreeLeaves,
    x: Float[Array, " unknowns"],
    reference: Float[Array, "4"],
    blocks: Int[Array | np.ndarray, ""],
) -> tuple[Array, ...]:
    """Residuals with their whole Jacobian, the motion with its own, and the leaves with theirs."""
    prediction, jacobian = problem.predict(parameters, x, reference, blocks)
    assert prediction.rotation_jacobian is not None
    x_model = x[len(STATE) :]
    return (
        prediction.residual,
        jacobian,
        prediction.quaternion,
        prediction.angular_velocity,
        prediction.rotation_jacobian,
        parameters.values(x_model),
        jax.jacfwd(parameters.values)(x_model),
    )


def _read(
    problem: Problem,
    model: Model,
    q: Float[Array, "samples 4"],
    w: Float[Array, "samples 3"],
) -> Mapping[str, Array]:
    """Noise-free readings of every sensor at the samples, SI."""
    between = jnp.asarray(jnp.gradient(problem.sky.time))
    slope = jnp.asarray(jnp.gradient(w, axis=0)) / jnp.maximum(between, 1e-9)[:, None]

    def one(q, w, acceleration, sky):
        views = problem.views(model, sky, q, w, acceleration)
        return {name: model.sensors[name](view) for name, view in views.items()}

    return jax.vmap(one)(q, w, slope, jax.tree.map(jnp.asarray, problem.sky))


look, read = Stored(_look, seldom=True), Stored(_read, seldom=True)


@dataclass(frozen=True)
class Look:
    """One minimum on the host; arrays over the padded samples of its problem."""

    residual: np.ndarray
    """[samples channels] (modelled - measured) / sigma."""
    jacobian: np.ndarray
    """[samples channels unknowns] of it."""
    promised: np.ndarray
    """[samples channels] 1-sigma of it by noise and covariance, of what was not fitted."""
    readings: Mapping[str, np.ndarray]
    """[samples readings] of each sensor, SI."""
    quaternion: np.ndarray
    angular_velocity: np.ndarray
    rotation_covariance: np.ndarray
    """[samples 3 3] of a small turn in body axes [rad^2]."""
    values: np.ndarray
    """[leaves] SI."""
    values_jacobian: np.ndarray
    """[leaves unknowns] by the unknowns after the state."""
    covariance: np.ndarray
    """[unknowns unknowns]"""
    pressed: np.ndarray
    """[unknowns] bool: against a bound."""
    model: Model

    def at(self, index: np.ndarray) -> "Look":
        """The same at some of the samples."""
        return replace(
            self,
            residual=self.residual[index],
            jacobian=self.jacobian[index],
            promised=self.promised[index],
            readings={name: array[index] for name, array in self.readings.items()},
            quaternion=self.quaternion[index],
            angular_velocity=self.angular_velocity[index],
            rotation_covariance=self.rotation_covariance[index],
        )


def prepare_look(problem: Problem, parameters: FreeParameters) -> None:
    """Starts the compilation of what looks at a minimum of such a problem in the background: see `Stored.compile`."""
    x, reference, blocks = np.zeros(len(parameters.everything)), np.zeros(4), np.asarray(0)
    look.compile(problem, parameters.tree, x, reference, blocks)
    motion = np.zeros((len(problem.valid), 4)), np.zeros((len(problem.valid), 3))
    read.compile(problem, on_host(problem.model, parameters.tree.spots, np.asarray(parameters.tree.nominal)), *motion)


def on_host(model: Model, spots: Sequence[Spot], values: np.ndarray) -> Model:
    """As `with_values`, without a program for each array."""
    arrays: dict[str, np.ndarray] = {}
    for (place, entries), value in zip(spots, values, strict=True):
        if place == POLAR_PLACE:
            continue
        array = arrays.setdefault(place, np.array(array_at(model, place), dtype=float))
        array.reshape(-1)[list(entries)] = value
    if not arrays:
        return model
    moved = [put(array) for array in arrays.values()]
    return eqx.tree_at(lambda m: [array_at(m, place) for place in arrays], model, moved)


def direct_readings(problem: Problem, seen: Look, names: Iterable[str]) -> dict[str, np.ndarray]:
    """[samples readings] of some sensors under an Earth that returns no light, SI: by the program that is there."""
    found = read(problem, returning_no_light(seen.model), seen.quaternion, seen.angular_velocity)
    return {name: np.asarray(found[name]) for name in names}


def returning_no_light(model: Model) -> Model:
    """The same under an Earth that returns no light."""
    return replace(model, albedo=jax.tree.map(lambda leaf: jnp.asarray(np.zeros_like(leaf)), model.albedo))


def look_at(problem: Problem, parameters: FreeParameters, best: Point) -> Look:
    """The minimum `best` (leaves without a starts axis) on its own problem."""
    last = int(np.flatnonzero(problem.valid)[-1])
    blocks = problem.grid.blocks_to(last)
    x, reference = np.asarray(best.x), np.asarray(best.reference)
    residual, jacobian, q, w, rotation, values, values_jacobian = (
        np.asarray(array) for array in look(problem, parameters.tree, x, reference, blocks)
    )
    pressed = at_bound(x, np.asarray(best.gradient), parameters.bounds())
    cov = covariance(np.asarray(best.hessian), parameters.everything & ~pressed, prior_information(len(x)))
    finite = np.isfinite(np.diagonal(cov))
    J = jacobian[..., finite]
    spread = np.einsum("scu,uv,scv->sc", J, cov[np.ix_(finite, finite)], J)
    model = on_host(problem.model, parameters.tree.spots, values)
    readings = {name: np.asarray(array) for name, array in read(problem, model, q, w).items()}
    return Look(
        residual=residual,
        jacobian=jacobian,
        promised=np.sqrt(1.0 + np.maximum(spread, 0.0)),
        readings=readings,
        quaternion=q,
        angular_velocity=w,
        rotation_covariance=attitude_covariance(rotation, cov),
        values=values,
        values_jacobian=values_jacobian,
        covariance=cov,
        pressed=pressed,
        model=model,
    )
