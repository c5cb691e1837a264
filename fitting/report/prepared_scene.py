"""The sky of a prepared RAW_SUN session."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from fitting.measurements.observations import Observations
from fitting.measurements.sky import Around
from fitting.report.scene import Sky, sky_over
from fitting.session import PreparedSession


def look_around(prepared: PreparedSession, samples: Observations, *, at_once: bool) -> Callable[[], Sky]:
    """Returns what gives the `Sky` of the samples' arc when called: at once, from a thread of its own, or only then."""
    if not at_once:
        return lambda: _sky(prepared, samples)
    pool = ThreadPoolExecutor(1, thread_name_prefix="scene")
    future = pool.submit(_sky, prepared, samples)
    pool.shutdown(wait=False)
    return future.result


def _sky(prepared: PreparedSession, samples: Observations) -> Sky:
    s = samples
    angle, rate, radius = (np.asarray(float(x)) for x in (s.greenwich_angle, s.earth_rotation_rate, s.earth_radius))
    around = Around(s.orbit, s.field, angle, rate, radius)
    return sky_over(around, samples.orbit, (float(samples.t[0]), float(samples.t[-1])), prepared.sun_eci)
