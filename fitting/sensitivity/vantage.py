"""A motion with its sensors, from which derivatives of all readings by all numbers are taken: one forward run.

Every number of the satellite is among the unknowns, whatever a fit frees: which of them are fitted, considered or
taken for known is a choice of columns afterwards, and compiles nothing (`fitting.sensitivity.choice`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import jax.numpy as jnp
import numpy as np

from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.assembly import Samples
from fitting.measurements.floor import NO_FLOOR, at_floor
from fitting.measurements.problem import Problem
from fitting.outcome.looking import look, on_host, read
from fitting.parameters.free import FreeParameters, free_parameters
from fitting.parameters.names import STATE
from jaxsat.errors import InputError
from jaxsat.satellites import Satellite
from jaxsat.satellites.model import Leaf, Model

MOST_BYTES = 3e9
"""Of the derivatives of all readings, beyond which a session is refused."""


@dataclass(frozen=True)
class Slopes:
    """Derivatives along one motion; arrays over its samples. Unknowns are the six of the state, then leaves."""

    leaves: np.ndarray
    """[leaves] numbers of the leaves among those of the satellite, in the order of the unknowns."""
    scale: np.ndarray
    """[leaves] change of each for a unit of its unknown, SI."""
    residual: np.ndarray
    """[samples channels] (modelled - measured) / sigma."""
    jacobian: np.ndarray
    """[samples channels unknowns] of it; a turn [rad], a rate [rad/min], a leaf in its `scale`."""
    weight: np.ndarray
    """[samples channels] with which each counts: 0 where it is not used."""
    rotation: np.ndarray
    """[samples 3 unknowns] small turn of the attitude in body axes [rad]."""
    quaternion: np.ndarray
    """[samples 4] inertial from body."""
    angular_velocity: np.ndarray
    """[samples 3] body axes [rad/s]."""
    lost: tuple[str, ...]
    """Leaves by which the readings have no derivative here; their columns are zero."""


@dataclass(frozen=True)
class Vantage:
    """A motion of a satellite with what its sensors do or did measure."""

    satellite: Satellite
    model: Model
    """The numbers about which everything is linear."""
    problem: Problem
    samples: Samples
    quaternion: np.ndarray
    """[4] at the first sample, inertial from body."""
    rate: np.ndarray
    """[3] at the first sample, body axes [rad/s]."""
    weight: np.ndarray
    """[padded samples, channels] of the measurements."""

    @property
    def free_motion(self) -> bool:
        """Whether the motion's start is unknown."""
        return self.samples.given is None

    @cached_property
    def parameters(self) -> FreeParameters:
        """All leaves as unknowns of their own, nothing held by definition."""
        return every_leaf(self.satellite, self.model, free_motion=self.free_motion)

    @cached_property
    def slopes(self) -> Slopes:
        """Along the motion itself; raises `InputError` where there are none."""
        return self.at(np.zeros(6), {})

    def at(self, state: np.ndarray, shifts: Mapping[int, float]) -> Slopes:
        """Along a motion that begins a little beside it: `state` [6] a turn [rad] and a rate [rad/min].

        `shifts` are those of leaves by their numbers, SI. The same program for all of them.
        """
        parameters = self.parameters
        values = np.array(parameters.tree.nominal, float)
        for number, shift in shifts.items():
            values[number] += shift
        x = np.concatenate([state, parameters.shifts(values)])
        x[3:6] += self.rate / RATE_UNIT
        problem, blocks = self.problem, self.problem.grid.blocks_to(int(np.flatnonzero(self.problem.valid)[-1]))
        self._check_size(len(x))
        found = look(problem, parameters.tree, x, self.quaternion, blocks)
        residual, jacobian, q, w, rotation = (np.array(each)[np.asarray(problem.valid)] for each in found[:5])
        known = np.concatenate([np.ones(len(STATE), bool), parameters.columns >= 0])
        jacobian, rotation = jacobian[..., known], rotation[..., known]
        if not (np.isfinite(q).all() and np.isfinite(residual[self._used()]).all()):
            raise InputError("the motion is not finite: its steps are too long for it, or a number is out of range")
        bad = ~(np.isfinite(np.where(self._used()[..., None], jacobian, 0.0)).all(axis=(0, 1)))
        bad |= ~np.isfinite(rotation).all(axis=(0, 1))
        jacobian[..., bad], rotation[..., bad] = 0.0, 0.0
        names = np.array([name for name in parameters.names if name])
        return Slopes(
            leaves=parameters.columns[parameters.columns >= 0],
            scale=parameters.sigma()[parameters.columns >= 0],
            residual=residual,
            jacobian=np.where(self._used()[..., None], jacobian, 0.0),
            weight=self._counted(residual),
            rotation=rotation,
            quaternion=q,
            angular_velocity=w,
            lost=tuple(str(name) for name in names[bad]),
        )

    def readings(self, slopes: Slopes) -> Mapping[str, np.ndarray]:
        """[padded samples, readings] of each sensor along a motion without noise, SI."""
        extra = len(self.problem.valid) - len(slopes.quaternion)
        q, w = (
            np.pad(each, ((0, extra), (0, 0)), mode="edge") for each in (slopes.quaternion, slopes.angular_velocity)
        )
        return {name: np.asarray(each) for name, each in read(self.problem, self.model, q, w).items()}

    def as_read(self, slopes: Slopes) -> "Vantage":
        """The same with measurements without any noise: what a plan has in the place of readings."""
        return replace(self, problem=replace(self.problem, measured=dict(self.readings(slopes))))

    def _used(self) -> np.ndarray:
        return self.weight[np.asarray(self.problem.valid)] > 0.0

    def _counted(self, residual: np.ndarray) -> np.ndarray:
        """Weights with the curvature of readings at the telemetry's floor, as the solver has them."""
        valid = np.asarray(self.problem.valid)
        weight, floor = self.weight[valid], np.asarray(self.problem.floor)[valid]
        if not (floor > NO_FLOOR).any():
            return weight
        return weight * np.asarray(at_floor(jnp.asarray(residual), jnp.asarray(floor))[2])

    def _check_size(self, unknowns: int) -> None:
        size = 8.0 * len(self.problem.valid) * self.problem.channels * unknowns
        if size > MOST_BYTES:
            reason = f"the derivatives of {len(self.samples.t)} samples take {size / 1e9:.1f} GB, {MOST_BYTES / 1e9:g} "
            raise InputError(reason + "are the most: take a longer interval, or a shorter arc")


def every_leaf(satellite: Satellite, model: Model, *, free_motion: bool) -> FreeParameters:
    """All leaves of a satellite as unknowns, each by itself, about the numbers of `model`."""
    names = [leaf.name for leaf in satellite.leaves if not leaf.restates]
    found = free_parameters(model, satellite.leaves, names, free_motion=free_motion)
    off = np.asarray(0.0)
    return replace(found, tree=replace(found.tree, keeps_body=off, by_angles=off))


def model_at(model: Model, leaves: tuple[Leaf, ...], values: Mapping[str, float]) -> Model:
    """The model with other values of some leaves, SI, by their names."""
    chosen = [leaf for leaf in leaves if leaf.name in values and not leaf.restates]
    return on_host(model, [leaf.spot for leaf in chosen], np.array([values[leaf.name] for leaf in chosen]))
