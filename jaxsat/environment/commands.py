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

Rows = Float[Array | np.ndarray, " _"]
Values = Float[Array | np.ndarray, "*times"]


class CommandTable(eqx.Module):
    """What is commanded along a table's times, by column; at a row's instant, where it jumps, on both sides of it."""

    values: dict[str, Values]
    """As a step that begins then meets them."""
    rates: dict[str, Values]
    """Of the columns that change in a straight line [1/s]."""
    values_before: dict[str, Values]
    """As a step that ends then meets them."""
    rates_before: dict[str, Values]


class Commands(eqx.Module):
    """Columns of commands with rows of their own; made by `Commands.of`, which checks them."""

    held: Mapping[str, tuple[Rows, Rows]]
    """Times [s] and values of columns that stay as they are until the next row; the first value holds before it too."""
    linear: Mapping[str, tuple[Rows, Rows]]
    """Those that change in a straight line from row to row; before the first and after the last one they stay."""

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

    def __call__(self, times: Float[Array | np.ndarray, " n"]) -> CommandTable:
        """What is commanded at `times` [s], in the order in which steps take them."""
        xp: Any = jnp if isinstance(times, jax.Array) else np
        held, lines, slopes = dict(self.held), {}, {}
        for name, (at, value) in self.linear.items():
            lines[name] = xp.interp(times, xp.asarray(at, times.dtype), xp.asarray(value, times.dtype))
            slopes[name] = _slopes(xp, at, value)
        backward = times[-1] < times[0]

        def sides(columns):
            found = {name: _sides(xp, times, *rows) for name, rows in columns.items()}
            later = {name: xp.where(backward, before, after) for name, (before, after) in found.items()}
            earlier = {name: xp.where(backward, after, before) for name, (before, after) in found.items()}
            return later, earlier

        (values, values_before), (rates, rates_before) = sides(held), sides(slopes)
        return CommandTable(values | lines, rates, values_before | lines, rates_before)

    def jumps(self) -> Float[np.ndarray, " jumps"]:
        """Times [s] at which a held value or a rate jumps: a grid with steps that end there loses no accuracy."""
        pieces = [*self.held.values(), *(_slopes(np, *rows) for rows in self.linear.values())]
        found = [edges[1:][np.diff(values) != 0.0] for edges, values in pieces]
        return np.unique(np.concatenate([np.zeros(0), *found]))


def _known_rows(columns, name):
    if name not in columns:
        raise ValueError(f"Commands: there is no column {name!r}; there are {', '.join(sorted(columns)) or 'none'}")
    times, values = (np.asarray(x, float) for x in columns[name])
    if times.ndim != 1 or times.shape != values.shape:
        raise ValueError(
            f"Commands: column {name!r} must have a value for each time, got {values.shape}, {times.shape}"
        )
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


def _sides(xp, times, edges, values):
    """What is held just before and just after each time."""
    edges, values = xp.asarray(edges, times.dtype), xp.asarray(values, times.dtype)
    before = xp.searchsorted(edges, times - AT_ROW, side="left") - 1
    after = xp.searchsorted(edges, times + AT_ROW, side="right") - 1
    return values[xp.maximum(before, 0)], values[xp.maximum(after, 0)]
