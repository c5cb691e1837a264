"""Derivatives of a metric by random inputs, over all of them: mean, size, and what they say of Sobol indices.

For a function f of independent inputs x the measures of Sobol & Kucherenko 2009 (with Kucherenko et al. 2009 for the
mean size) are

    nu_i = E[(df/dx_i)^2],    E[|df/dx_i|],    E[df/dx_i],

the last of which is the derivative of the mean by a shift of the input. The total Sobol index is bounded,
S_Ti <= C_i nu_i / V, with the Poincare constant C_i of the input: its variance where it is normal, (b - a)^2/pi^2 where
it is uniform (Lamboni et al. 2013). Of a function that jumps, as a settling time that is counted in control periods,
derivatives say nothing of the jumps: `fitting.sensitivity.means` has derivatives of means there.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

CHUNK = 256
"""Points that are differentiated at once; the last chunk is filled up, so that all have one shape."""


def poincare_normal(sigma: float) -> float:
    """Poincare constant of a normal input: its variance."""
    return sigma**2


def poincare_uniform(low: float, high: float) -> float:
    """Poincare constant of an input that is uniform from `low` to `high`."""
    return ((high - low) / math.pi) ** 2


@dataclass(frozen=True)
class DerivativeMeasures:
    """Of one output by the components of an input; standard errors are those of the mean over the points."""

    points: int
    """That count: those whose output and derivatives are all finite."""
    mean: float
    """Of the output."""
    variance: float
    mean_derivative: np.ndarray
    """[components]"""
    mean_derivative_error: np.ndarray
    mean_size: np.ndarray
    """Of the derivative without its sign [components]."""
    mean_square: np.ndarray
    """nu [components]"""
    mean_square_error: np.ndarray

    def bounds(self, poincare: np.ndarray) -> np.ndarray:
        """What the total indices cannot exceed [components], by the Poincare constants of independent components."""
        return np.asarray(poincare) * self.mean_square / self.variance


def derivative_measures(
    function: Callable[[Float[Array, " components"]], Mapping[str, Float[Array, ""]]],
    inputs: Float[np.ndarray, "points components"],
    *,
    chunk: int = CHUNK,
) -> dict[str, DerivativeMeasures]:
    """Measures of each named output of a function of one input vector, over random points of it.

    Derivatives are exact, forward mode (`jax.jacfwd`), `chunk` points at once in one compiled program. Points where the
    output or a derivative is not finite do not count, and are missing in `points`. Raises ValueError where no two
    points count, or an output is no single number.
    """
    points = np.asarray(inputs)
    if points.ndim != 2 or len(points) < 2 or not np.isfinite(points).all():
        raise ValueError(f"inputs: expected finite numbers [points components], two points or more, got {points.shape}")

    def both(x):
        found = function(x)
        return found, found

    compiled = jax.jit(jax.vmap(jax.jacfwd(both, has_aux=True)))
    parts = []
    for begin in range(0, len(points), chunk):
        own = points[begin : begin + chunk]
        filled = np.concatenate([own, np.repeat(own[-1:], chunk - len(own), axis=0)])
        parts.append(jax.device_get(compiled(jnp.asarray(filled))))
    slopes, values = jax.tree.map(lambda *leaves: np.concatenate(leaves)[: len(points)], *parts)
    return {name: _measures(name, np.asarray(values[name]), np.asarray(slopes[name])) for name in values}


def _measures(name: str, values: np.ndarray, slopes: np.ndarray) -> DerivativeMeasures:
    if values.ndim != 1:
        raise ValueError(f"output {name}: expected one number a point, got shape {values.shape[1:]}")
    good = np.isfinite(values) & np.isfinite(slopes).all(axis=1)
    count = int(good.sum())
    if count < 2:
        raise ValueError(f"output {name}: {count} of {len(values)} points have a finite value and derivatives")
    values, slopes = values[good], slopes[good]

    def error(rows):
        return rows.std(axis=0, ddof=1) / math.sqrt(count)

    return DerivativeMeasures(
        count,
        float(values.mean()),
        float(values.var(ddof=1)),
        slopes.mean(axis=0),
        error(slopes),
        np.abs(slopes).mean(axis=0),
        (slopes**2).mean(axis=0),
        error(slopes**2),
    )
