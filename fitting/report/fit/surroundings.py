"""What the motion of any satellite happens in, for its page and for other programs."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.measurements.abstract import PAD_SAMPLES
from fitting.measurements.sky import Around
from fitting.orbit.orbit_fit import OrbitFit
from fitting.outcome.result import FitResult
from fitting.report.orbit_document import FRAME, orbit_document
from fitting.report.scene import Sky, scene_document, sky_over
from fitting.stored import Stored
from jaxsat.constants import EARTH_MU
from jaxsat.environment import AbstractOrbit, KeplerOrbit, classical_elements
from jaxsat.math.sizes import few_sizes
from jaxsat.time import Epoch


@dataclass(frozen=True)
class Surroundings:
    """States at the times of a result, and the sky over its arc."""

    position_m: np.ndarray
    """[time 3] true equator and equinox of date."""
    velocity_m_s: np.ndarray
    sky: Sky

    @staticmethod
    def of(t_s: np.ndarray, around: Around, epoch: Epoch) -> "Surroundings":
        """Those at times after the epoch [s]."""
        t = np.asarray(t_s, float)
        # Of few sizes, so that a session of another length finds its program.
        padded = np.pad(t, (0, few_sizes(len(t), PAD_SAMPLES) - len(t)), mode="edge")
        position, velocity, revolution = states(around.orbit, padded)
        position, velocity = (np.asarray(array)[: len(t)] for array in (position, velocity))
        sky = sky_over(around, revolution, (float(t[0]), float(t[-1])), partial(around.sun_eci, epoch))
        return Surroundings(position, velocity, sky)

    def scene(self, result: FitResult) -> dict[str, Any] | None:
        """Content of scene.json; None where there is no motion."""
        return scene_document(result, self.sky)

    def orbit_document(self, name: str, object_id: str | None = None, fit: OrbitFit | None = None) -> dict[str, Any]:
        """The key `orbit` of fit.json, SI: with its elements where it was fitted to positions."""
        return {
            "object_name": name or None,
            "object_id": object_id,
            "frame": FRAME,
            **({} if fit is None else {"message": fit.message, **orbit_document(fit)}),
            "position_eci_m": np.round(self.position_m, 3),
            "velocity_eci_m_s": np.round(self.velocity_m_s, 6),
        }


def look_around(t_s: np.ndarray, around: Around, epoch: Epoch, *, at_once: bool) -> Callable[[], Surroundings]:
    """Returns what gives the `Surroundings` when called: at once, from a thread of its own, or only then."""
    if not at_once:
        return cache(lambda: Surroundings.of(t_s, around, epoch))
    pool = ThreadPoolExecutor(1, thread_name_prefix="scene")
    future = pool.submit(Surroundings.of, t_s, around, epoch)
    pool.shutdown(wait=False)
    return future.result


def _states(
    orbit: AbstractOrbit, t: Float[Array | np.ndarray, " time"]
) -> tuple[Float[Array, "time 3"], Float[Array, "time 3"], KeplerOrbit]:
    """Position and velocity at times, and the ellipse through the first of them."""
    position, velocity = jax.vmap(orbit)(jnp.asarray(t))
    return position, velocity, osculating(position[0], velocity[0], jnp.asarray(t)[0])


states = Stored(_states, seldom=True)


def osculating(
    position_m: Float[Array | np.ndarray, "3"],
    velocity_m_s: Float[Array | np.ndarray, "3"],
    t_s: Float[Array, ""] | float,
) -> KeplerOrbit:
    """Returns the ellipse through a state at `t_s`: an orbit that is tabulated over its arc has no revolution."""
    ellipse = classical_elements(jnp.asarray(position_m), jnp.asarray(velocity_m_s), jnp.asarray(EARTH_MU))
    back = ellipse.mean_anomaly - ellipse.mean_motion * t_s
    return eqx.tree_at(lambda orbit: orbit.mean_anomaly, ellipse, back)
