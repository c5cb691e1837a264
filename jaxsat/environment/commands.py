"""What was commanded on board, by the columns of the telemetry: currents of coils, speeds of wheels.

Between two rows a coil holds its command and a wheel's speed goes over in a straight line. With NumPy times all of it
is done on the host.
"""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

AT_ROW = 1e-6
"""A time is that of a row if it is no farther from it [s]."""

Values = Float[Array | np.ndarray, "*times"]


class Commands(eqx.Module):
    """Columns of commands with rows of their own; made by `Commands.of`, which checks them."""

    held: Mapping[str, tuple[Float[np.ndarray, " rows"], Float[np.ndarray, " rows"]]]
    """Times [s] and values of columns that stay as they are until the next row."""
    linear: Mapping[str, tuple[Float[np.ndarray, " rows"], Float[np.ndarray, " rows"]]]
    """Those that change in a straight line from row to row."""

    @staticmethod
    def of(
        columns: Mapping[str, tuple[np.ndarray, np.ndarray]],
        *,
        held: tuple[str, ...] = (),
        linear: tuple[str, ...] = (),
    ) -> "Commands":
        """Commands from columns as times [s] and values, NaN where a row has none.

        Raises ValueError where a column is missing or has no values, and where its times do not rise.
        """
        return Commands(*({name: _known_rows(columns, name) for name in names} for names in (held, linear)))

    def __call__(self, times: Float[Array | np.ndarray, "*times"]) -> tuple[dict[str, Values], dict[str, Values]]:
        """Values of all columns at `times` [s], and the rates of the linear ones [1/s].

        Outside the rows the first and the last value hold. At the instant of a row itself, where a held value or a rate
        may jump, it is the mean of both sides: two steps that share this node then have the right impulse together.
        """
        xp: Any = jnp if isinstance(times, jax.Array) else np
        values, rates = {name: _mean(xp, times, *rows) for name, rows in self.held.items()}, {}
        for name, (at, value) in self.linear.items():
            values[name] = xp.interp(times, xp.asarray(at, times.dtype), xp.asarray(value, times.dtype))
            rates[name] = _mean(xp, times, *_slopes(xp, at, value))
        return values, rates

    def jumps(self) -> Float[np.ndarray, " jumps"]:
        """Times [s] at which a held value or a rate jumps: a grid through them loses no accuracy."""
        pieces = [*self.held.values(), *(_slopes(np, *rows) for rows in self.linear.values())]
        found = [edges[1:][np.diff(values) != 0.0] for edges, values in pieces]
        return np.unique(np.concatenate([np.zeros(0), *found]))


def _known_rows(columns, name):
    if name not in columns:
        raise ValueError(f"Commands: there is no column {name!r}; there are {', '.join(sorted(columns)) or 'none'}")
    times, values = (np.asarray(x, float) for x in columns[name])
    known = np.isfinite(times) & np.isfinite(values)
    times, values = times[known], values[known]
    if not len(times):
        raise ValueError(f"Commands: column {name!r} has no values")
    if np.any(np.diff(times) <= 0.0):
        raise ValueError(f"Commands: the times of column {name!r} must rise")
    return times, values


def _slopes(xp, times, values):
    """Beginnings and values of the pieces in which the rate of a linear column is constant."""
    none = xp.zeros(1, values.dtype)
    return xp.concatenate([times[:1], times]), xp.concatenate([none, xp.diff(values) / xp.diff(times), none])


def _mean(xp, times, edges, values):
    """Mean of what is held just before and just after each time."""
    edges, values = xp.asarray(edges, times.dtype), xp.asarray(values, times.dtype)
    before = xp.searchsorted(edges, times - AT_ROW, side="left") - 1
    after = xp.searchsorted(edges, times + AT_ROW, side="right") - 1
    return 0.5 * (values[xp.maximum(before, 0)] + values[xp.maximum(after, 0)])
