"""From a minimum to the result: values, sigmas, verdict and what a person should be told."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.measurements.problem import CURRENTS, Problem
from fitting.outcome.alternatives import DIFFERENT_ATTITUDE_DEG, other_minimum
from fitting.outcome.result import AMBIGUOUS, CONVERGED, NOT_CONVERGED, FitResult, FittedParameter
from fitting.outcome.uncertainty import (
    at_bound,
    attitude_covariance,
    correlations,
    covariance,
    field_angle_sigma,
    physical_covariance,
    promised_saving,
    vector_sigma,
)
from fitting.parameters.names import GAINS, MAGNET, MODEL, NAMED, POLAR, STATE, TILTS, TO_UNIT, UNITS
from fitting.parameters.parametrization import INERTIA_SLICE, Parametrization, build_model
from fitting.parameters.transforms import thinnest
from fitting.solvers.least_squares import SEPARATE_SCALE
from fitting.solvers.refine import Refined
from fitting.stored import Stored
from jaxsat.math import angle_between, quaternion
from jaxsat.sensors.solar_panels import direct_currents

STALLED_DECREMENT = 0.1
"""Cost that an undamped step may promise at a minimum: half a sigma in one direction. Where a panel's horizon passes a
sample the cost has a kink, and a minimum on it has a slope that no step makes good."""
MAX_CHI2_PER_DOF = 4.0
"""Beyond this the minimum does not explain the data: residuals twice the stated noise."""
AMBIGUOUS_CHI2 = 9.0
"""Minima whose chi2 differ by less are equally good at three sigmas."""
REMARKABLE_CHI2_PER_DOF = 1.5
"""Beyond this the result says that the stated noise is too small."""
MAX_DISAGREEMENT = 0.2
"""Largest share of bright samples that the computed shadow may contradict."""
MAX_MISFITS = 0.05
"""Largest share of bright samples that may be left out without being dimmer than modelled."""


def _describe(
    problem: Problem, parameters: Parametrization, x_model: Float[Array, " free"], q: Float[Array, "samples 4"]
) -> tuple[Array, ...]:
    """Named values and their derivatives by `x_model`; direct currents, field and its angle to x at samples."""
    named = parameters.named(x_model)
    _, panels, _ = build_model(named[: len(MODEL)], jnp.asarray(parameters.reference_field))
    direct = jax.vmap(lambda q, light: direct_currents(q, panels, light))(q, problem.light)
    field_eci = problem.orbit.b_field_eci[jnp.asarray(problem.grid.sample_node)]
    field_body = jax.vmap(quaternion.rotate_inverse)(q, field_eci)
    x_axis = jnp.broadcast_to(jnp.array([1.0, 0.0, 0.0]), field_body.shape)
    return named, jax.jacfwd(parameters.named)(x_model), direct, field_body, angle_between(x_axis, field_body)


describe = Stored(_describe)


def summarize(
    t: np.ndarray, problem: Problem, parameters: Parametrization, refined: Refined, *, dark_disagreement: int = 0
) -> FitResult:
    """The best minimum as a `FitResult`; `t` [time] are the samples' times [s].

    `dark_disagreement` counts the samples left out because their currents contradict the computed shadow. Sigmas are
    those of the stated noise; where a parameter stands at its bound, the others are conditional on it.
    """
    n = len(t)
    best = jax.tree.map(lambda leaf: leaf[0], refined.points)
    prediction = best.prediction
    x, names = best.x, parameters.names
    noise = float(problem.noise)
    measured = np.asarray(problem.measured)
    residual, weight = prediction.residual[:, : CURRENTS.width], best.weight[:, : CURRENTS.width]
    modelled = measured + residual * noise
    values, values_jacobian, direct, field_body, field_angle = (
        np.asarray(array) for array in describe(problem, parameters, x[len(STATE) :], prediction.quaternion)
    )

    pressed = at_bound(x, best.gradient, parameters.bounds())
    # A panel that sees next to nothing reads an exact zero, which is no measurement of the noise.
    informative = ((modelled > 0.25 * noise) | (measured > 0.0)) & (weight > 0)
    residual = np.where(informative, residual, 0.0)
    sighted = best.weight[:, CURRENTS.width :] > 0
    limb_residual = np.where(sighted, prediction.residual[:, CURRENTS.width :], 0.0)
    outlying = np.abs(limb_residual) > SEPARATE_SCALE
    sighted, limb_residual = sighted & ~outlying, np.where(outlying, 0.0, limb_residual)
    chi2 = float((residual**2).sum() + (limb_residual**2).sum())
    # Unknowns that the prior holds take no degree of freedom from the data.
    prior_share = np.where(np.arange(len(x)) < len(STATE), 0.0, 1.0)
    cov = covariance(best.hessian, ~pressed)
    held = prior_share * np.where(np.isfinite(np.diagonal(cov)), np.diagonal(cov), 1.0)
    dof = int(round(informative.sum() + sighted.sum() - np.sum(~pressed) + held[~pressed].sum()))
    ratio = chi2 / max(dof, 1)

    all_names, physical = physical_covariance(values_jacobian, cov)
    rotation_covariance = attitude_covariance(prediction.rotation_jacobian, cov)
    sigma = dict(zip(all_names, np.sqrt(np.diagonal(physical)), strict=True))
    notes = {name: "at its bound" for name, flag in zip(names, pressed, strict=True) if flag}
    notes |= {name: "at zero: a panel without light" for name in notes if name in GAINS}
    notes |= {
        name: "held by its prior"
        for name, share in zip(names, held, strict=True)
        # Along the gauge the prior holds nothing but a number without meaning.
        if share > 0.5 and name not in notes and not (parameters.gauged and name in (*MAGNET, POLAR[0]))
    }

    table = []
    for name, value in zip(NAMED, values, strict=True):
        free = name in parameters.free or (name in MAGNET and parameters.polar)
        if not free and (name in POLAR or (name in TILTS and value == 0.0)):
            continue
        # At a bound there is no sigma: the data would have it beyond.
        known = free and 0.0 < sigma[name] < np.inf
        quoted = parameters.quoted(name)
        table.append(
            FittedParameter(
                name,
                float(value * TO_UNIT.get(name, 1.0) * quoted),
                float(sigma[name] * quoted) if known else None,
                UNITS[name],
                free,
                notes.get(name, ""),
            )
        )

    alternatives = _alternatives(refined, n)
    equals = [a for a in alternatives if a["chi2_above_best"] < AMBIGUOUS_CHI2 * max(1.0, ratio)]
    promise = promised_saving(best.gradient, cov, pressed)
    remarks = _remarks(refined, values, notes, dark_disagreement, ratio)
    limb_rms_deg = None
    if problem.limb is not None and sighted.any():
        limb_rms_deg = float(np.degrees(np.sqrt((limb_residual**2).sum() / sighted.sum()) * float(problem.limb.sigma)))
        wild = f", but for {outlying.sum()} beyond {SEPARATE_SCALE:g} sigmas" if outlying.any() else ""
        remarks.append(f"limb angles fit to {limb_rms_deg:.2g} deg{wild}")
    # A limited charge current only takes away: samples left out though they are as bright as modelled are misfits.
    misfits = int((refined.limited[0, :, 0] & (measured.sum(axis=1) > modelled.sum(axis=1) - 3.0 * noise)).sum())
    status, verdict = _verdict(
        float(best.cost), promise, ratio, refined, equals, dark_disagreement, misfits, int(problem.bright().sum())
    )
    message = "; ".join([verdict, *remarks])
    rms = float(np.sqrt((residual**2).sum() / max(informative.sum(), 1)) * noise * 1e3)
    return FitResult(
        status=status,
        message=message,
        chi2=chi2,
        dof=dof,
        residual_rms_mA=rms,
        parameters=tuple(table),
        gauge=None,
        correlations=correlations(all_names, physical, set(names)),
        t_s=t,
        quaternion_inertial_from_body=prediction.quaternion[:n],
        angular_velocity_rad_s=prediction.angular_velocity[:n],
        attitude_sigma_deg=np.degrees(np.sqrt(np.einsum("sii->si", rotation_covariance)))[:n],
        field_angle_deg=np.degrees(field_angle)[:n],
        field_angle_sigma_deg=np.degrees(field_angle_sigma(field_body, rotation_covariance))[:n],
        measured_mA=1e3 * measured[:n],
        modelled_mA=1e3 * modelled[:n],
        modelled_direct_mA=1e3 * direct[:n],
        weight=(informative * weight)[:n],
        limited=refined.limited[0, :n, 0],
        lit=problem.sunlit()[:n],
        limb_samples=int(sighted.any(axis=1).sum()),
        limb_rms_deg=limb_rms_deg,
        alternatives=alternatives,
        field_body_uT=1e6 * field_body[:n],
        field_body_sigma_uT=1e6 * vector_sigma(field_body, rotation_covariance)[:n],
    )


def _alternatives(refined: Refined, n: int) -> tuple[dict, ...]:
    """All other minima whose motion differs, by chi2."""
    q = np.asarray(refined.points.prediction.quaternion)[0, :n]
    found = [other_minimum(refined, k, q, refined.score[0]) for k in range(1, len(refined.score))]
    different = [other for distance, other in found if distance > DIFFERENT_ATTITUDE_DEG]
    return tuple(sorted(different, key=lambda other: other["chi2_above_best"]))


def _remarks(refined: Refined, values: np.ndarray, notes: dict[str, str], disagree: int, ratio: float) -> list[str]:
    """What a person should know beside the verdict."""
    remarks = []
    left_out = int(refined.limited[0].sum())
    if left_out:
        remarks.append(f"{left_out} samples left out as current-limited or outlying")
    if disagree:
        remarks.append(f"{disagree} samples left out where currents and computed shadow disagree")
    if REMARKABLE_CHI2_PER_DOF < ratio <= MAX_CHI2_PER_DOF:
        remarks.append(
            f"residuals are {np.sqrt(ratio):.2f} times the stated noise, sigmas are those of the stated noise"
        )
    remarks += [f"{name} is {note}" for name, note in notes.items()]
    if thinnest(values[INERTIA_SLICE]) < -1e-9:
        remarks.append("the inertia tensor is not that of a body (triangle inequality)")
    return remarks


def _verdict(
    cost: float,
    promise: float,
    ratio: float,
    refined: Refined,
    equals: list[dict],
    disagree: int,
    misfits: int,
    bright: int,
) -> tuple[str, str]:
    """Status and its reason; `promise` is the cost that an undamped step would still save."""
    if not (np.isfinite(cost) and promise <= STALLED_DECREMENT):
        return NOT_CONVERGED, f"the solver stopped short of the minimum (a step would still save {promise:.2g})"
    if disagree > MAX_DISAGREEMENT * bright:
        return NOT_CONVERGED, (
            f"the computed shadow contradicts {disagree} of {bright} bright samples: check epoch, orbit and Sun"
        )
    if refined.hopeless[0] or ratio > MAX_CHI2_PER_DOF:
        return NOT_CONVERGED, (
            f"the best minimum found does not explain the data: residuals are {np.sqrt(ratio):.1f} times the noise; "
            "free more parameters (albedo, imax, gains), or state the noise that the model deserves"
        )
    if misfits > MAX_MISFITS * bright:
        return NOT_CONVERGED, (
            f"{misfits} of {bright} bright samples fit no attitude, and no limited current dims them: "
            "the model is wrong; free more parameters (rods, inertia, magnet)"
        )
    if equals:
        return AMBIGUOUS, f"{len(equals) + 1} different motions explain the data equally well"
    return CONVERGED, "one motion explains the data"
