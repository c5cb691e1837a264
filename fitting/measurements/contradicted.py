"""Readings of light that the computed shadow contradicts: a wrong epoch or orbit, or a second beside its edge."""

import numpy as np

from fitting.measurements.groups import columns_of
from fitting.measurements.problem import Problem
from jaxsat.sensors import Panels
from jaxsat.sensors.sunlight.sun_of_cells import fibonacci_sphere

BRIGHT = 3.0
"""Sigmas by which light stands out of the noise."""
SURE = 6.0
"""Those by which a reading in the dark must do so to contradict it, also where the noise is larger than stated."""
PLACES = 2000
"""Directions of the Sun, four degrees apart, that are tried for one in which panels see next to nothing."""


def contradicted(problem: Problem) -> np.ndarray:
    """[samples groups] whether readings and the computed shadow exclude each other.

    A sensor of light that sees some in the dark; panels that see none in sunlight, where they look to all sides.
    """
    light = problem.sky.light
    if light is None:
        return np.zeros((len(problem.valid), len(problem.groups)), bool)
    share, found = np.asarray(light.illumination), []
    for number, (group, columns) in enumerate(zip(problem.groups, columns_of(problem.groups), strict=True)):
        sensor, known = problem.model.sensors[group.name], np.asarray(problem.known)[:, columns]
        bright = np.asarray(problem.bright)[:, number]
        sure = bright & _surely_bright(problem, group.name, columns)
        own = (share == 0.0) & (sensor.sees == "sun") & sure
        told = np.atleast_1d(known.any(axis=0))
        if isinstance(sensor, Panels) and told.any():
            least = _least_light(sensor, told) > 2.0 * BRIGHT * float(np.asarray(problem.sigma)[columns][0])
            own |= least & (share == 1.0) & known[:, told].all(axis=1) & ~bright
        found.append(own & np.asarray(problem.valid))
    return np.stack(found, axis=1)


def _surely_bright(problem: Problem, name: str, columns: slice) -> np.ndarray:
    """[samples] whether a reading is light: of hundreds in the dark some stand out of the noise by chance."""
    size = np.abs(np.asarray(problem.measured[name])).max(axis=1)
    return size > SURE * float(np.asarray(problem.sigma)[columns][0])


def _least_light(panels: Panels, told: np.ndarray) -> float:
    """The largest current of the panels that are `told`, with the Sun where that is least [A]."""
    full = np.asarray(panels.max_current) * np.asarray(panels.gain)
    return float(((fibonacci_sphere(PLACES) @ np.asarray(panels.normals).T) * full)[:, told].max(axis=1).min())
