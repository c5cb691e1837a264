"""What every orbit is: a function of time that gives position and velocity."""

import abc

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float


class AbstractOrbit(eqx.Module):
    """An orbit about the Earth; calling it gives the state at a time, true equator and equinox of date."""

    @abc.abstractmethod
    def __call__(self, t: Float[Array, ""]) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
        """Return position [m] and velocity [m/s], inertial frame, `t` seconds after the epoch."""

    @abc.abstractmethod
    def check_span(self, times: np.ndarray) -> None:
        """Raise ValueError unless the orbit is known at all `times` [s]; asked on the host, before tracing."""
