"""An orbit's table as polynomials: to be read at any time, in little memory, by steps that are not known beforehand."""

import dataclasses
import functools
from collections.abc import Callable

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Float, Int

from jaxsat.environment.shadow import ConeShadow, CylinderShadow
from jaxsat.environment.table import OrbitTable

LONGEST = 120.0
"""Length of a cell that is tried first [s]: a fiftieth of a low orbit."""
HALVINGS = 5
DEGREE = 8
_NODES = -np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
"""Where a cell is sampled, from -1 to 1; Chebyshev's."""
_PROBES = np.array([-1.25, -0.9, 0.9, 1.25])
"""Where its polynomials are compared with what they are to be: a step may go beyond the cell by half its length."""
_POWERS = np.linalg.inv(np.vander(_NODES, increasing=True))


class Cells(eqx.Module):
    """What surrounds a satellite over a span of time: cells of equal length, one after the other, a polynomial each."""

    length: Float[Array, ""]
    """Of a cell [s], negative where time runs backward."""
    count: Int[Array, ""]
    """How many; what comes after them is padding."""
    shadow: CylinderShadow | ConeShadow | None
    """What the solar pressure has still to be multiplied by: an edge that no polynomial follows."""

    def span(self, count: Int[Array, ""]) -> Float[Array, ""]:
        """Length of a number of cells [s]."""
        return count.astype(self.length.dtype) * self.length

    def read(self, polynomials: OrbitTable, since: Float[Array, ""]) -> OrbitTable:
        """The table, with the field's rate, at a time counted from the start of the polynomials' cell [s]."""
        x, per_second = 2.0 * since / self.length - 1.0, 2.0 / self.length
        table = jax.tree.map(lambda leaf: _sum_of_powers(leaf, x), polynomials)
        rate = per_second * _sum_of_powers(_differentiated(polynomials.b_field_eci), x)
        pressure = table.solar_pressure
        if self.shadow is not None:
            pressure = pressure * self.shadow(table.position_eci, table.sun_eci)
        return dataclasses.replace(table, b_rate_eci=rate, solar_pressure=pressure)

    def field_acceleration(self, polynomials: OrbitTable, since: Float[Array, ""]) -> Float[Array, "3"]:
        """Second derivative of the field's inertial components [T/s^2]."""
        x, per_second = 2.0 * since / self.length - 1.0, 2.0 / self.length
        return per_second**2 * _sum_of_powers(_differentiated(_differentiated(polynomials.b_field_eci)), x)


def _sum_of_powers(coefficients: Float[Array, "powers *rest"], x: Float[Array, ""]) -> Float[Array, "*rest"]:
    total = coefficients[-1]
    for power in range(coefficients.shape[0] - 2, -1, -1):
        total = total * x + coefficients[power]
    return total


def _differentiated(coefficients: Float[Array, "powers *rest"]) -> Float[Array, "fewer *rest"]:
    powers = np.arange(1.0, coefficients.shape[0]).reshape(-1, *(1,) * (coefficients.ndim - 1))
    return coefficients[1:] * powers


def tabulate_cells(
    tabulate: Callable[[Float[np.ndarray, " n"]], OrbitTable], start: float, end: float, *, tolerance: float
) -> tuple[float, int, OrbitTable]:
    """Length [s] and number of cells from `start` to `end` [s], and their polynomials: leaves [cells, powers, ...].

    They are within `tolerance` of the largest value of each entry; ValueError where no cells of some seconds are.
    """
    for halving in range(HALVINGS):
        count = max(1, int(np.ceil(abs(end - start) / LONGEST)) << halving)
        length = (end - start) / count or 1.0
        # Few shapes, few compilations.
        edges = start + length * np.minimum(np.arange(1 << (count - 1).bit_length()), count - 1)

        def at(places, edges=edges, length=length):
            times = edges[:, None] + 0.5 * length * (places + 1.0)
            times = np.clip(times, min(start, end), max(start, end))
            table = dataclasses.replace(tabulate(times.reshape(-1)), commands=None, b_rate_eci=None)
            return times, jax.tree.map(lambda x: np.asarray(x).reshape(*times.shape, *x.shape[1:]), table)

        powers = jax.tree.map(lambda x: np.einsum("pn,cn...->cp...", _POWERS, x), at(_NODES)[1])
        times, expected = at(_PROBES)
        vandermonde = (2.0 * (times - edges[:, None]) / length - 1.0)[..., None] ** np.arange(DEGREE + 1)
        found = jax.tree.map(functools.partial(np.einsum, "cnp,cp...->cn...", vandermonde), powers)
        worst = max(jax.tree.leaves(jax.tree.map(_largest_share, found, expected)))
        if worst <= tolerance:
            return length, count, powers
    raise ValueError(
        f"what surrounds the satellite is not smooth: polynomials over {abs(length):.1f} s miss it by {worst:.1e} of "
        f"its largest value, where {tolerance:.1e} is wanted"
    )


def _largest_share(found, expected) -> float:
    return float(np.max(np.abs(found - expected))) / (float(np.max(np.abs(expected))) or 1.0)
