"""From the minima of any satellite to the result: values, sigmas, held-out readings, verdict in words."""

from concurrent.futures import ThreadPoolExecutor

import jax
import numpy as np
from scipy.spatial.transform import Rotation
from scipy.special import chdtrc

from fitting.identify import Identified, Minimum
from fitting.measurements.contradicted import contradicted
from fitting.measurements.floor import NO_FLOOR
from fitting.measurements.groups import columns_of, of_groups
from fitting.outcome.alternatives import DIFFERENT_ATTITUDE_DEG, other_minimum
from fitting.outcome.believable import factor_remark, sigma_factor, widened, with_factor
from fitting.outcome.breaks import find_breaks, stamp_delay
from fitting.outcome.looking import Look, direct_readings, look_at
from fitting.outcome.possible import no_body, renamed_axes, without_light, wrong_axes
from fitting.outcome.result import WILD, ChannelFit, FitResult, FittedParameter, Holdout, Wish, misfit_share
from fitting.outcome.series import PanelResiduals, panel_residuals, slots
from fitting.outcome.uncertainty import (
    correlations,
    field_angle_sigma,
    promised_saving,
    propagated,
    scatter_directions,
    undamped_step,
)
from fitting.outcome.verdict import (
    FAR_OFF,
    HELD_BY_PRIOR,
    STALLED_DECREMENT,
    WITHOUT_LIGHT,
    Background,
    Evidence,
    as_well,
    judge,
)
from fitting.outcome.witness import wish_of
from fitting.outcome.worth import worth
from fitting.parameters.free import FreeParameters
from fitting.parameters.invisible import relative_to
from fitting.parameters.names import STATE
from fitting.parameters.null_space import gauge_text, unseen_directions
from fitting.parameters.quoted import quoted_names, quoted_slopes
from fitting.solvers.refine import tried_saving
from jaxsat.math.on_host import angle_between_attitudes, angles_between
from jaxsat.sensors import Panels
from jaxsat.sensors.abstract import AbstractSensor

FAINT = 0.25
"""A reading at the telemetry's floor says nothing where the model has less than this [sigma]."""
HELD = 0.5
"""Share of a prior's variance that is left where its parameter is called held by it."""
FAR_SIGMAS = 3.0
"""Of the satellite file, beyond which a value is called far off."""


def summarize(found: Identified, background: Background | None = None) -> FitResult:
    """The best minimum as a result; `background` is what is known beside the readings."""
    best, parameters, samples = found.minima[0], found.parameters, found.samples
    point = jax.tree.map(lambda leaf: np.asarray(leaf)[0], best.refined.points)
    # XLA works on it beside the rest, which is Python's.
    pool = ThreadPoolExecutor(1, thread_name_prefix="worth")
    buys = pool.submit(worth, found, best, point)
    pool.shutdown(wait=False)
    seen = look_at(best.problem, parameters, point)
    n = len(samples.t)
    fitted = np.arange(n) < found.fitted
    informative = _informative(best, seen)[:n]
    counted = informative & fitted[:, None] & (np.asarray(point.weight)[:n] > 0)
    chi2 = float((seen.residual[:n][counted] ** 2).sum())
    free = parameters.everything & ~seen.pressed
    share = np.where(np.isfinite(np.diagonal(seen.covariance)), np.diagonal(seen.covariance), 1.0)
    share[: len(STATE)] = 0.0
    # Unknowns that the prior holds take no degree of freedom from the data.
    dof = int(round(counted.sum() - free.sum() + share[free].sum()))
    table, notes, full = _parameters(parameters, seen, share)
    information = np.asarray(point.hessian)
    unseen = unseen_directions(parameters, information, free, seen.values, seen.values_jacobian, seen.model)
    chi2_p = float(chdtrc(dof, chi2)) if dof > 0 else 1.0
    channels = _channels(found, best, seen, point, counted, informative, chi2_p)
    ratio = chi2 / max(dof, 1)
    alternatives = tuple(_alternatives(found, seen, as_well(ratio)))
    variance = np.einsum("sii->si", seen.rotation_covariance)[:n]
    # Below zero by rounding, where the information is singular: nothing is known.
    sigma_deg = np.degrees(np.sqrt(np.where(variance < 0.0, np.inf, variance)))
    evidence = Evidence(
        cost=float(point.cost),
        promise=_promise(best, parameters, point, seen),
        ratio=ratio,
        hopeless=bool(best.refined.hopeless[0]),
        channels=channels,
        alternatives=alternatives,
        attitude_sigma_deg=float(np.median(np.linalg.norm(sigma_deg[fitted], axis=1)))
        if parameters.free_motion
        else 0.0,
        notes=notes,
        held_out=not fitted.all(),
        no_body=no_body(parameters, seen),
        renamed=renamed_axes(parameters, seen),
        chi2_p=chi2_p,
        background=background or Background(),
    )
    status, verdict, message, remarks = judge(evidence)
    factor = sigma_factor(verdict, channels, at_minimum=evidence.promise <= STALLED_DECREMENT)
    light = best.problem.sky.light
    turned = Rotation.from_quat(seen.quaternion[:n], scalar_first=True)
    field = turned.inv().apply(np.array(best.problem.sky.b_field_eci)[:n])
    return FitResult(
        status=status,
        message=message,
        verdict=verdict,
        remarks=(*wrong_axes(seen.model.sensors), *remarks, *factor_remark(factor)),
        chi2=chi2,
        dof=dof,
        parameters=with_factor(table, factor),
        buys=buys.result(),
        correlations=full,
        t_s=samples.t,
        quaternion_inertial_from_body=seen.quaternion[:n],
        angular_velocity_rad_s=seen.angular_velocity[:n],
        attitude_sigma_deg=widened(sigma_deg, factor),
        illumination=None if light is None else np.asarray(light.illumination)[:n],
        fitted=fitted,
        channels=channels,
        axes=best.convention.spelt(),
        alternatives=alternatives,
        timing_s=found.timing_s,
        limited=_limited(best)[:n],
        gauge=gauge_text(unseen) or parameters.gauge_text,
        unseen=unseen,
        field_angle_deg=np.degrees(np.arctan2(np.linalg.norm(field[:, 1:], axis=1), field[:, 0])),
        field_angle_sigma_deg=widened(np.degrees(field_angle_sigma(field, seen.rotation_covariance[:n])), factor),
    )


def _promise(best, parameters, point, seen) -> float:
    """Cost that a step would still save: tried, where the slopes promise much."""
    about = np.asarray(point.gradient), seen.covariance, seen.pressed
    promise = promised_saving(*about)
    if promise <= STALLED_DECREMENT:
        return promise
    return min(promise, tried_saving(best.problem, parameters, point, undamped_step(*about)))


def _limited(minimum: Minimum) -> np.ndarray:
    """[samples] whether all sensors of light that measured there were left out by the search."""
    problem, groups = minimum.problem, minimum.problem.groups
    light = np.array([problem.model.sensors[group.name].sees == "sun" for group in groups])
    measured = of_groups(np.asarray(problem.known, float), groups) > 0
    left_out = measured & np.asarray(minimum.refined.limited[0])
    return (measured & light).any(axis=1) & (left_out == measured)[:, light].all(axis=1)


def _informative(minimum: Minimum, seen: Look) -> np.ndarray:
    """[samples channels] whether a measurement says something: an exact zero of a panel that sees nothing does not."""
    floor = np.asarray(minimum.problem.floor)
    return np.asarray(minimum.problem.known) & ((floor == NO_FLOOR) | (seen.residual > FAINT))


def _parameters(
    parameters: FreeParameters, seen: Look, share: np.ndarray
) -> tuple[tuple[FittedParameter, ...], dict[str, str], dict[str, dict[str, float]]]:
    """Table of all numbers, notes on some, and correlations between the free ones."""
    unknowns = parameters.names
    full = propagated(quoted_slopes(parameters, seen.values_jacobian), seen.covariance)
    sigma = np.sqrt(np.diagonal(full))
    names = list(quoted_names(parameters))
    dark, notes = without_light(parameters, seen), {}
    for name, flag, held in zip(unknowns, seen.pressed, share, strict=True):
        if name and flag:
            notes[name] = WITHOUT_LIGHT if name in dark else "at its bound"
        elif name and held > HELD and name not in parameters.gauged_leaves:
            notes[name] = HELD_BY_PRIOR
    free = {name for name in unknowns if name} if parameters.free_motion else {name for name in unknowns[6:] if name}
    table, nominal = [], np.asarray(parameters.tree.nominal)
    # A dipole that moves by its angles is told as a vector too.
    told, relative = free | parameters.restated, relative_to(parameters, seen.values)
    for number, leaf in enumerate(parameters.leaves):
        if leaf.restates and leaf.name not in free:
            continue
        s = float(sigma[len(STATE) + number])
        known = leaf.name in told and 0.0 < s < np.inf
        if known and leaf.sigma is not None and abs(seen.values[number] - nominal[number]) > FAR_SIGMAS * leaf.sigma:
            # A prior does not hold what is far off it.
            notes[leaf.name] = FAR_OFF if notes.get(leaf.name) == HELD_BY_PRIOR else notes.get(leaf.name, FAR_OFF)
        value = float(seen.values[number] * leaf.to_unit)
        note = notes.get(leaf.name) or relative.get(leaf.name, "")
        table.append(FittedParameter(leaf.name, value, s if known else None, leaf.unit, leaf.name in told, note))
    return tuple(table), notes, correlations(names, full, free)


def _channels(found, best, seen, point, counted, informative, chi2_p) -> dict[str, ChannelFit]:
    samples = found.samples
    limited, weight = best.refined.limited[0], np.asarray(point.weight)
    result = {}
    panels = [name for name, sensor in seen.model.sensors.items() if isinstance(sensor, Panels)]
    direct = direct_readings(best.problem, seen, panels) if panels else {}
    slices = columns_of(best.problem.groups)
    bright, denied = best.problem.telling(), contradicted(best.problem)
    names = {leaf.place: leaf.name for leaf in found.parameters.leaves}
    for number, (group, columns) in enumerate(zip(best.problem.groups, slices, strict=True)):
        channel, rows = samples.channels[group.name], samples.values[group.name]
        own = np.flatnonzero(np.isfinite(rows).any(axis=1))
        sensor = seen.model.sensors[group.name]
        fitted = (own < found.fitted) & (not channel.witness)
        residual, promised = -seen.residual[own][:, columns], seen.promised[own][:, columns]
        known = np.asarray(best.problem.known)[own][:, columns]
        held_used = ~((residual**2 * known).sum(axis=1) / (promised.max(axis=1) ** 2) > WILD * group.limit)
        fit_used = ~limited[own, number] & (weight[own][:, columns] > 0).any(axis=1)
        used = np.where(fitted, fit_used, held_used)
        measured, modelled = rows[own] * channel.to_unit, seen.readings[group.name][own] * channel.to_unit
        sigma = channel.sigma * channel.to_unit
        mask = counted[own][:, columns]
        rms = float(np.sqrt((residual[mask] ** 2).mean()) * sigma) if mask.any() else None
        angle = _angles(sensor, rows[own], seen.readings[group.name][own])
        misfits = 0.0
        if isinstance(sensor, Panels):
            misfits = misfit_share(limited[own, number][fitted], measured[fitted], modelled[fitted], sigma)
        later = ~fitted & used
        outliers, slopes = int((~fitted & ~used).sum()), seen.jacobian[own][:, columns]
        held = _holdout(residual, promised, known & later[:, None], outliers, sigma, angle, slopes, seen.covariance)
        delay = None
        if group.name not in best.problem.delayed and best.problem.motion is None:
            good = used & fitted & known.all(axis=1)
            if residual.shape[1] == modelled.shape[1]:
                delay = stamp_delay(samples.t[own][good], residual[good], modelled[good], sigma)
        breaks = ()
        if sensor.sees in ("field", "sun", "nadir") and residual.shape[1] == 3:
            good = used | ~fitted
            good &= known.all(axis=1)
            # What the fit is not sure of, where it predicts, is no break.
            wide = residual[good] / promised[good]
            breaks = find_breaks(samples.t[own][good], wide, modelled[good] / promised[good], sigma, 1.0)
        angle_fitted = angle[fitted & used & np.isfinite(angle)]
        result[group.name] = ChannelFit(
            name=group.name,
            kind=type(sensor).__name__,
            unit=channel.unit,
            columns=tuple(channel.columns),
            t_s=samples.t[own],
            measured=measured,
            modelled=modelled,
            sigma=sigma,
            residual=np.where(known, residual, np.nan),
            promised=promised,
            fitted=fitted,
            used=used,
            rms=rms,
            chi2_per_reading=float((residual[mask] ** 2).mean()) if mask.any() else None,
            angle_deg=float(np.median(angle_fitted)) if len(angle_fitted) else None,
            holdout=held,
            delay_s=delay[0] if delay else None,
            delay_sigma_s=delay[1] if delay else None,
            delay_name=names.get(f"delays.{group.name}"),
            breaks=breaks,
            residuals=_memory(samples.t[own], residual, mask),
            misfits=misfits,
            bright=int(bright[own, number][fitted].sum()) if sensor.sees == "sun" else 0,
            contradicted=int(denied[own, number][fitted].sum()),
            witness=channel.witness,
            wish=_wish(best.problem, seen, channel, own, columns, used, chi2_p) if channel.witness else None,
            direct=direct[group.name][own] * channel.to_unit if group.name in direct else None,
            weight=np.where(fitted[:, None], (informative * weight[: len(informative)])[own][:, columns], 0.0),
        )
    return result


def _wish(problem, seen, channel, own, columns, used, chi2_p) -> Wish | None:
    """How a witness would move the fit; what its calibration may be wrong by is linear in what it looks at."""
    known = np.asarray(problem.known)[own][:, columns] & used[:, None]
    finite = np.isfinite(np.diagonal(seen.covariance))
    looked_at = seen.readings[channel.name][own] / channel.sigma
    if seen.model.sensors[channel.name].sees == "field":
        turned = Rotation.from_quat(seen.quaternion[own], scalar_first=True).inv()
        looked_at = turned.apply(np.array(problem.sky.b_field_eci)[own]) / channel.sigma
    terms = np.column_stack([np.ones(len(own)), looked_at])
    width = known.shape[1]
    calibration = np.einsum("nt,ck->nctk", terms, np.eye(width)).reshape(len(own), width, -1)
    return wish_of(
        -seen.residual[own][:, columns][known],
        seen.jacobian[own][:, columns][..., finite][known],
        seen.covariance[np.ix_(finite, finite)],
        calibration[known],
        noise=(channel.quantum or 0.0) / np.sqrt(12.0) / channel.sigma,
        chi2_p=chi2_p,
    )


def _memory(t: np.ndarray, residual: np.ndarray, mask: np.ndarray) -> tuple[PanelResiduals, ...]:
    """Diagnostics of each column of residuals [time columns], of those that `mask` says were fitted."""
    slot = slots(t)
    return tuple(panel_residuals(residual[mask[:, k], k], slot[mask[:, k]]) for k in range(residual.shape[1]))


def _holdout(residual, promised, mask, outliers, sigma, angle, jacobian, cov) -> Holdout | None:
    if not mask.any():
        return None
    rms, promise = (float(np.sqrt((array[mask] ** 2).mean()) * sigma) for array in (residual, promised))
    seen = angle[mask.any(axis=1) & np.isfinite(angle)]
    angle_deg = float(np.median(seen)) if len(seen) else None
    return Holdout(int(mask.sum()), outliers, rms, promise, angle_deg, scatter_directions(jacobian[mask], cov))


def _angles(sensor: AbstractSensor, measured: np.ndarray, modelled: np.ndarray) -> np.ndarray:
    """[time] angle between what the calibration makes of measured and of modelled readings [deg]; NaN for none."""
    if sensor.sees not in ("field", "sun", "nadir", "attitude"):
        return np.full(len(measured), np.nan)
    found = [sensor.direct(readings, 1e-9) for readings in (measured, modelled)]
    if found[0] is None or found[1] is None:
        return np.full(len(measured), np.nan)
    a, b = (np.asarray(each[0], float) for each in found if each is not None)
    return np.degrees(angle_between_attitudes(a, b) if sensor.sees == "attitude" else angles_between(a, b))


def _alternatives(found: Identified, seen: Look, within: float) -> list[dict]:
    """Other minima whose motion or whose axes differ, by the rise of chi2.

    Other axes of the same motion are a sensor turned back by its own turn: farther than chance they are none.
    """
    best, others = found.minima[0], []
    q, own = seen.quaternion[: found.fitted], best.convention.spelt()
    for minimum in found.minima:
        axes = minimum.convention.spelt()
        for k in range(len(minimum.refined.score)):
            distance, other = other_minimum(minimum.refined, k, q, best.refined.score[0])
            turned = axes != own and (other["chi2_above_best"] < within or not found.parameters.free_motion)
            if distance > DIFFERENT_ATTITUDE_DEG or turned:
                others.append({**other, "axes": axes})
    return sorted(others, key=lambda other: other["chi2_above_best"])
