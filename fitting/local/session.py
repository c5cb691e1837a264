"""The local methods on all samples of a session at once, in chunks on all cores."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.local.five_parameter import MIN_CURRENT_MA, MIN_PANELS, compromise_start, fit_five_parameters
from fitting.local.roll_search import roll_minima
from fitting.local.solutions import LocalSolutions, ranked
from fitting.local.sun_body import SIDES, possible_sides, sun_on_sides
from jaxsat.environment import LightTable
from jaxsat.sensors.solar_panels import Albedo, direct_currents
from jaxsat.spacecraft import SolarPanels

CHUNK = 512
DARK = "no panel shows light"
FEW_PANELS = f"fewer than {MIN_PANELS} panels show {MIN_CURRENT_MA:g} mA"
_UNSEEN = 1e-9
"""Of the largest eigenvalue: below it, an eigenvalue of the information is zero but for rounding."""


@dataclass(frozen=True)
class LocalSamples:
    """Samples with the light and the field that they met, SI."""

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


def solve_field_roll(samples: LocalSamples, *, max_albedo: float = 1.0) -> LocalSolutions:
    """Attitude of each sample with x along the field or against it (`OrbfiGraf`); see `roll_minima`."""
    minima = _in_chunks(
        _rolls,
        (samples.currents, samples.b_field_eci, samples.light),
        (samples.panels, samples.earth, jnp.asarray(max_albedo)),
    )
    dark = np.max(samples.currents, axis=1, initial=0.0) < 1e-3 * MIN_CURRENT_MA
    rms = np.where(dark[:, None], np.inf, minima.fit.rms)
    strongest = np.max(samples.currents**2, axis=1)[:, None]
    seen = minima.information > _UNSEEN * strongest
    sigma = np.where(seen, samples.noise / np.sqrt(np.where(seen, minima.information, 1.0)), np.inf)
    return ranked(
        minima.fit.quaternion,
        rms,
        (minima.fit.direct, minima.fit.albedo),
        sigma,
        b_field_eci=samples.b_field_eci,
        noise=samples.noise,
        unsolved=dict.fromkeys(np.flatnonzero(dark).tolist(), DARK),
    )


def solve_five_parameters(
    samples: LocalSamples, *, max_albedo: float | None = None, direct_sigma: float | None = None
) -> LocalSolutions:
    """Attitude and two factors of each sample with enough panels lit (`OptLoc`); see `fit_five_parameters`.

    Every assignment of the pairs that both show light is tried, with x along the field and against it; solutions in
    which the Sun lights a panel that was said to show the Earth's light only are dropped. `direct_sigma` is the
    relative 1-sigma of the panels' largest current where it is known: the factor of the direct light is then near 1.
    """
    enough = np.sum(samples.currents >= 1e-3 * MIN_CURRENT_MA, axis=1) >= MIN_PANELS
    allowed = possible_sides(samples.currents, 1e-3 * MIN_CURRENT_MA) & enough[:, None]
    number, side = np.nonzero(allowed)
    number, side = np.repeat(number, 2), np.repeat(side, 2)
    sign = np.tile([1.0, -1.0], len(number) // 2)
    light = jax.tree.map(lambda leaf: np.asarray(leaf)[number], samples.light)
    limit = None if max_albedo is None else jnp.asarray(max_albedo)
    weight = None if direct_sigma is None else jnp.asarray(samples.noise / direct_sigma)
    found, consistent = _in_chunks(
        _fits,
        (samples.currents[number], samples.b_field_eci[number], light, SIDES[side], sign),
        (samples.panels, samples.earth, limit, weight),
    )
    place = 2 * np.concatenate([np.arange(k) for k in allowed.sum(axis=1)] or [[]]).astype(int).repeat(2)
    place += np.arange(len(place)) % 2
    shape = (len(samples.currents), max(2 * int(allowed.sum(axis=1).max(initial=0)), 1))

    def spread(values, empty):
        full = np.full((*shape, *values.shape[1:]), empty)
        full[number, place] = values
        return full

    least = np.linalg.eigvalsh(found.information) if len(number) else np.zeros((0, 3))
    seen = least[:, 0] > _UNSEEN * least[:, 2]
    sigma = np.where(seen, samples.noise / np.sqrt(np.where(seen, least[:, 0], 1.0)), np.inf)
    return ranked(
        spread(found.fit.quaternion, 0.5),
        spread(np.where(consistent, found.fit.rms, np.inf), np.inf),
        (spread(found.fit.direct, np.nan), spread(found.fit.albedo, np.nan)),
        spread(sigma, np.nan),
        b_field_eci=samples.b_field_eci,
        noise=samples.noise,
        unsolved=dict.fromkeys(np.flatnonzero(~enough).tolist(), FEW_PANELS),
    )


@eqx.filter_jit
def _rolls(arrays, fixed):
    panels, earth, max_albedo = fixed
    return jax.vmap(lambda m, b, light: roll_minima(m, b, panels, earth, light, max_albedo))(*arrays)


@eqx.filter_jit
def _fits(arrays, fixed):
    panels, earth, limit, weight = fixed

    def one(measured, field, light, positive, sign):
        start = compromise_start(sun_on_sides(measured, positive), field, light.sun_eci, sign)
        sunny = jnp.stack([positive, ~positive], axis=1).ravel().astype(measured.dtype)
        found = fit_five_parameters(
            start, measured, panels, earth, light, sunny=sunny, max_albedo=limit, direct_weight=weight
        )
        direct = found.fit.direct * direct_currents(found.fit.quaternion, panels, light)
        return found, jnp.all((1.0 - sunny) * direct < 1e-3 * MIN_CURRENT_MA)

    return jax.vmap(one)(*arrays)


def _in_chunks(program: Callable[..., Any], arrays: tuple, fixed: tuple) -> Any:
    """A program over arrays of samples: chunks of one shape, the last padded, as many at once as there are cores."""
    count = len(arrays[0])
    chunks = max(-(-count // CHUNK), 1)
    size = CHUNK if chunks > 1 else max(count, 1)
    which = np.minimum(np.arange(chunks * size), max(count - 1, 0)).reshape(chunks, size)
    if not count:
        arrays = jax.tree.map(lambda leaf: np.zeros((1, *leaf.shape[1:]), leaf.dtype), arrays)
    parts = [jax.tree.map(lambda leaf, w=w: np.asarray(leaf)[w], arrays) for w in which]
    with ThreadPoolExecutor(min(os.cpu_count() or 1, chunks)) as pool:
        done = list(pool.map(lambda part: jax.tree.map(np.asarray, program(part, fixed)), parts))
    return jax.tree.map(lambda *leaves: np.concatenate(leaves)[:count], *done)
