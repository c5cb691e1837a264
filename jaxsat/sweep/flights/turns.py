"""Knobs that every closed loop of a satellite file has: its body, torquers, and how bad its sensors are."""

import functools
import math
from collections.abc import Mapping
from operator import attrgetter

import numpy as np

from jaxsat.control.actuators import Magnetorquers
from jaxsat.control.loops import Channel
from jaxsat.satellites.model import MAGNET_PLACE
from jaxsat.sweep.flights.flight import Flight
from jaxsat.sweep.flights.spread import Spread
from jaxsat.sweep.knobs.knob import Knob
from jaxsat.sweep.knobs.turns import Turn, Where, largest_moment, positive

NOISES: Mapping[str, tuple[str, float, str]] = {
    "field": ("nT", 1e-9, "of each reading of the magnetometer, along each axis"),
    "rate": ("deg/s", math.radians(1.0), "of each reading of the gyro, about each axis"),
    "sun": ("deg", math.radians(1.0), "of each reading of the Sun's direction, about each axis"),
    "attitude": ("deg", math.radians(1.0), "of each attitude that is read, about each axis"),
}
"""Unit, its size in SI and meaning of the noise, by what is seen."""


def satellite_turns(
    flight: Flight,
    torquers: Magnetorquers | None,
    channels: Mapping[str, Channel],
    names: Mapping[str, str],
    spread: Spread,
    *,
    inertia_of_law: tuple[Where, ...] = (),
    dipole_of_law: tuple[Where, ...] = (),
) -> tuple[Turn, ...]:
    """Turns of leaves in a `Fixed` of `jaxsat.sweep.flights.loops`.

    The law's own inertia and largest dipole go along with the satellite's.
    """
    craft = flight.satellite.model.spacecraft
    told = ", as the law knows them too" if inertia_of_law else ""
    found = [
        Turn(
            Knob("inertia", "kg m2", f"the largest of the moments, which keep their ratios{told}", _moment(flight)),
            (lambda f: f.vehicle.spacecraft.inertia, *inertia_of_law),
        )
    ]
    if torquers is not None:
        most, left = float(np.min(torquers.max_dipole)), float(np.max(torquers.residual))
        found += [
            Turn(
                Knob("max_dipole", "A m2", "of each torquer", most),
                (lambda f: f.vehicle.torquers.max_dipole, *dipole_of_law),
            ),
            Turn(
                Knob("torquer_residual", "1", "share that torquers keep when off", left),
                (lambda f: f.vehicle.torquers.residual,),
            ),
        ]
    if craft.magnet is not None:
        drawn = [sigma for leaf, sigma in zip(spread.leaves, spread.sigma, strict=True) if leaf.place == MAGNET_PLACE]
        size = float(np.hypot(np.linalg.norm(np.asarray(craft.magnet)), np.linalg.norm(drawn)))
        meaning = "of the satellite itself, nominal and drawn, root mean square"
        found.append(Turn(Knob("dipole", "A m2", meaning, size), (lambda f: f.vehicle.spacecraft.magnet,)))
    for sight, one in channels.items():
        unit, size, meaning = NOISES[sight]
        where = functools.partial(_sigma, sight)
        found.append(Turn(Knob(f"{sight}_noise", unit, f"1-sigma {meaning}", float(one.sigma) / size), (where,)))
        found += _errors(sight, names, spread, flight)
    return positive(found)


def _moment(flight: Flight) -> float:
    return largest_moment(flight.satellite.model.spacecraft.inertia)


def _sigma(sight: str, fixed):
    return fixed.channels[sight].sigma


def _errors(sight: str, names: Mapping[str, str], spread: Spread, flight: Flight) -> list[Turn]:
    """The knob of what is drawn of a sensor's calibration, and its law is not told."""
    head = f"sensors.{names.get(sight, '')}."
    places = [leaf.place for leaf in spread.leaves if leaf.place.startswith(head)]
    places = list(dict.fromkeys(place.removeprefix(head) for place in places))
    if not places:
        return []
    words = " and ".join(place.rpartition(".")[2] for place in places)
    knob = Knob(f"{sight}_errors", "1", f"{words} of {names[sight]}, in the sigmas of the file", flight.spread)

    def leaf(place, fixed):
        return attrgetter(place)(fixed.channels[sight].sensor)

    return [Turn(knob, tuple(functools.partial(leaf, place) for place in places), about=True)]
