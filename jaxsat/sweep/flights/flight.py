"""A satellite on its orbit, as the options of a scenario say it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from jaxsat.bundled import CUBESAT
from jaxsat.constants import EARTH_MU
from jaxsat.environment import ExponentialAtmosphere, Sun, Surroundings, igrf_field
from jaxsat.errors import InputError
from jaxsat.satellites import Satellite, read_satellite
from jaxsat.sweep.pinned import path_of
from jaxsat.sweep.scenario import choice_of, number_of
from jaxsat.telemetry.table.flown import first_instant, with_orbit
from jaxsat.telemetry.table.orbit import MARGIN_S, orbit_over
from jaxsat.time import Epoch, greenwich_angle

LOOK_S = 600.0
"""How far the orbit is looked at for its period."""


@dataclass(frozen=True)
class Flight:
    """Who flies where, and since when."""

    satellite: Satellite
    epoch: Epoch
    """Instant of t = 0."""
    orbit_rate: float
    """Mean motion [rad/s]."""
    inclination: float
    """[rad]"""
    spread: float
    """Sigmas of the satellite file."""
    pressed: bool
    """Whether air and sunlight push on its surface."""

    @property
    def orbit_s(self) -> float:
        """Time of an orbit [s]."""
        return 2.0 * math.pi / self.orbit_rate

    def surroundings(self, duration_s: float) -> Surroundings:
        """Over a time from t = 0, with the Sun; `InputError` where the orbit is not known so long."""
        return Surroundings(
            orbit_over(self.satellite, self.epoch, -MARGIN_S, duration_s + MARGIN_S),
            igrf_field(self.epoch.shifted(0.5 * duration_s).decimal_year()),
            greenwich_angle(self.epoch),
            field_rate=self.satellite.model.spacecraft.hysteresis_rods is not None,
            atmosphere=ExponentialAtmosphere() if self.pressed else None,
            sun=Sun(self.epoch.tt_centuries()),
        )


def flight_of(options: Mapping[str, str], *, bundled: Path = CUBESAT) -> Flight:
    """The flight of the options `COMMON`, of the `bundled` satellite where they name none.

    Raises `InputError` for what cannot be, in the files too.
    """
    satellite = read_satellite(path_of(options["satellite"]) if options["satellite"] else bundled)
    if options["orbit"]:
        satellite = with_orbit(satellite, path_of(options["orbit"]))
    try:
        epoch = first_instant(satellite, options["start_utc"] or None)
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(str(error), field="start_utc") from None
    spread = number_of(options, "spread", low=0.0, high=3.0)
    wanted = choice_of(options, "pressure", ("on", "off")) == "on"
    rate, inclination = _mean_motion(satellite, epoch)
    pressed = wanted and satellite.model.spacecraft.facets is not None
    return Flight(satellite, epoch, rate, inclination, spread, pressed)


def _mean_motion(satellite: Satellite, epoch: Epoch) -> tuple[float, float]:
    orbit = orbit_over(satellite, epoch, -MARGIN_S, LOOK_S)
    position, velocity = map(np.asarray, jax.jit(lambda orbit, t: orbit(t))(orbit, jnp.zeros(())))
    energy = 0.5 * velocity @ velocity - EARTH_MU / np.linalg.norm(position)
    if not energy < 0.0:
        raise InputError("expected an orbit about the Earth, which is an ellipse", file=satellite.path, field="orbit")
    axis = -0.5 * EARTH_MU / energy
    normal = np.cross(position, velocity)
    return math.sqrt(EARTH_MU / axis**3), math.acos(normal[2] / np.linalg.norm(normal))
