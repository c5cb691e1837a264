"""An orbit given by states at uniform times, joined by Hermite polynomials."""

import functools
import math

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from jaxsat.environment.orbit.abstract import AbstractOrbit

WINDOW = 4
"""Samples that one polynomial passes through: with position and velocity at each its degree is seven."""
LEAST_INTERVALS = 16
"""Numbers of intervals of an orbit that is sampled for a span are multiples of it: see `few_sizes`."""
# A time this fraction of a step beyond the ends still counts as inside: sums of steps end a rounding error later.
_SLACK = 1e-6


class SampledOrbit(AbstractOrbit):
    """An orbit through given states, uniform in time; a polynomial of degree seven through the four nearest.

    The position's error is at most 0.316/8! h^8 |d^8 r/dt^8| (Hermite's remainder; 2.8 times that in the first and the
    last interval). For a circular orbit of 7000 km: 16 nm at h = 60 s, 0.1 mm at 180 s, 1 m at 600 s.
    The velocity is the exact derivative of the position, equal to the given one at the samples.
    Outside the samples the state is NaN; `check_span` says so beforehand.
    """

    start: Float[Array, ""]
    """Time of the first sample [s]."""
    step: Float[Array, ""]
    """Time between samples [s], positive."""
    position_eci: Float[Array, "samples 3"]
    """Positions, true equator and equinox of date [m]."""
    velocity_eci: Float[Array, "samples 3"]
    """Velocities, the derivatives of the positions' components [m/s]."""

    def __init__(
        self,
        start: int | float | Float[Array, ""],
        step: int | float | Float[Array, ""],
        position_eci: Float[Array | np.ndarray, "samples 3"],
        velocity_eci: Float[Array | np.ndarray, "samples 3"],
    ):
        """Take up samples, whose precision rules; raises ValueError for fewer than four or a step not positive."""
        if position_eci.shape[0] < WINDOW:
            raise ValueError(f"position_eci must hold at least {WINDOW} samples, got {position_eci.shape[0]}")
        if not isinstance(step, Tracer) and not float(step) > 0.0:
            raise ValueError(f"step must be positive, got {step}")
        self.position_eci, self.velocity_eci = jnp.asarray(position_eci), jnp.asarray(velocity_eci)
        self.start, self.step = (jnp.asarray(np.asarray(x) if isinstance(x, int | float) else x) for x in (start, step))
        self.start, self.step = (x.astype(self.position_eci.dtype) for x in (self.start, self.step))

    @property
    def end(self) -> Float[Array, ""]:
        """Time of the last sample [s]."""
        return self.start + self.step * (self.position_eci.shape[0] - 1)

    def __call__(self, t: Float[Array, ""]) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
        """Return position [m] and velocity [m/s], inertial frame, `t` seconds after the epoch; NaN outside the span."""
        return interpolated(t, self.start, self.step, self.position_eci, self.velocity_eci)

    def check_span(self, times: np.ndarray) -> None:
        """Raise ValueError unless all `times` [s] lie between the first sample and the last."""
        check_sampled(times, self.start, self.step, self.position_eci.shape[0])


def check_sampled(times: np.ndarray, start: Float[Array, ""], step: Float[Array, ""], samples: int) -> None:
    """Raise ValueError unless all `times` [s] lie within uniform samples; nothing can be asked of traced ones."""
    if isinstance(start, Tracer) or isinstance(step, Tracer):
        return
    first, slack, times = float(start), _SLACK * float(step), np.asarray(times)
    last = first + float(step) * (samples - 1)
    outside = ~((times >= first - slack) & (times <= last + slack))
    if np.any(outside):
        raise ValueError(f"times must lie in {first:g}..{last:g} s, where samples are; got {times[outside][0]:g} s")


def interpolated(
    t: Float[Array, ""],
    start: Float[Array, ""],
    step: Float[Array, ""],
    values: Float[Array, "samples k"],
    rates: Float[Array, "samples k"],
) -> tuple[Float[Array, "k"], Float[Array, "k"]]:
    """Return value and rate at `t` of the curve through uniform samples of both; NaN outside them."""
    last = values.shape[0] - 1
    s = (t - start) / step
    first = jnp.clip(jnp.floor(s).astype(int) - (WINDOW // 2 - 1), 0, last - (WINDOW - 1))
    near_values, near_rates = (jax.lax.dynamic_slice_in_dim(x, first, WINDOW) for x in (values, rates))
    # About the middle of the window, where the powers are smallest.
    x = s - first.astype(s.dtype) - 0.5 * (WINDOW - 1)
    value, slope = hermite(x, near_values, step * near_rates)
    inside = (s >= -_SLACK) & (s <= last + _SLACK)
    return jnp.where(inside, value, jnp.nan), jnp.where(inside, slope / step, jnp.nan)


def hermite(
    x: Float[Array, ""], values: Float[Array, "n k"], slopes: Float[Array, "n k"]
) -> tuple[Float[Array, "k"], Float[Array, "k"]]:
    """Return the polynomial of degree 2n - 1 through values and slopes at n nodes one apart, and its derivative, at x.

    The nodes are centred on x = 0: -(n-1)/2 ... (n-1)/2 (Hildebrand 1956, section 8.2).
    """
    table = jnp.asarray(hermite_coefficients(values.shape[0]), x.dtype)
    powers = [jnp.ones_like(x)]
    for _ in range(table.shape[1] - 1):
        powers.append(powers[-1] * x)
    rates = [jnp.zeros_like(x), *(k * power for k, power in enumerate(powers[:-1], 1))]
    weights = jnp.matmul(jnp.stack([jnp.stack(powers), jnp.stack(rates)]), table.T, precision="highest")
    both = jnp.matmul(weights, jnp.concatenate([values, slopes]), precision="highest")
    return both[0], both[1]


@functools.cache
def hermite_coefficients(n: int) -> np.ndarray:
    """Coefficients, by rising powers, of `hermite`'s polynomials that take up the n values and then the n slopes."""
    nodes = np.arange(n) - 0.5 * (n - 1)
    of_values, of_slopes = [], []
    for k, node in enumerate(nodes):
        others = np.delete(nodes, k)
        square = (np.polynomial.Polynomial.fromroots(others) / np.prod(node - others)) ** 2
        away = np.polynomial.Polynomial([-node, 1.0])
        of_values.append((square * (1.0 - 2.0 * np.sum(1.0 / (node - others)) * away)).coef)
        of_slopes.append((square * away).coef)
    return np.array(of_values + of_slopes)


def sample_orbit(orbit: AbstractOrbit, *, start: int | float, stop: int | float, step: int | float) -> SampledOrbit:
    """Return samples of another orbit from `start` to `stop` [s], every `step` [s] or less.

    What a series of many terms, such as the Sun's or the Moon's, costs once instead of at each stage of a propagation:
    samples an hour apart follow both to a millimetre, the rounding of their argument of time.
    """
    if not (np.isfinite([start, stop]).all() and stop > start and step > 0.0):
        raise ValueError(f"start, stop and step must satisfy start < stop and step > 0, got {start}, {stop}, {step}")
    orbit.check_span(np.array([start, stop], float))
    intervals = max(math.ceil((stop - start) / step), WINDOW - 1)
    times = jnp.asarray(np.linspace(start, stop, intervals + 1))
    return SampledOrbit(start, (stop - start) / intervals, *_states(orbit, times))


@eqx.filter_jit
def _states(
    orbit: AbstractOrbit, times: Float[Array, "samples"]
) -> tuple[Float[Array, "samples 3"], Float[Array, "samples 3"]]:
    return jax.vmap(orbit)(times)
