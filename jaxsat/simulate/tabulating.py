"""Surroundings as `simulate` and `simulate_many` take them."""

from collections.abc import Callable

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from jaxsat.environment import OrbitTable
from jaxsat.environment.surroundings import Surroundings

Tabulate = Callable[..., OrbitTable]
"""Called with times [s] it gives the orbit's table at them: `jaxsat.environment.Surroundings`, or a function."""


@eqx.filter_jit
def tabulated(surroundings: Tabulate, times: Float[Array | np.ndarray, " n"]) -> OrbitTable:
    """The table at the times."""
    return surroundings(times)


def jumps(surroundings: Tabulate) -> np.ndarray | None:
    """Times at which what is commanded jumps, if anything is [s]."""
    commands = surroundings.commands if isinstance(surroundings, Surroundings) else None
    return None if commands is None else commands.jumps()


def bucket(count: int) -> int:
    """The number of steps that a program is compiled for, so that lengths share one."""
    return max(64, 1 << (count - 1).bit_length())
