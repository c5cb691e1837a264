"""From a configuration to a simulated session: the satellite, what surrounds it, its truth and its telemetry."""

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from sgp4.api import Satrec

from jaxsat.cli.session.inputs import nominal
from jaxsat.cli.simulate.panels import configured_panels
from jaxsat.constants import EARTH_MU
from jaxsat.dynamics import AttitudeState
from jaxsat.environment import KeplerOrbit, Surroundings, apparent_sun, elements_from_state, igrf_field, sgp4_orbit
from jaxsat.errors import InputError
from jaxsat.estimation import attitude_from_sun_magnetic
from jaxsat.math import quaternion
from jaxsat.sensors import Albedo, PolygonPanels, current_readings, limited_currents, uniform_noise
from jaxsat.spacecraft import MagneticRods, SolarPanels, Spacecraft, box_normals, symmetric_tensor, tilted
from jaxsat.synthetic import Truth, simulate_session
from jaxsat.telemetry.elements.tle_lines import element_lines
from jaxsat.telemetry.raw_sun.cleaning import PANELS
from jaxsat.telemetry.raw_sun.writing import raw_sun_text
from jaxsat.time import Epoch, greenwich_angle

if TYPE_CHECKING:
    from jaxsat.cli.settings.sections import Config

MUNIN_ORBIT = {
    "semi_major_axis_km": 7630.026457,
    "eccentricity": 0.072661,
    "inclination_deg": 95.438873,
    "raan_deg": 64.81879,
    "argument_of_perigee_deg": 16.675906,
    "time_of_perigee_s": 3230.533197,
}
"""Elements of 2001-01-18T04:54:15 UTC (Penkov et al. 2009, table 1), taken where the configuration has no orbit."""


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


def make_session(config: "Config", file: Path | None) -> SimulatedSession:
    """Simulates the session of a configuration; raises `InputError` naming `file` and key where it cannot be."""
    settings = config.simulate
    epoch = Epoch.from_iso(settings.epoch_utc)
    t = settings.sampling_s * np.arange(int(settings.duration_s / settings.sampling_s) + 1)
    try:
        field = igrf_field(epoch.decimal_year())
    except ValueError as error:
        raise InputError(str(error), file=file, field="simulate.epoch_utc") from None
    orbit, elements = _orbit(config, epoch, float(t[-1]), file)
    sun_eci = _sun(config, epoch, t)
    angle = config.earth.greenwich_angle(config.orbit.time_of_perigee_s or 0.0)
    angle = greenwich_angle(epoch) if angle is None else angle
    around = Surroundings(orbit, field, angle, config.earth.rotation_rate_rad_s)
    craft, albedo = satellite(config)
    panels = configured_panels(config, file)
    try:
        truth = simulate_session(
            craft,
            _initial(config, around, sun_eci[0]),
            around,
            t,
            sun_eci,
            albedo=albedo,
            earth_radius=1e3 * config.earth.radius_km,
            tolerance=settings.tolerance_rad,
        )
    except ValueError as error:
        raise InputError(str(error), file=file, field="simulate.tolerance_rad") from None
    limited, read = _readings(config, truth)
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
        raw_sun=_raw_sun(config, epoch, tle, truth, read),
    )


def satellite(config: "Config") -> tuple[Spacecraft, Albedo]:
    """The satellite of a configuration, and the reflectivities of the Earth."""
    given = nominal(config)
    craft = Spacecraft(
        inertia=symmetric_tensor(jnp.asarray(given.inertia)),
        magnet=jnp.asarray(given.magnet),
        rods=MagneticRods(jnp.asarray(given.rods), jnp.eye(3)[1:], jnp.asarray(given.reference_field)),
        panels=SolarPanels(
            _normals(jnp.asarray(given.tilts.reshape(6, 2))),
            jnp.asarray(given.max_current),
            jnp.asarray(given.gains),
        ),
    )
    specular, diffuse = given.albedo
    return craft, Albedo(jnp.asarray(specular), jnp.asarray(diffuse))


@jax.jit
def _normals(tilts):
    return tilted(box_normals(), tilts)


def _orbit(config: "Config", epoch: Epoch, end: float, file: Path | None):
    """The orbit, and its Kepler elements at t = 0."""
    tle = config.simulate.tle
    elements = config.orbit.elements(EARTH_MU)
    if elements is None and tle is not None:
        try:
            orbit = sgp4_orbit(Satrec.twoline2rv(*tle), epoch, start=0.0, stop=end)
        except ValueError as error:
            raise InputError(str(error), file=file, field="simulate.tle") from None
        around = elements_from_state(*eqx.filter_jit(orbit)(jnp.asarray(0.0)))
    else:
        elements = elements or type(config.orbit)(**MUNIN_ORBIT).elements(EARTH_MU) or {}
        around = orbit = KeplerOrbit(**elements, mu=EARTH_MU)
    lowest = float(around.semi_major_axis * (1.0 - around.eccentricity))
    if not lowest > 1e3 * config.earth.radius_km:
        reason = f"the perigee lies {1e-3 * lowest:.0f} km from the Earth's centre, inside it"
        raise InputError(reason, file=file, field="orbit")
    return orbit, {name: float(getattr(around, name)) for name in (*KEPLER, "mu")}


KEPLER = ("semi_major_axis", "eccentricity", "inclination", "raan", "argument_of_perigee", "mean_anomaly")


def _sun(config: "Config", epoch: Epoch, t: np.ndarray) -> np.ndarray:
    if config.sun.direction_eci is None:
        return apparent_sun(epoch, t)[0]
    direction = np.array(config.sun.direction_eci)
    return np.tile(direction / np.linalg.norm(direction), (len(t), 1))


def _initial(config: "Config", around: Surroundings, sun_eci: np.ndarray) -> AttitudeState:
    settings = config.simulate
    if settings.quaternion is not None:
        q = quaternion.normalize(jnp.asarray(settings.quaternion))
    else:
        field = eqx.filter_jit(around)(jnp.zeros(1)).b_field_eci[0]
        angles = jnp.asarray(np.radians(settings.sun_magnetic_deg))
        q = jax.jit(attitude_from_sun_magnetic)(angles, field, jnp.asarray(sun_eci))
    return AttitudeState(q, jnp.asarray(np.radians(settings.rate_deg_s)))


def _readings(config: "Config", truth: Truth) -> tuple[np.ndarray, np.ndarray]:
    """Currents after limiting, and as telemetered [mA]."""
    s = config.simulate
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


def _raw_sun(config: "Config", epoch: Epoch, tle: tuple[str, str], truth: Truth, read: np.ndarray) -> str:
    s, n = config.simulate, len(truth.t)
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
        # Column k of the file holds the panel that the configuration names there.
        panel_order=[PANELS.index(panel) for panel in config.cleaning.panel_order],
        current_decimals=0 if quantum > 0.0 and quantum == round(quantum) else 3,
    )
