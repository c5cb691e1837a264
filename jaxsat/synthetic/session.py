"""A simulated session: what surrounds the satellite, its truth and its telemetry."""

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from sgp4.api import Satrec

from jaxsat.constants import EARTH_MU
from jaxsat.dynamics import AttitudeState
from jaxsat.environment import (
    KeplerOrbit,
    Surroundings,
    elements_from_state,
    igrf_field,
    sgp4_orbit,
    sun_directions,
)
from jaxsat.errors import InputError
from jaxsat.estimation import attitude_from_sun_magnetic
from jaxsat.given import Given, Orbit
from jaxsat.satellites.assembly import assembled
from jaxsat.satellites.numbers import MUNIN, SatelliteNumbers
from jaxsat.sensors import Albedo, PolygonPanels, current_readings, limited_currents, uniform_noise
from jaxsat.spacecraft import Spacecraft
from jaxsat.synthetic.panels import further_panels
from jaxsat.synthetic.settings import SimulationSettings
from jaxsat.synthetic.truth import Truth, simulate_session
from jaxsat.telemetry import raw_sun_text
from jaxsat.telemetry.elements.tle_lines import element_lines
from jaxsat.telemetry.raw_sun.settings import PANELS, CleaningSettings
from jaxsat.time import Epoch, greenwich_angle


@dataclass(frozen=True)
class SessionPlan:
    """All that a simulated session follows from."""

    settings: SimulationSettings = SimulationSettings()
    satellite: SatelliteNumbers = SatelliteNumbers()
    given: Given = Given()
    cleaning: CleaningSettings = CleaningSettings()
    """Of it the order of the panels in the file."""
    file: Path | None = None
    """Where it was read from, for messages."""

    def document(self) -> dict[str, Any]:
        """All of it by the sections of a configuration, as plain values."""
        sections = {
            **dict(self.given),
            **dict(self.satellite),
            "cleaning": self.cleaning,
            "simulate": self.settings,
        }
        return {name: section.model_dump(mode="json") for name, section in sections.items()}


@dataclass(frozen=True)
class SimulatedSession:
    """A session with its truth and what the ground receives of it."""

    epoch: Epoch
    spacecraft: Spacecraft
    albedo: Albedo
    panels: PolygonPanels | None
    """Further ones, of `simulate.panel_corners_m`."""
    greenwich_angle: float
    """At t = 0 [rad]."""
    elements: dict[str, float]
    """Kepler elements at t = 0, keys as the leaves of `KeplerOrbit`, SI."""
    tle: tuple[str, str]
    truth: Truth
    limited_mA: np.ndarray
    """[time 6] currents after limiting, without noise."""
    telemetered_mA: np.ndarray
    """[time 6] readings."""
    raw_sun: str
    """Text of the session file."""
    truth_at: Callable[[np.ndarray], Truth]
    """The same motion at other increasing times [s], the last no later than that of `truth`; for as many of them as
    `truth` has nothing is compiled."""


def make_session(plan: SessionPlan) -> SimulatedSession:
    """Simulates a session; raises `InputError` naming file and key where it cannot be."""
    settings, given, file = plan.settings, plan.given, plan.file
    epoch = Epoch.from_iso(settings.epoch_utc)
    t = settings.sampling_s * np.arange(int(settings.duration_s / settings.sampling_s) + 1)
    try:
        field = igrf_field(epoch.decimal_year())
    except ValueError as error:
        raise InputError(str(error), file=file, field="simulate.epoch_utc") from None
    orbit, elements = _orbit(plan, epoch, float(t[-1]))
    sun_eci = sun_directions(epoch, t, fixed=given.sun.direction_eci)
    angle = given.earth.greenwich_angle(_perigee_s(given, elements))
    angle = greenwich_angle(epoch) if angle is None else angle
    around = Surroundings(orbit, field, angle, given.earth.rotation_rate_rad_s)
    craft, albedo = assembled(plan.satellite)
    panels = further_panels(settings, file)
    initial = _initial(settings, around, sun_eci[0])

    def truth_at(t_s: np.ndarray) -> Truth:
        return simulate_session(
            craft,
            initial,
            around,
            t_s,
            sun_directions(epoch, t_s, fixed=given.sun.direction_eci),
            albedo=albedo,
            earth_radius=1e3 * given.earth.radius_km,
            tolerance=settings.tolerance_rad,
        )

    try:
        truth = truth_at(t)
    except ValueError as error:
        raise InputError(str(error), file=file, field="simulate.tolerance_rad") from None
    limited, read = _readings(settings, truth)
    try:
        tle = settings.tle or element_lines(elements, epoch, mu=EARTH_MU)
    except ValueError as error:
        raise InputError(str(error), file=file, field="simulate.epoch_utc") from None
    return SimulatedSession(
        epoch=epoch,
        spacecraft=craft,
        albedo=albedo,
        panels=panels,
        greenwich_angle=angle,
        elements=elements,
        tle=tle,
        truth=truth,
        limited_mA=limited,
        telemetered_mA=read,
        raw_sun=_raw_sun(plan, epoch, tle, truth, read),
        truth_at=truth_at,
    )


def _orbit(plan: SessionPlan, epoch: Epoch, end: float):
    """The orbit, and its Kepler elements at t = 0."""
    tle, file = plan.settings.tle, plan.file
    elements = plan.given.orbit.elements(EARTH_MU)
    if elements is None and tle is not None:
        try:
            orbit = sgp4_orbit(Satrec.twoline2rv(*tle), epoch, start=0.0, stop=end)
        except ValueError as error:
            raise InputError(str(error), file=file, field="simulate.tle") from None
        around = eqx.filter_jit(lambda t: elements_from_state(*orbit(t)).elements)(jnp.asarray(0.0))
    else:
        elements = elements or Orbit(**MUNIN["orbit"]).elements(EARTH_MU) or {}
        around = orbit = KeplerOrbit(**elements, mu=EARTH_MU)
    lowest = float(around.semi_major_axis * (1.0 - around.eccentricity))
    if not lowest > 1e3 * plan.given.earth.radius_km:
        reason = f"the perigee lies {1e-3 * lowest:.0f} km from the Earth's centre, inside it"
        raise InputError(reason, file=file, field="orbit")
    return orbit, {name: float(getattr(around, name)) for name in (*KEPLER, "mu")}


KEPLER = ("semi_major_axis", "eccentricity", "inclination", "raan", "argument_of_perigee", "mean_anomaly")


def _perigee_s(given: Given, elements: dict[str, float]) -> float:
    """Time of the perigee passage that is meant, by default the first after t = 0 [s]."""
    if given.orbit.time_of_perigee_s is not None:
        return given.orbit.time_of_perigee_s
    mean_motion = math.sqrt(elements["mu"] / elements["semi_major_axis"] ** 3)
    return (-elements["mean_anomaly"] % (2.0 * math.pi)) / mean_motion


def _initial(settings: SimulationSettings, around: Surroundings, sun_eci: np.ndarray) -> AttitudeState:
    if settings.quaternion is not None:
        q = jnp.asarray(settings.quaternion)
    else:
        field = eqx.filter_jit(around)(jnp.zeros(1)).b_field_eci[0]
        angles = jnp.asarray(np.radians(settings.sun_magnetic_deg))
        q = jax.jit(attitude_from_sun_magnetic)(angles, field, jnp.asarray(sun_eci))
    return AttitudeState(q, jnp.asarray(np.radians(settings.rate_deg_s)))


def _readings(s: SimulationSettings, truth: Truth) -> tuple[np.ndarray, np.ndarray]:
    """Currents after limiting, and as telemetered [mA]."""
    clean = 1e3 * np.asarray(truth.current)
    if s.limit_s is not None:
        within = (truth.t >= s.limit_s[0]) & (truth.t <= s.limit_s[1])
        limited = limited_currents(
            jnp.asarray(clean),
            jnp.asarray(s.limit_factors),
            panel_limit=s.limit_panel_mA or np.inf,
            sum_limit=s.limit_sum_mA or np.inf,
        )
        clean = np.where(within[:, None], limited, clean)
    draw = uniform_noise if s.noise == "uniform" else jax.random.normal
    sigma, offset, key = jnp.asarray(s.noise_mA), jnp.asarray(s.zero_offset_mA), jax.random.key(s.seed)
    return clean, np.asarray(_read(jnp.asarray(clean), key, sigma, offset, quantum=s.quantum_mA, draw=draw))


@functools.partial(jax.jit, static_argnames=("quantum", "draw"))
def _read(clean, key, sigma, offset, *, quantum, draw):
    return current_readings(clean, sigma=sigma, offset=offset, quantum=quantum, draw=draw, key=key)


def _raw_sun(plan: SessionPlan, epoch: Epoch, tle: tuple[str, str], truth: Truth, read: np.ndarray) -> str:
    s, n = plan.settings, len(truth.t)
    # Not the key of the currents: what is added to one quantity must not depend on how many numbers another took.
    rng = np.random.default_rng([s.seed, 1])
    position_error, velocity_error = rng.normal(size=(2, n, 3))
    field_error = rng.normal(size=(n, 2))
    quantum = s.quantum_mA
    return raw_sun_text(
        s.satellite,
        tle,
        epoch,
        truth.t,
        position_eci_m=np.asarray(truth.position_eci) + 1e3 * s.position_sigma_km * position_error,
        velocity_eci_m_s=np.asarray(truth.velocity_eci) + s.velocity_sigma_m_s * velocity_error,
        currents_mA=read,
        b_field_uT=1e6 * np.asarray(truth.b_field_body)[:, 1:] + s.magnetometer_sigma_uT * field_error,
        received=epoch.shifted(float(truth.t[-1]) + 600.0),
        # Column k of the file holds the panel that the settings name there.
        panel_order=[PANELS.index(panel) for panel in plan.cleaning.panel_order],
        current_decimals=0 if quantum > 0.0 and quantum == round(quantum) else 3,
    )
