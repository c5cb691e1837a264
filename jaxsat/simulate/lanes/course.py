"""What lanes go through: surroundings as polynomials, and the times at which their steps end."""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxsat.environment.cells import Cells, tabulate_cells
from jaxsat.environment.shadow import ConeShadow, CylinderShadow
from jaxsat.environment.surroundings import Surroundings
from jaxsat.simulate.checks import check_table
from jaxsat.simulate.lanes.lane import Mark
from jaxsat.simulate.lanes.lane_loop import Course, Marks
from jaxsat.simulate.tabulating import Tabulate, bucket, jumps, tabulated

SHARE = 1e-3
"""Of the tolerance of an attitude [rad], in what surrounds the satellite, over its largest value."""
FINEST = 1e-11
"""Better than that no polynomial is, for rounding."""


@dataclasses.dataclass(frozen=True)
class Layout:
    """A course and what the host knows of it."""

    course: Course
    marks: Float[np.ndarray, " marks"]
    """Times of the marks [s], without their padding."""
    place: np.ndarray
    """Where the state at each requested time is kept."""

    @property
    def places(self) -> int:
        """How many states are kept."""
        return int(self.place.max(initial=-1)) + 1


def lay_course(
    surroundings: Tabulate, times: np.ndarray, start: float, tolerance: float, caller: str, dtype: np.dtype
) -> Layout:
    """From `start` through monotonic `times` [s] for attitudes within `tolerance` [rad]; numbers of lanes are `dtype`.

    Raises ValueError where what surrounds the satellite is not finite or not smooth.
    """
    shadow, stops = None, jumps(surroundings)
    smooth = surroundings
    if isinstance(surroundings, Surroundings):
        smooth = dataclasses.replace(surroundings, commands=None, field_rate=False)
        if surroundings.sun is not None:
            # A cylinder without a width shadows nothing.
            smooth = dataclasses.replace(smooth, shadow=CylinderShadow(0.0))
            shadow = surroundings.shadow or ConeShadow()

    def tabulate(times):
        table = tabulated(smooth, times)
        check_table(table, caller)
        return table

    end = float(times[-1]) if len(times) else start
    wanted = max(SHARE * tolerance, FINEST)
    length, count, powers = tabulate_cells(tabulate, start, end, tolerance=wanted)
    direction = -1.0 if end < start else 1.0
    requested, place = np.unique(direction * times, return_inverse=True)
    at = requested
    if stops is not None:
        between = direction * stops
        at = np.union1d(at, between[(direction * start < between) & (between < direction * end)])
    kept = np.where(np.isin(at, requested), np.searchsorted(requested, at), len(requested))
    at = direction * at
    cell = np.clip(np.floor((at - start) / length), 0, count - 1).astype(np.int32)
    pad = functools.partial(np.pad, pad_width=(0, bucket(len(at)) - len(at)), mode="edge")
    commands = surroundings.commands if isinstance(surroundings, Surroundings) else None
    held = None if commands is None else commands(np.concatenate([[start], at]))
    held = jax.tree.map(lambda x: jnp.asarray(pad(x[1:]), dtype), held)
    since = jnp.asarray(pad((at - start) - cell * length), dtype)
    marks = Marks(
        Mark(jnp.asarray(pad(cell)), since, held),
        jnp.asarray(pad(kept.astype(np.int32))),
        jnp.asarray(len(at), jnp.int32),
    )
    cells = Cells(jnp.asarray(length, dtype), jnp.asarray(count, jnp.int32), shadow)
    powers = jax.tree.map(lambda x: jnp.asarray(x, dtype), powers)
    return Layout(Course(cells, powers, marks), at, place)
