"""A long arc in pieces, each from the last state of the one before, so that memory does not grow with its length."""

import dataclasses

import numpy as np
from jaxtyping import Float

from jaxsat.integrators import AdamsGrid
from jaxsat.simulate.tabulating import bucket

MEMORY = 128e6
"""That tables and kept states of one piece may take, roughly [B]."""
OF_TABLE, OF_STATE = 660, 60
"""Bytes of a step of a table with what tabulating it takes, and of one satellite's state."""
LEAST, MOST = 2048, 65536
"""Steps of a piece. In the least one a twentieth of the work is for its start by another method."""


@dataclasses.dataclass(frozen=True)
class Piece:
    """Steps from one time to another."""

    grid: AdamsGrid
    """Padded to as many steps and samples as all pieces of the arc have; the first sample is the piece's end."""
    count: np.ndarray
    """Steps taken."""
    samples: slice
    """Of all requested times, those that the grid's further samples are."""

    @property
    def read(self) -> slice:
        """Where the requested times stand among the grid's samples."""
        return slice(1, 1 + self.samples.stop - self.samples.start)


def most_steps(kept_states: int) -> int:
    """Steps of a piece of which the states of so many satellites are kept."""
    return int(np.clip(1 << int(np.log2(MEMORY / (OF_TABLE + OF_STATE * kept_states))), LEAST, MOST))


def pieces_of(
    times: Float[np.ndarray, " samples"], *, start: float, max_step: float, most: int, room: int = 0
) -> list[Piece]:
    """The arc from `start` through monotonic `times` [s] in pieces of about `most` steps; one where it is no longer.

    All are for one program, with room for `room` steps or more. A piece ends at a requested time where one is near.
    """
    whole = AdamsGrid.through(times, start=start, max_step=max_step)
    if whole.steps <= most:
        return _padded([(whole, slice(0, len(times)))], room)
    step, found, begin = float(whole.step), [], 0
    forward = np.sign(step)
    while begin < len(times):
        reach = start + most * step
        end = int(np.searchsorted(forward * times, forward * reach, side="right"))
        own = times[begin:end]
        last = reach if not len(own) or own[-1] == start else own[-1]
        grid = AdamsGrid.through(np.append(own, last), start=start, max_step=abs(step) * (1 + 1e-12))
        found.append((grid, slice(begin, end)))
        begin, start = end, float(last)
    return _padded(found, room)


def _padded(found: list[tuple[AdamsGrid, slice]], room: int) -> list[Piece]:
    room = max(room, bucket(max(grid.steps for grid, _ in found)))
    samples = max(own.stop - own.start for _, own in found)
    pieces = []
    for grid, own in found:
        # The end, which the grid reads last, before the others, and again where others have more.
        order = np.concatenate([[-1], np.arange(own.stop - own.start), np.full(samples - own.stop + own.start, -1)])
        first, weights = np.asarray(grid.sample_first)[order], np.asarray(grid.sample_weights)[order]
        padded = dataclasses.replace(grid.padded(room), sample_first=first, sample_weights=weights)
        pieces.append(Piece(padded, np.asarray(grid.steps), own))
    return pieces
