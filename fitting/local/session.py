"""The local methods on all samples of a session at once, in chunks on all cores."""

import dataclasses
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.local.five_parameter import MIN_CURRENT_MA, MIN_PANELS, compromise_start, fit_five_parameters
from fitting.local.off_axis import ROLL_AND_FACTORS, axis_off, roll_sigma
from fitting.local.roll_search import BOTH, roll_minima
from fitting.local.shares import explained
from fitting.local.solutions import AMBIGUOUS, DOES_NOT_FIT, LocalSolutions, ranked
from fitting.local.sun_and_field import SOLVED, TWO_SIGNS, sun_and_field_attitude
from fitting.local.sun_and_field import STATUSES as SUN_FIELD_STATUSES
from fitting.local.sun_body import SIDES, possible_sides, sun_on_sides
from jaxsat.environment import LightTable
from jaxsat.sensors.solar_panels import Albedo, direct_currents
from jaxsat.spacecraft import SolarPanels

CHUNK = 512
ALONG = (1.0,)
DARK = "no panel shows light"
OTHER_WAY = "body x the other way on the field's line: the Sun does not agree with the direction that was given"
FEW_PANELS = f"fewer than {MIN_PANELS} panels show {MIN_CURRENT_MA:g} mA"
NOT_ALONG = "most samples deny that the magnet is along the field"
NOT_AS_FAR_APART, APART_SIGMAS = "Sun and field are not as far apart as they must be", 4.0
MORE_ROUNDS, ARRIVED, HOPELESS = 4, 1e-5, 5.0
"""Further rounds of the search, for starts that have more than `ARRIVED` [rad] to go and leave less than `HOPELESS`
times what the best one of the sample does, or the noise."""
_UNSEEN = 1e-9
"""Of the largest eigenvalue: below it, an eigenvalue of the information is zero but for rounding."""


@dataclass(frozen=True)
class LocalSamples:
    """Samples with the light and the field that they met, SI."""

    t: np.ndarray
    """[samples] [s]."""
    currents: np.ndarray
    """[samples 6] +X -X +Y -Y +Z -Z [A]."""
    b_field_eci: np.ndarray
    """[samples 3] [T]."""
    light: LightTable
    panels: SolarPanels
    earth: Albedo
    """Pattern of the albedo."""
    noise: float
    """1-sigma of a current [A]."""
    axis_body: np.ndarray = field(default_factory=lambda: np.array([1.0, 0.0, 0.0]))
    """[3] unit vector of the body that a magnet holds along the field."""


def solve_field_roll(
    samples: LocalSamples, *, max_albedo: float = 1.0, directions: tuple[float, ...] = BOTH
) -> LocalSolutions:
    """Attitude of each sample with the axis along the field, +1, or against it, -1 (`OrbfiGraf`); see `roll_minima`.

    How far the axis is off the field is told by the residuals of all samples, and is part of each sigma.
    """
    minima = _in_chunks(
        _rolls,
        (samples.currents, samples.b_field_eci, samples.light),
        (samples.panels, samples.earth, jnp.asarray(max_albedo), jnp.asarray(samples.axis_body), directions),
    )
    dark = np.max(samples.currents, axis=1, initial=0.0) < 1e-3 * MIN_CURRENT_MA
    rms = np.where(dark[:, None], np.inf, minima.fit.rms)
    panels = samples.currents.shape[1]
    freedom = panels - ROLL_AND_FACTORS
    off = axis_off(minima.slopes[~dark, 0], panels * rms[~dark, 0] ** 2, samples.axis_body, samples.noise)
    strongest = np.max(samples.currents**2, axis=1)[:, None]
    seen = np.sum((minima.slopes @ samples.axis_body) ** 2, axis=-1) > _UNSEEN * strongest
    result = ranked(
        minima.fit.quaternion,
        rms,
        (minima.fit.direct, minima.fit.albedo),
        roll_sigma(minima.slopes, samples.axis_body, samples.noise, off, seen),
        b_field_eci=samples.b_field_eci,
        axis_body=samples.axis_body,
        noise=samples.noise,
        scatter=float(np.sqrt(panels * np.mean(rms[~dark, 0] ** 2) / freedom)) if not dark.all() else 0.0,
        freedom=freedom,
        unsolved=dict.fromkeys(np.flatnonzero(dark).tolist(), DARK),
        field_first=False,
    )
    result = dataclasses.replace(result, axis_off=off)
    if result.fits or not result.count.any():
        return result
    # Three currents are left over in a sample: where the axis is off, some will agree by chance.
    verdicts = [
        (DOES_NOT_FIT, NOT_ALONG) if some and status != DOES_NOT_FIT else (status, reason)
        for some, status, reason in zip(result.count, result.status, result.reason, strict=True)
    ]
    status, reason = (tuple(each) for each in zip(*verdicts, strict=True))
    return dataclasses.replace(result, status=status, reason=reason)


def solve_five_parameters(
    samples: LocalSamples,
    *,
    max_albedo: float | None = None,
    direct_sigma: float | None = None,
    directions: tuple[float, ...] = ALONG,
) -> LocalSolutions:
    """Attitude and two factors of each sample with enough panels lit (`OptLoc`); see `fit_five_parameters`.

    Every assignment of the pairs that both show light is tried, with the magnet's axis at the start in the given
    `directions`, +1 along the field as published; solutions in which the Sun lights a panel that was said to show the
    Earth's light only are dropped. `direct_sigma` is the relative 1-sigma of the panels' largest current where it is
    known: the factor of the direct light is then near 1.
    """
    enough = np.sum(samples.currents >= 1e-3 * MIN_CURRENT_MA, axis=1) >= MIN_PANELS
    allowed = possible_sides(samples.currents, 1e-3 * MIN_CURRENT_MA) & enough[:, None]
    number, side = np.nonzero(allowed)
    ways = len(directions)
    sign = np.tile(directions, len(number))
    number, side = np.repeat(number, ways), np.repeat(side, ways)
    light = jax.tree.map(lambda leaf: np.asarray(leaf)[number], samples.light)
    limit = None if max_albedo is None else jnp.asarray(max_albedo)
    weight = None if direct_sigma is None else jnp.asarray(samples.noise / direct_sigma)
    measured, positive = samples.currents[number], SIDES[side]
    starts = _in_chunks(
        _starts, (measured, samples.b_field_eci[number], light.sun_eci, positive, sign), (samples.axis_body,)
    )
    fixed = (samples.panels, samples.earth, limit, weight)
    found, consistent = _in_chunks(_fits, (starts, measured, light, positive), fixed)
    for _ in range(MORE_ROUNDS):
        rms = np.where(consistent, found.fit.rms, np.inf)
        best = np.full(len(samples.currents), np.inf)
        np.minimum.at(best, number, rms)
        hopeful = found.fit.rms < HOPELESS * np.maximum(best[number], samples.noise)
        on = np.flatnonzero(hopeful & (found.slope > ARRIVED) & (found.fit.rms > 1e-6 * samples.noise))
        if not len(on):
            break
        part = (found.fit.quaternion[on], measured[on], jax.tree.map(lambda leaf, on=on: leaf[on], light), positive[on])
        further, agrees = _in_chunks(_fits, part, fixed, shaped_for=len(number))
        for whole, new in zip(jax.tree.leaves(found), jax.tree.leaves(further), strict=True):
            whole[on] = new
        consistent[on] = agrees
    # Each sample's starts stand one after another: the place among them is the distance from the first.
    place = np.arange(len(number)) - np.searchsorted(number, number)
    shape = (len(samples.currents), max(ways * int(allowed.sum(axis=1).max(initial=0)), 1))

    def spread(values, empty):
        full = np.full((*shape, *values.shape[1:]), empty)
        full[number, place] = values
        return full

    least = np.linalg.eigvalsh(found.information) if len(number) else np.zeros((0, 3))
    seen = least[:, 0] > _UNSEEN * least[:, 2]
    # Six currents less five unknowns leave one that tells of the model; with the largest current known it is two.
    freedom = 1 if direct_sigma is None else 2
    scatter = np.maximum(samples.noise, found.fit.rms * np.sqrt(samples.currents.shape[1] / freedom))
    sigma = np.where(seen, np.minimum(scatter / np.sqrt(np.where(seen, least[:, 0], 1.0)), np.pi), np.inf)
    return ranked(
        spread(found.fit.quaternion, 0.5),
        spread(np.where(consistent, found.fit.rms, np.inf), np.inf),
        (spread(found.fit.direct, np.nan), spread(found.fit.albedo, np.nan)),
        spread(sigma, np.nan),
        b_field_eci=samples.b_field_eci,
        axis_body=samples.axis_body,
        noise=samples.noise,
        freedom=freedom,
        unsolved=dict.fromkeys(np.flatnonzero(~enough).tolist(), FEW_PANELS),
    )


def solve_sun_field(
    samples: LocalSamples,
    field_body: np.ndarray,
    *,
    sun_sigma: float,
    field_sigma: float,
    max_albedo: float = 1.0,
    directions: tuple[float, ...] = BOTH,
) -> LocalSolutions:
    """Attitude of each sample from the Sun that the currents show and magnetometers (`OrSB`).

    `field_body` [samples 3] [T], NaN where an axis is not measured; see `sun_and_field_attitude`. The rms and the
    factors are those of the currents at that attitude. Where body x is not measured its sign may be known: +1 or -1 in
    `directions`, x within 90 deg of the field or of its opposite. Otherwise a Sun across x leaves both signs: both
    attitudes are listed, the one whose currents agree better first, which is no proof.
    """
    found, fit = _in_chunks(
        _directions,
        (samples.currents, field_body, samples.b_field_eci, samples.light),
        (samples.panels, samples.earth, *map(jnp.asarray, (sun_sigma, field_sigma, max_albedo))),
    )
    usable = np.isin(found.status, [SOLVED, TWO_SIGNS])
    # With three axes, or one sign plainly wrong, there is one candidate.
    rms = np.where(usable[:, None], fit.rms, np.inf)
    rms[found.status == SOLVED, 1] = np.inf
    known = np.isin(np.sign(found.field_body[..., 0]), (0.0, *directions)) | ~np.isnan(field_body[:, :1])
    rms[~known] = np.inf
    sigma = np.sqrt(np.max(np.linalg.eigvalsh(np.where(usable[:, None, None, None], found.covariance, 0.0)), axis=-1))
    reasons = dict.fromkeys(np.flatnonzero(~np.any(known & np.isfinite(rms), axis=1)).tolist(), OTHER_WAY)
    reasons |= {k: SUN_FIELD_STATUSES[found.status[k]] for k in np.flatnonzero(~usable).tolist()}
    result = ranked(
        found.quaternion,
        rms,
        (fit.direct, fit.albedo),
        sigma,
        b_field_eci=samples.b_field_eci,
        axis_body=samples.axis_body,
        noise=samples.noise,
        freedom=None,
        unsolved=reasons,
        field_first=False,
    )
    least = np.min(np.where(known & np.isfinite(rms), np.abs(found.mismatch), np.inf), axis=1)
    modulus = np.linalg.norm(samples.b_field_eci, axis=1)
    denied = (least > APART_SIGMAS * np.hypot(sun_sigma, field_sigma / modulus)) & (result.count > 0)
    two = (found.status == TWO_SIGNS) & (result.count > 1)
    verdicts = [
        (DOES_NOT_FIT, NOT_AS_FAR_APART) if no else (AMBIGUOUS, SUN_FIELD_STATUSES[TWO_SIGNS]) if both else as_ranked
        for no, both, *as_ranked in zip(denied, two, result.status, result.reason, strict=True)
    ]
    status, reason = (tuple(each) for each in zip(*verdicts, strict=True)) if verdicts else ((), ())
    return dataclasses.replace(result, status=status, reason=reason)


@eqx.filter_jit
def _directions(arrays, fixed):
    panels, earth, sun_sigma, field_sigma, max_albedo = fixed

    def one(measured, field_body, field, light):
        # The stronger panel of each pair; no light at all is a Sun of zeros.
        light_seen = jnp.where(jnp.max(measured) >= 1e-3 * MIN_CURRENT_MA, measured, 0.0) / panels.gains
        sun = sun_on_sides(light_seen, light_seen[0::2] >= light_seen[1::2])
        sun = jnp.where(light.illumination > 0.0, sun, 0.0)
        found = sun_and_field_attitude(sun, field_body, light.sun_eci, field, sun_sigma, field_sigma)
        fit = jax.vmap(lambda q: explained(q, measured, panels, earth, light, max_albedo))(found.quaternion)
        return found, fit

    return jax.vmap(one)(*arrays)


@eqx.filter_jit
def _rolls(arrays, fixed):
    panels, earth, max_albedo, axis_body, directions = fixed

    def one(measured, field, light):
        return roll_minima(measured, field, panels, earth, light, max_albedo, axis_body, directions=directions)

    return jax.vmap(one)(*arrays)


@eqx.filter_jit
def _starts(arrays, fixed):
    (axis_body,) = fixed

    def one(measured, field, sun_eci, positive, sign):
        return compromise_start(sun_on_sides(measured, positive), axis_body, sun_eci, sign * field)

    return jax.vmap(one)(*arrays)


@eqx.filter_jit
def _fits(arrays, fixed):
    panels, earth, limit, weight = fixed

    def one(start, measured, light, positive):
        sunny = jnp.stack([positive, ~positive], axis=1).ravel().astype(measured.dtype)
        found = fit_five_parameters(
            start, measured, panels, earth, light, sunny=sunny, max_albedo=limit, direct_weight=weight
        )
        direct = found.fit.direct * direct_currents(found.fit.quaternion, panels, light)
        return found, jnp.all((1.0 - sunny) * direct < 1e-3 * MIN_CURRENT_MA)

    return jax.vmap(one)(*arrays)


def _in_chunks(program: Callable[..., Any], arrays: tuple, fixed: tuple, *, shaped_for: int = 0) -> Any:
    """A program over arrays of samples: chunks of one shape, the last padded, as many at once as there are cores.

    `shaped_for` is the number of samples of an earlier call, whose compiled program then serves again.
    """
    count = len(arrays[0])
    if not count:
        one = jax.tree.map(lambda leaf: np.zeros((1, *leaf.shape[1:]), leaf.dtype), arrays)
        shapes = eqx.filter_eval_shape(program, one, fixed)
        return jax.tree.map(lambda leaf: np.zeros((0, *leaf.shape[1:]), leaf.dtype), shapes)
    size = min(CHUNK, max(count, shaped_for))
    chunks = -(-count // size)
    which = np.minimum(np.arange(chunks * size), count - 1).reshape(chunks, size)
    parts = [jax.tree.map(lambda leaf, w=w: np.asarray(leaf)[w], arrays) for w in which]
    with ThreadPoolExecutor(min(os.cpu_count() or 1, chunks)) as pool:
        done = list(pool.map(lambda part: jax.tree.map(np.asarray, program(part, fixed)), parts))
    return jax.tree.map(lambda *leaves: np.concatenate(leaves)[:count], *done)
