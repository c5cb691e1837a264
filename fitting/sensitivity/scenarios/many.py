"""Sigmas of many scenarios at once: start attitude, spin rate and instant drawn, one compiled program for all.

A scenario is a start; those of one instant share orbit, field and Sun. Each is known by its number alone: the same
seed and number give the same scenario whatever the others.
"""

import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.assembly import build_problem
from fitting.measurements.problem import Problem, linear_about, motion_of, whitened_sample
from fitting.parameters.free import FreeLeaves, FreeParameters, free_parameters
from fitting.parameters.names import STATE
from fitting.parameters.quoted import quoted_names, quoted_slopes, quoted_units
from fitting.sensitivity.choice import considered_sigmas, named_free, slopes_at_nominal
from fitting.sensitivity.plan import Columns, around_at, planned_samples, planned_weight, step_of
from fitting.sensitivity.scenarios.draws import Draws, drawn_starts
from fitting.sensitivity.sums import Sigmas, sigmas_of
from fitting.stored import Stored
from jaxsat.errors import InputError
from jaxsat.satellites import Satellite
from jaxsat.synthetic.twins import TwinSettings
from jaxsat.synthetic.twins.source import epoch_of, with_orbit

BATCH = 32
"""Scenarios in one call of the program, few enough for a core's cache; memory does not grow beyond two calls."""
TOLERANCE = 5e-3
"""Error of the integrated attitude [rad], which changes a sigma in the fifth digit."""


@dataclass(frozen=True)
class Scenarios:
    """What was drawn and what came of it; arrays over the scenarios in front."""

    draws: Draws
    instant_s: np.ndarray
    """[count] of the start, after that of the plan."""
    rate_deg_s: np.ndarray
    """[count] spin."""
    sun_deg: np.ndarray
    """[count] of the Sun above the orbit's plane."""
    lit: np.ndarray
    """[count] share of the arc in sunlight."""
    names: tuple[str, ...]
    """[rows] of the fitted numbers."""
    units: tuple[str, ...]
    sigmas: Sigmas
    """In units of results; attitudes [rad]."""
    seconds: float
    """That the scenarios took, compilation apart."""


def _sums(
    problem: Problem,
    parameters: FreeLeaves,
    weight: Float[Array, "samples channels"],
    rate: Float[Array, "cases 3"],
    reference: Float[Array, "cases 4"],
    blocks: Int[Array | np.ndarray, ""],
) -> tuple[Float[Array, "cases unknowns unknowns"], Float[Array, "cases unknowns unknowns"]]:
    """Sums over samples of whitened derivatives, and of turns, of many starts without readings of their own."""
    count = parameters.tangent.shape[1]
    linear = linear_about(parameters, jnp.zeros(count))
    seeing = jnp.zeros(count - parameters.moving)
    sky = jax.tree.map(jnp.asarray, problem.sky)

    def one(rate, reference):
        moving = jnp.concatenate([jnp.zeros(3), rate / RATE_UNIT, jnp.zeros(parameters.moving)])
        motion, slopes = motion_of(problem, linear, moving, reference, blocks)

        def sample(motion, slopes, sky, known):
            model = linear.seen(problem.model, seeing)
            views = problem.views(model, sky, motion.quaternion, motion.angular_velocity, motion.acceleration)
            measured = {name: model.sensors[name](view) for name, view in views.items()}
            return whitened_sample(problem, linear, seeing, motion, slopes, sky, measured, known)[1]

        J = jax.vmap(sample)(motion, slopes, sky, jnp.asarray(problem.known))
        turn = jnp.where(jnp.asarray(problem.valid)[:, None, None], slopes[:, 0], 0.0)
        told = jnp.einsum("scu,sc,scv->uv", J, weight, J)
        turned = jnp.einsum("sku,skv->uv", turn, turn)
        return told, jnp.pad(turned, ((0, seeing.shape[0]), (0, seeing.shape[0])))

    return jax.vmap(one)(rate, reference)


sums = Stored(_sums)


def scenarios(
    satellite: Satellite,
    plan: TwinSettings,
    draws: Draws,
    *,
    free: Sequence[str] | None = None,
    consider: Sequence[str] = (),
    orbit: Path | None = None,
    columns: Columns | None = None,
    progress: Callable[[str, int, int], None] = lambda *_: None,
) -> Scenarios:
    """Sigmas of the fitted numbers and of the attitude over so many starts of a plan's arc.

    Length, interval and first instant are those of the plan. Raises `InputError` as `vantage_of_plan` does, and for a
    motion that is given: it has no start.
    """
    flown = satellite if orbit is None else with_orbit(satellite, orbit)
    if satellite.motion.kind != "free":
        raise InputError("the motion is given: there is no start to be drawn", file=satellite.path, field="motion.kind")
    sigmas = considered_sigmas(satellite, consider)
    names = named_free(satellite, free, sigmas)
    parameters, unknowns = _unknowns(satellite, names, tuple(sigmas))
    late = _places(satellite, names, sigmas)
    delayed = tuple(name for name in satellite.channels if f"delays.{name}" in late)
    columns_of_choice = _columns(satellite, parameters, unknowns, sigmas)
    first, instants, of_case, attitude, rate = drawn_starts(epoch_of(flown, plan), draws)
    step = step_of(np.radians(draws.fastest_deg_s), np.array([0.0, plan.duration_s]), TOLERANCE)
    found: list[Sigmas] = []
    about = np.zeros((draws.count, 2))
    began = None
    for number, instant in enumerate(instants):
        epoch = first.shifted(float(instant))
        around = around_at(flown, epoch, plan.duration_s)
        samples = planned_samples(satellite, plan, epoch, columns or {})
        problem = build_problem(samples, satellite.model, around, delayed=delayed, max_step=step, room_for=step)
        own = of_case == number
        about[own] = _sun(problem, around.sun_eci(samples.epoch, samples.t[:1])[0])
        told, turned, begun = _chunks(problem, unknowns, planned_weight(problem, samples), rate[own], attitude[own])
        began = began or begun
        found.append(_sigmas(told, turned, len(samples.t), columns_of_choice))
        progress("scenarios", int((of_case <= number).sum()), draws.count)
    rows = [k for k, name in enumerate(quoted_names(parameters)) if name in _kept_names(parameters)]
    return Scenarios(
        draws=draws,
        instant_s=instants[of_case],
        rate_deg_s=np.degrees(np.linalg.norm(rate, axis=1)),
        sun_deg=about[:, 0],
        lit=about[:, 1],
        names=tuple(quoted_names(parameters)[k] for k in rows),
        units=tuple(quoted_units(parameters)[k] for k in rows),
        sigmas=_in_order(found, of_case),
        seconds=time.perf_counter() - (began or time.perf_counter()),
    )


def _in_order(found: Sequence[Sigmas], of_case: np.ndarray) -> Sigmas:
    """Those of one instant after the other, brought into the order of the cases."""
    back = np.argsort(np.argsort(of_case, kind="stable"), kind="stable")
    return Sigmas(*(np.concatenate(each)[back] for each in zip(*(vars(one).values() for one in found), strict=True)))


def _places(satellite: Satellite, *names: Iterable[str]) -> set[str]:
    wanted = {name for each in names for name in each}
    return {leaf.place for leaf in satellite.leaves if leaf.name in wanted}


def _unknowns(
    satellite: Satellite, free: Sequence[str], considered: Sequence[str]
) -> tuple[FreeParameters, FreeParameters]:
    """Those of the fit, and those that derivatives are taken by: each leaf of the choice by itself."""
    about = satellite.model, satellite.leaves
    parameters = free_parameters(*about, free, held=satellite.held)
    restated = {leaf.name for leaf in satellite.leaves if leaf.restates}
    own = {*free, *considered} - restated
    own |= {leaf.name for leaf in satellite.leaves if leaf.name in parameters.restated}
    found = free_parameters(*about, tuple(own))
    off = np.asarray(0.0)
    return parameters, replace(found, tree=replace(found.tree, keeps_body=off, by_angles=off))


def _columns(satellite, parameters, unknowns, sigmas) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """[unknowns, fitted + considered] of the program's unknowns, [fitted] priors, and slopes of what is quoted."""
    jacobian, kept = slopes_at_nominal(parameters), parameters.everything
    known = unknowns.columns >= 0
    place = {int(k): len(STATE) + n for n, k in enumerate(unknowns.columns) if k >= 0}
    found = np.zeros((len(STATE) + len(known), len(kept)))
    found[: len(STATE), : len(STATE)] = np.eye(len(STATE))
    scale = unknowns.sigma()
    for k, row in place.items():
        found[row, len(STATE) :] = jacobian[k] / scale[row - len(STATE)]
    considered = np.zeros((len(found), len(sigmas)))
    numbers = {leaf.name: k for k, leaf in enumerate(satellite.leaves)}
    for column, (name, sigma) in enumerate(sigmas.items()):
        row = place[numbers[name]]
        considered[row, column] = sigma / scale[row - len(STATE)]
    rows = [k for k, name in enumerate(quoted_names(parameters)) if name in _kept_names(parameters)]
    slopes = quoted_slopes(parameters, jacobian)[rows][:, kept]
    prior = (np.flatnonzero(kept) >= len(STATE)).astype(float)
    return np.hstack([found[:, kept], considered]), prior, slopes


def _kept_names(parameters: FreeParameters) -> set[str]:
    return {name for name, kept in zip(parameters.names, parameters.everything, strict=True) if kept}


def _chunks(problem, unknowns, weight, rate, attitude):
    """Sums of all cases of one instant in batches of one shape, on two threads, and when the first was compiled."""
    blocks = problem.grid.blocks_to(int(np.flatnonzero(problem.valid)[-1]))
    order = np.concatenate([np.arange(len(rate)), np.zeros(-len(rate) % BATCH, dtype=int)])
    compilation = sums.compile(problem, unknowns.tree, weight, rate[order[:BATCH]], attitude[order[:BATCH]], blocks)
    if compilation is not None:
        compilation.result()
    began = time.perf_counter()

    def run(part):
        return jax.device_get(sums(problem, unknowns.tree, weight, rate[part], attitude[part], blocks))

    with ThreadPoolExecutor(2) as pool:
        parts = list(pool.map(run, np.split(order, len(order) // BATCH)))
    told, turned = (np.concatenate(each)[: len(rate)] for each in zip(*parts, strict=True))
    return told, turned, began


def _sigmas(told: np.ndarray, turned: np.ndarray, samples: int, columns) -> Sigmas:
    choice, prior, slopes = columns
    told, turned = (choice.T @ each @ choice for each in (told, turned))
    finite = np.isfinite(told).all(axis=(1, 2)) & np.isfinite(turned).all(axis=(1, 2))
    # A motion that its steps cannot follow tells nothing.
    mask = np.asarray(finite).reshape(-1, 1, 1)
    told, turned = (np.where(mask, each, 0.0) for each in (told, turned))
    found = sigmas_of(told, turned, np.full(len(told), samples), prior, slopes)
    return replace(
        found,
        noise=np.where(mask[:, 0], found.noise, np.inf),
        attitude_noise=np.where(finite, found.attitude_noise, np.inf),
    )


def _sun(problem: Problem, sun: np.ndarray) -> tuple[float, float]:
    """Angle of the Sun above the orbit's plane [deg], and the share of the arc that is lit; 1 where nobody looks."""
    r, v = (np.asarray(each)[0] for each in (problem.sky.position_eci, problem.sky.velocity_eci))
    normal = np.cross(r, v)
    beta = float(np.degrees(np.arcsin(np.clip(normal @ sun / np.linalg.norm(normal), -1.0, 1.0))))
    if problem.sky.light is None:
        return beta, 1.0
    return beta, float(np.asarray(problem.sky.light.illumination)[np.asarray(problem.valid)].mean())
