"""A session of any satellite made by the simulator: its motion, what its sensors send, and the numbers behind."""

import dataclasses
import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation, RotationSpline

from jaxsat.constants import EARTH_ROTATION_RATE
from jaxsat.dynamics import AttitudeState
from jaxsat.environment import Commands, ExponentialAtmosphere, Sun, Surroundings, igrf_field
from jaxsat.errors import InputError
from jaxsat.integrators import DORMAND_PRINCE_8
from jaxsat.math import quaternion
from jaxsat.satellites import Satellite
from jaxsat.satellites.model import Model
from jaxsat.simulate import simulate
from jaxsat.synthetic.twins.drawn import drawn_model
from jaxsat.synthetic.twins.readings import Columns, Motion, sent, views
from jaxsat.synthetic.twins.settings import TwinSettings
from jaxsat.synthetic.twins.source import epoch_of, with_orbit
from jaxsat.telemetry.table.motion import orbital_motion
from jaxsat.telemetry.table.orbit import MARGIN_S, orbit_over
from jaxsat.time import Epoch, greenwich_angle
from jaxsat.torques.commanded import commanded_columns
from jaxsat.torques.hysteresis import lag_from_induction

TOLERANCES = (1e-5, 1e-4)
"""Of the attitude [rad], tried one after the other where nobody gives one."""
_MANY_SAMPLES = 2000
DRAWN_RATE = np.radians(1.0)
"""1-sigma of a rate that nobody gives [rad/s]."""


@dataclass(frozen=True)
class Sent:
    """What one channel sends."""

    stamp_s: Float[np.ndarray, "n"]
    """After the epoch, late and rounded as the telemetry has it."""
    instant_s: Float[np.ndarray, "n"]
    """Of the measurement."""
    mean: Float[np.ndarray, "n columns"]
    """Without noise, in the unit of the channel."""
    values: Float[np.ndarray, "n columns"]
    """As sent."""


@dataclass(frozen=True)
class Twin:
    """A simulated session with its truth."""

    satellite: Satellite
    """As its file says."""
    orbit: Path | None
    """File of the orbit in place of that."""
    settings: TwinSettings
    epoch: Epoch
    """Instant of t = 0."""
    model: Model
    """The true numbers."""
    around: Surroundings
    motion: Motion
    """At every stamp and every instant of measurement."""
    channels: Mapping[str, Sent]
    columns: Columns
    """Commands and measured currents."""


def make_twin(
    satellite: Satellite,
    settings: TwinSettings | None = None,
    *,
    orbit: Path | None = None,
    columns: Columns | None = None,
) -> Twin:
    """Makes the motion of a satellite and what its sensors send.

    `orbit` is a file of element sets or an ephemeris in place of the orbit of the satellite file. `columns` are what
    coils and wheels were commanded and what disturbs sensors, times [s] after the epoch and SI values by the columns of
    the satellite file; those that are missing are zero. Raises `InputError` where the orbit does not reach, a column is
    none of the file's, and where no step holds the tolerance.
    """
    settings = settings or TwinSettings()
    flown = satellite if orbit is None else with_orbit(satellite, orbit)
    epoch = epoch_of(flown, settings)
    random = np.random.default_rng(settings.seed)
    model = satellite.model if settings.nominal else drawn_model(satellite, random)
    given = _complete(satellite, columns or {})
    around = _surroundings(flown, model, epoch, settings.duration_s, given)
    times = {name: _times(satellite, model, name, settings, epoch) for name in satellite.channels}
    every = np.unique(np.concatenate([[0.0], *(np.concatenate(pair) for pair in times.values())]))
    inside = every[(every >= 0.0) & (every <= settings.duration_s)]
    motion = _motion(satellite, model, around, inside, settings, random)
    keys = jax.random.split(jax.random.key(settings.seed), len(times))
    channels = {}
    for (name, (stamps, instants)), key in zip(times.items(), keys, strict=True):
        sensor = model.sensors[name]
        seen = views(model, around, epoch, motion.at(instants), given, light="light" in sensor.needs)
        channels[name] = Sent(stamps, instants, *sent(sensor, seen, satellite.channels[name], key))
        width = len(satellite.channels[name].columns)
        if channels[name].values.shape[1:] != (width,):
            reason = f"expected {channels[name].values.shape[1:]} numbers as the sensor reads, found {width} columns"
            raise InputError(reason, file=satellite.path, field=f"channels.{name}.columns")
    return Twin(satellite, orbit, settings, epoch, model, around, motion, channels, given)


def _complete(satellite: Satellite, columns: Columns) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """All columns that the satellite follows or reads."""
    for name in columns:
        if name not in satellite.columns:
            close = difflib.get_close_matches(name, satellite.columns, n=1)
            known = f"did you mean {close[0]!r}?" if close else f"there are {', '.join(satellite.columns) or 'none'}"
            raise InputError(f"no column of a coil, a wheel or a stray current; {known}", field=name)
    zero = (np.zeros(1), np.zeros(1))
    return {name: columns.get(name, zero) for name in satellite.columns}


def _surroundings(satellite: Satellite, model: Model, epoch: Epoch, duration: float, columns: Columns) -> Surroundings:
    craft = model.spacecraft
    pushed = craft.facets is not None
    held, linear = commanded_columns(craft.parts)
    return Surroundings(
        orbit_over(satellite, epoch, -MARGIN_S, duration + MARGIN_S),
        igrf_field(epoch.decimal_year()),
        greenwich_angle(epoch),
        EARTH_ROTATION_RATE,
        field_rate=craft.hysteresis_rods is not None,
        atmosphere=ExponentialAtmosphere() if pushed else None,
        sun=Sun(epoch.tt_centuries()) if pushed else None,
        commands=Commands.of(columns, held=held, linear=linear) if held or linear else None,
    )


def _times(
    satellite: Satellite, model: Model, name: str, settings: TwinSettings, epoch: Epoch
) -> tuple[np.ndarray, np.ndarray]:
    """Stamps of a channel, and when it measured: the stamps are whole intervals, the instants within the session."""
    every = satellite.channels[name].interval_s or settings.every_s
    grid = every * np.arange(int(settings.duration_s / every * (1.0 + 1e-12)) + 1)
    instants = grid - float(np.asarray(model.delays[name]))
    within = (instants >= 0.0) & (instants <= settings.duration_s)
    stamps, step = grid[within], satellite.time.resolution_s
    if step is not None:
        # Of the day: nobody knows when the session began.
        begin = 86400.0 * ((epoch.utc1 - 0.5) % 1.0 + epoch.utc2) + satellite.time.offset_s
        stamps = np.round((begin + stamps) / step) * step - begin
    return np.round(stamps, 9), instants[within]


def _motion(
    satellite: Satellite,
    model: Model,
    around: Surroundings,
    times: np.ndarray,
    settings: TwinSettings,
    random: np.random.Generator,
) -> Motion:
    if satellite.motion.kind == "orbital":
        nodes, attitudes = orbital_motion(around.orbit, start=-MARGIN_S, stop=settings.duration_s + MARGIN_S)
        spline = RotationSpline(nodes, Rotation.from_quat(attitudes, scalar_first=True))
        # Its rates are those of the body in its own axes.
        return Motion(times, spline(times).as_quat(scalar_first=True), spline(times, 1))
    initial = _initial(model, around, settings, random)
    given, error = settings.tolerance_rad, None
    # A dipole that is drawn large makes a motion so sensitive that kinks of the orbit's table are seen in it.
    for tolerance in TOLERANCES if given is None else (given,):
        try:
            found = simulate(
                model.spacecraft,
                initial,
                around,
                times,
                tolerance=tolerance,
                # It compiles in a fifth of the time that Adams takes, but has to stop at each sample.
                tableau=DORMAND_PRINCE_8 if len(times) < _MANY_SAMPLES else None,
            )
        except ValueError as failure:
            error = failure
            continue
        q, w = np.asarray(found.quaternion), np.asarray(found.angular_velocity)
        return Motion(times, q, w, float(found.error or 0.0))
    raise InputError(str(error), file=satellite.path) from None


def start_of(settings: TwinSettings, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Quaternion, inertial from body, and rate [rad/s] in body axes at t = 0, given or drawn."""
    # Drawn whether needed or not: an option changes what it says and nothing else.
    attitude, rate = random.standard_normal(4), DRAWN_RATE * random.standard_normal(3)
    q = np.asarray(attitude if settings.quaternion is None else settings.quaternion)
    w = rate if settings.rate_deg_s is None else np.radians(settings.rate_deg_s)
    return q / np.linalg.norm(q), w


def _initial(model: Model, around: Surroundings, settings: TwinSettings, random: np.random.Generator) -> AttitudeState:
    q, w = (jnp.asarray(each) for each in start_of(settings, random))
    rods = model.spacecraft.hysteresis_rods
    if rods is None:
        return AttitudeState(q, w)
    table = eqx.filter_jit(dataclasses.replace(around, commands=None))(jnp.zeros(1))
    field = quaternion.rotate_inverse(q, table.b_field_eci[0])
    return AttitudeState(q, w, lag_from_induction(rods, rods.induction, field))
