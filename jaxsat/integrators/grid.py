"""Steps laid through requested times on the host, and the nodes at which a method wants the environment."""

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float, Int

from jaxsat.math.runge_kutta import RK4, Tableau

BLOCK = 4
"""Steps that `integrate_blocks` takes between two looks at its traced length; grids are padded to a multiple of it."""


class StepGrid(eqx.Module):
    """Steps that pass through every requested time; padding steps have length 0 and stand at the end."""

    step: Float[Array | np.ndarray, " steps"]
    """Length of each step [s], negative where time runs backward."""
    node_times: Float[Array | np.ndarray, " nodes"]
    """Start, inner nodes and end of each step, ends shared between neighbours [s]."""
    sample_index: Int[Array | np.ndarray, " samples"]
    """State number (0 is the initial one) that stands at each requested time."""

    @property
    def sample_node(self) -> Int[Array | np.ndarray, " samples"]:
        """Node number that stands at each requested time: where to read a table of the grid."""
        return self.sample_index * ((self.node_times.shape[0] - 1) // max(self.step.shape[0], 1))

    @staticmethod
    def through(
        times: np.ndarray,
        *,
        start: float,
        max_step: float,
        tableau: Tableau = RK4,
        stops: np.ndarray | None = None,
        pad_samples: int = 1,
        pad_steps: int = BLOCK,
    ) -> "StepGrid":
        """Grid from `start` through monotonic `times` [s] with steps of at most `max_step`, for one method.

        The numbers of samples and of steps are padded to multiples of `pad_samples` and `pad_steps`, so that files of
        like shape share one compiled program. Steps end at the `stops` [s] on the way too, such as `Commands.jumps`.
        Raises ValueError where the times are not monotonic or leave `start` on both sides, and where `max_step` is not
        positive.
        """
        if not max_step > 0:
            raise ValueError(f"StepGrid.through: max_step must be positive, got {max_step}")
        times = np.asarray(times, dtype=float)
        gaps = np.diff(np.concatenate([[start], times]))
        if not (np.all(gaps >= 0) or np.all(gaps <= 0)):
            raise ValueError("StepGrid.through: times must run in one direction away from `start`")
        marks = times if stops is None else _with_stops(times, start, np.asarray(stops, float))
        gaps = np.diff(np.concatenate([[start], marks]))
        counts = np.ceil(np.abs(gaps) / max_step * (1 - 1e-12)).astype(int)
        steps = np.repeat(gaps / np.maximum(counts, 1), counts)
        index = np.cumsum(counts)
        steps = np.pad(steps, (0, -len(steps) % pad_steps))
        ends = start + np.cumsum(steps)
        # Land on the requested times exactly: rounding must not put a node across a shadow edge from its sample.
        ends[index[counts > 0] - 1] = marks[counts > 0]
        index = index if stops is None else index[np.searchsorted(np.abs(marks - start), np.abs(times - start))]
        index = np.pad(index, (0, -len(index) % pad_samples), mode="edge")
        return StepGrid(steps, _nodes(np.concatenate([[start], ends]), tableau), index)

    def blocks_to(self, sample: int) -> Int[np.ndarray, ""]:
        """Blocks of steps that lead to a sample, by its number."""
        return np.asarray(-(-int(np.asarray(self.sample_index)[sample]) // BLOCK))

    @staticmethod
    def along(
        edges: Float[np.ndarray, " edges"], parts: Int[np.ndarray, " steps"], times: np.ndarray, tableau: Tableau
    ) -> "StepGrid":
        """Grid over given steps from edge to edge [s], each in a number of equal parts; `times` are among the edges."""
        share = (np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)) / np.repeat(parts, parts)
        begins = np.repeat(edges[:-1], parts) + np.repeat(np.diff(edges), parts) * share
        edges = np.concatenate([begins, edges[-1:]])
        order = -1.0 if edges[-1] < edges[0] else 1.0
        index = np.searchsorted(order * edges, order * np.asarray(times, float))
        edges = np.pad(edges, (0, -len(begins) % BLOCK), mode="edge")
        return StepGrid(np.diff(edges), _nodes(edges, tableau), index)


def _nodes(edges: Float[np.ndarray, " edges"], tableau: Tableau) -> Float[np.ndarray, " nodes"]:
    c = np.asarray(tableau.inner_nodes)
    inner = (1.0 - c) * edges[:-1, None] + c * edges[1:, None]
    return np.concatenate([np.concatenate([edges[:-1, None], inner], axis=1).reshape(-1), edges[-1:]])


def _with_stops(times: np.ndarray, start: float, stops: np.ndarray) -> np.ndarray:
    """Requested times and the stops on the way to the last of them, in order."""
    last = times[-1]
    between = stops[(np.minimum(start, last) < stops) & (stops < np.maximum(start, last))]
    marks = np.unique(np.concatenate([times, between]))
    return marks[::-1] if last < start else marks
