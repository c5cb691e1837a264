"""What four horizon sensors say of the sky about a spacecraft: Earth with its brightness, Moon and Sun."""

import math
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxsat.constants import AU, SUN_RADIUS
from jaxsat.control.earth_search.law import Signals
from jaxsat.control.earth_search.vehicle import FIELD_DEG, MOON_SIGNAL, SUN_MARGIN_DEG, SUN_SIGNAL, EarthSearchVehicle
from jaxsat.environment.albedo.infrared import MEAN_BRIGHTNESS, MIN_BRIGHTNESS, VARIATION, BrightnessMap
from jaxsat.sensors.horizon_sensor import (
    band_harmonics,
    chord_on_scan,
    halved_harmonics,
    normalised_output,
    small_arctan,
)
from jaxsat.sensors.horizon_sensor import present as signals_presence

Inside = Literal["brightness", "always", "never", "random"]
"""Whether a sensor that looks wholly into the disk signals: by the brightness it meets, or made to."""
SunChoice = Literal["none", "blocked", "unblocked"]
MOON_RADIUS = math.radians(0.25)
SUN_ANGLE = SUN_RADIUS / AU


class EarthScene(eqx.Module):
    """Sky of one case; directions are unit vectors in inertial axes, fixed for the length of a search."""

    disk: Float[Array, ""]
    """Angle from the nadir to the horizon [rad]."""
    cosine_of_disk: Float[Array, ""]
    distance: Float[Array, ""]
    """From the Earth's centre over its radius, one over the disk's sine."""
    sun: Float[Array, "3"]
    moon: Float[Array, "3"]
    moon_lit: Float[Array, ""]
    """Share of the Moon's disk that is lit."""
    brightness: Float[Array, ""]
    """Mean of the Earth [W/(m^2 sr)]."""


class Seen(eqx.Module):
    """Signals, and how they came about."""

    signals: Signals
    first: Float[Array, "4"]
    """First harmonics [W/(m^2 sr)]."""
    azimuths: Float[Array, "4 2"]
    """Of the sensors that are in use."""
    inside: Bool[Array, "4"]
    """Whether a scan lies wholly in the disk."""


def sense(
    vehicle: EarthSearchVehicle,
    scene: EarthScene,
    dcm_eci_from_body: Float[Array, "3 3"],
    up_eci: Float[Array, "3"],
    greenwich: Float[Array, "2"],
    coin: Float[Array, "4"],
    *,
    inside: Inside,
    sun: SunChoice,
    moon: bool,
    field: BrightnessMap | None,
) -> Seen:
    """What the sensors say in one attitude, with the Earth's centre opposite to `up_eci`.

    `greenwich` is cosine and sine of the Earth's angle.
    `coin` in [0, 1) decides on presence inside the disk where that is `random`; `field` None is an even Earth.
    """
    # Held: what is used several times is not to be computed for each of its uses.
    sensor, hold = vehicle.sensor, jax.lax.optimization_barrier
    nadir = -(up_eci @ dcm_eci_from_body)
    cosine_of_disk = scene.cosine_of_disk
    sun_body, moon_body = scene.sun @ dcm_eci_from_body, scene.moon @ dcm_eci_from_body
    nadir, sun_body, moon_body = hold((nadir, sun_body, moon_body))
    azimuths, muted = vehicle.azimuths, jnp.zeros(4, bool)
    azimuths = jnp.where(vehicle.on_spare[:, None], vehicle.spare_azimuths, azimuths)
    sun_up = sun_body @ nadir < cosine_of_disk
    if sun == "blocked":
        margin = math.radians(SUN_MARGIN_DEG + FIELD_DEG) + SUN_ANGLE
        struck = hold(sun_up & _strikes(sensor, azimuths, sun_body, margin))
        azimuths = hold(jnp.where((struck & ~vehicle.on_spare)[:, None], vehicle.spare_azimuths, azimuths))
        # A spare in use has none of its own.
        muted = (struck & vehicle.on_spare) | (struck & _strikes(sensor, azimuths, sun_body, margin))

    along_centre, along_scan = hold(_in_plane(sensor, azimuths, nadir))
    v1, v2 = hold(chord_on_scan(along_centre, along_scan, cosine_of_disk, sensor.amplitude))
    whole = (v1 <= -1.0) & (v2 >= 1.0)
    if field is None:
        first, second = band_harmonics(v1, v2, scene.brightness)
    else:
        # Two halves of one brightness each, taken where a linear one has the same first harmonic over a whole scan.
        middle, arm = 0.5 * (v1 + v2), math.pi / 8.0 * (v2 - v1)
        c, s = greenwich
        x, y, z = dcm_eci_from_body
        dcm_ecef_from_body = hold(jnp.stack([c * x + s * y, c * y - s * x, z]))
        across = hold(azimuths @ dcm_ecef_from_body[:, :2].T)
        nadir_ecef = hold(dcm_ecef_from_body @ nadir)
        axis_ecef = dcm_ecef_from_body[:, 2]
        places = [
            hold(ground(sensor, across, axis_ecef, v, nadir_ecef, scene.distance))
            for v in hold((middle - arm, middle + arm))
        ]
        departure = VARIATION * field.nearest(jnp.concatenate(places))
        bright = hold(jnp.maximum(scene.brightness * (1.0 + departure), MIN_BRIGHTNESS))
        first, second = halved_harmonics(v1, middle, v2, bright[:4], bright[4:])
    if moon:
        up = moon_body @ nadir < cosine_of_disk
        signal = jnp.where(up, MOON_SIGNAL * MEAN_BRIGHTNESS * scene.moon_lit, 0.0)
        more = _body_harmonics(sensor, azimuths, moon_body, MOON_RADIUS, signal)
        first, second = first + more[0], second + more[1]
    if sun == "unblocked":
        signal = jnp.where(sun_up, SUN_SIGNAL * MEAN_BRIGHTNESS, 0.0)
        more = _body_harmonics(sensor, azimuths, sun_body, SUN_ANGLE, signal)
        first, second = first + more[0], second + more[1]

    present = signals_presence(sensor, first)
    if inside == "always":
        present = present | whole
    elif inside == "never":
        present = present & ~whole
    elif inside == "random":
        present = jnp.where(whole, coin < 0.5, present)
    present = (present & ~(muted | vehicle.silent)) | vehicle.stuck
    # The height is known on board: where the horizon stands with z to the nadir is taken off.
    offset = -sensor.amplitude * normalised_output(first, second) - (sensor.cone_angle - scene.disk)
    return Seen(Signals(present, offset), first, azimuths, whole)


def _in_plane(sensor, azimuths, direction):
    """Components of a body direction along each scan's centre and, there, along the scan toward the axis."""
    outward = azimuths @ direction[:2]
    c, s = jnp.cos(sensor.cone_angle), jnp.sin(sensor.cone_angle)
    return s * outward + c * direction[2], s * direction[2] - c * outward


def _across(azimuths, direction):
    return azimuths[:, 0] * direction[1] - azimuths[:, 1] * direction[0]


def _strikes(sensor, azimuths, direction, margin):
    """Whether a body direction is in the scanned field with a margin [rad]."""
    centre, along = _in_plane(sensor, azimuths, direction)
    near = jnp.abs(along) < jnp.tan(sensor.amplitude + margin) * centre
    return near & (jnp.abs(_across(azimuths, direction)) < jnp.sin(margin))


def _body_harmonics(sensor, azimuths, direction, radius, signal):
    """Harmonics of a small bright body that the scan passes over, within the field of view across."""
    centre, along = _in_plane(sensor, azimuths, direction)
    met = jnp.abs(_across(azimuths, direction)) < math.sin(radius + math.radians(FIELD_DEG))
    met = met & (jnp.abs(along) < 0.4 * centre)
    ratio = along / jnp.where(met, centre, 1.0)
    place = small_arctan(ratio)
    begin, end = (jnp.clip((place + s * radius) / sensor.amplitude, -1.0, 1.0) for s in (-1.0, 1.0))
    return band_harmonics(begin, end, jnp.where(met, signal, 0.0))


def ground(
    sensor,
    azimuths: Float[Array, "places 3"],
    axis: Float[Array, "3"],
    v: Float[Array, "places"],
    nadir: Float[Array, "3"],
    distance: Float[Array, ""],
) -> Float[Array, "places 3"]:
    """Vectors from the Earth's centre, in its radii, to what is seen at places v of scans.

    `azimuths` of the sensors, `axis` (body z) and `nadir` are unit vectors in the axes in which the result is wanted;
    `distance` is that of the spacecraft over the Earth's radius. A line of sight that misses the Earth is given the
    place at which it comes nearest.
    """
    hold = jax.lax.optimization_barrier
    # Series of the scan's angle, below 0.22 rad: to 1e-9, at a tenth of the time of sine and cosine.
    square = (sensor.amplitude * v) ** 2
    sine = sensor.amplitude * v * (1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0)))
    cosine = 1.0 - square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0))
    c, s = jnp.cos(sensor.cone_angle), jnp.sin(sensor.cone_angle)
    outward, inward = hold((s * cosine - c * sine, c * cosine + s * sine))
    down = outward * (azimuths @ nadir) + inward * (axis @ nadir)
    slant = hold(distance * down - jnp.sqrt(jnp.maximum(1.0 - distance**2 * (1.0 - down * down), 0.0)))
    return (slant * outward)[:, None] * azimuths + (slant * inward)[:, None] * axis[None] - distance * nadir[None]
