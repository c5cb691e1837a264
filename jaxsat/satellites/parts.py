"""From the sections of a satellite file to the satellite that the simulator moves, and the names of its numbers."""

import math
from typing import Any

import numpy as np
from jaxtyping import Array

from jaxsat.math import float_array, put
from jaxsat.satellites.leaves import XYZ, LeafList, as_array
from jaxsat.satellites.model import INERTIA_PLACE, MAGNET_PLACE, POLAR_PLACE
from jaxsat.satellites.sections.file import SatelliteFile
from jaxsat.satellites.sections.fitted import Fitted, plain
from jaxsat.satellites.sections.parts import Body, Rod, Surface
from jaxsat.sensors import Albedo
from jaxsat.spacecraft import Facets, HysteresisRods, MagneticRods, Spacecraft, box_facets
from jaxsat.torques import Coil, EddyDamping, ResidualTorque, Wheel

_TENSOR = {"xx": (0,), "yy": (4,), "zz": (8,), "xy": (1, 3), "xz": (2, 6), "yz": (5, 7)}


def built_spacecraft(file: SatelliteFile, leaves: LeafList) -> Spacecraft:
    """The satellite, SI; its numbers are added to the leaves."""
    inertia = _inertia(file.body, leaves)
    _add_dipole(file.magnet.dipole_A_m2, leaves)
    linear, hysteresis = _rods(file.rods, leaves)
    parts: list[Any] = []

    def place() -> str:
        return f"spacecraft.parts.{len(parts)}"

    for k, coil in enumerate(file.coils):
        size = coil.area_turns_m2
        if size is None or coil.column is None:
            continue
        loose = 0.2 * abs(size.value) or 1.0
        leaves.add(f"coils.{k}.area_turns", f"{place()}.area_turns", size, unit="m2", loose=loose)
        parts.append(Coil(axis=float_array(coil.axis), area_turns=float_array(size.value), column=coil.column))
    for k, wheel in enumerate(file.wheels):
        if wheel.column is None:
            continue
        loose = 0.2 * abs(wheel.inertia.value) or 1e-6
        leaves.add(f"wheels.{k}.inertia", f"{place()}.inertia", wheel.inertia, unit="kg m2", loose=loose)
        parts.append(Wheel(axis=float_array(wheel.axis), inertia=float_array(wheel.inertia.value), column=wheel.column))
    if file.residual is not None:
        leaves.add("residual", f"{place()}.torque", file.residual.torque, XYZ, unit="N m", loose=1e-6)
        parts.append(ResidualTorque(as_array(file.residual.torque, 3)))
    if file.eddy is not None:
        leaves.add("eddy", f"{place()}.coefficient", file.eddy.coefficient, unit="S m4", loose=1e3, lower=0.0)
        parts.append(EddyDamping(float_array(file.eddy.coefficient.value)))
    return Spacecraft(
        inertia=inertia,
        magnet=as_array(file.magnet.dipole_A_m2, 3),
        rods=linear,
        hysteresis_rods=hysteresis,
        facets=None if file.surface is None else _facets(file.surface, file.body, leaves),
        parts=tuple(parts),
    )


def _add_dipole(given: Fitted, leaves: LeafList) -> None:
    """Leaves of the vector, and of its modulus and two angles, with priors as wide as those of the vector."""
    loose = 1.0
    leaves.add("magnet", MAGNET_PLACE, given, XYZ, unit="A m2", loose=loose)
    sigma = loose if given.sigma is None else float(np.mean(given.sigma))
    modulus = float(np.linalg.norm(given.value))
    angle = min(sigma / modulus, math.pi) if modulus > 0.0 else math.pi
    other = plain(0.0)
    leaves.add_scalar_at(0, "magnet.modulus", POLAR_PLACE, other, unit="A m2", loose=sigma, lower=0.0)
    for entry, name in enumerate(("azimuth", "elevation"), start=1):
        degree = {"unit": "deg", "factor": math.radians(1.0)}
        leaves.add_scalar_at(entry, f"magnet.{name}", POLAR_PLACE, other, loose=angle, **degree)


def built_albedo(file: SatelliteFile, leaves: LeafList) -> Albedo:
    """Reflectivity of the Earth."""
    for key in ("specular", "diffuse"):
        given = getattr(file.albedo, key)
        leaves.add(f"albedo.{key}", f"albedo.{key}", given, loose=0.3, lower=0.0, upper=1.5)
    return Albedo(float_array(file.albedo.specular.value), float_array(file.albedo.diffuse.value))


def _inertia(body: Body, leaves: LeafList) -> Array:
    tensor = body.inertia()
    given = body.inertia_kg_m2 or plain(0.0)
    sigma = given.sigma
    if sigma is not None and np.ndim(sigma) == 1:
        # Of three moments: what lies beside the diagonal is known as well as the least of them.
        sigma = np.diag(sigma) + min(sigma) * (1.0 - np.eye(3))
    loose = 0.3 * float(np.trace(tensor)) / 3.0
    for suffix, entries in _TENSOR.items():
        width = sigma if sigma is None or np.ndim(sigma) == 0 else float(np.reshape(sigma, -1)[entries[0]])
        leaves.add(
            f"inertia.{suffix}",
            INERTIA_PLACE,
            given.model_copy(update={"sigma": width}),
            unit="kg m2",
            loose=loose,
            lower=0.0 if len(entries) == 1 else -np.inf,
            entries=[entries],
        )
    return put(tensor)


def _rods(rods: tuple[Rod, ...], leaves: LeafList) -> tuple[MagneticRods | None, HysteresisRods | None]:
    linear: list[Rod] = []
    looped: list[Rod] = []
    for k, rod in enumerate(rods):
        if rod.moment is not None:
            settings = {"unit": "A m2", "loose": 0.05}
            leaves.add_scalar_at(len(linear), f"rods.{k}.moment", "spacecraft.rods.moments", rod.moment, **settings)
            linear.append(rod)
            continue
        for key, (place, unit) in _LOOP.items():
            given: Fitted = getattr(rod, key)
            settings = {"unit": unit, "loose": 0.3 * given.value, "lower": 0.0}
            leaves.add_scalar_at(
                len(looped), f"rods.{k}.{key}", f"spacecraft.hysteresis_rods.{place}", given, **settings
            )
        # Nobody knows with what flux a rod enters the session, but that it is of the order of its remanence.
        start = Fitted(value=0.0, sigma=rod.Br.value if rod.Br else None)
        leaves.add_scalar_at(
            len(looped), f"rods.{k}.start", "spacecraft.hysteresis_rods.induction", start, unit="T", loose=0.01
        )
        looped.append(rod)
    straight = curved = None
    if linear:
        # One reference field for all: moments are quoted in that of the first.
        fields = {rod.reference_field_T for rod in linear}
        straight = MagneticRods(
            float_array([rod.moment.value for rod in linear if rod.moment is not None]),
            float_array([rod.axis for rod in linear]),
            float_array(min(fields)),
        )
    if looped:
        numbers = {place: float_array([getattr(rod, key).value for rod in looped]) for key, (place, _) in _LOOP.items()}
        none = put(np.zeros(len(looped)))
        curved = HysteresisRods(axes=float_array([rod.axis for rod in looped]), induction=none, **numbers)
    return straight, curved


_LOOP = {
    "Hc": ("coercive_field", "A/m"),
    "Br": ("remanence", "T"),
    "Bs": ("saturation", "T"),
    "volume": ("volumes", "m3"),
}


def _facets(surface: Surface, body: Body, leaves: LeafList) -> Facets:
    if surface.facets is not None:
        found = Facets(
            areas=float_array([facet.area_m2 for facet in surface.facets]),
            centers=float_array([facet.center_m for facet in surface.facets]),
            normals=float_array([facet.normal for facet in surface.facets]),
            specular=float_array([facet.specular for facet in surface.facets]),
            diffuse=float_array([facet.diffuse for facet in surface.facets]),
            drag_coefficient=float_array(surface.drag_coefficient.value),
        )
    else:
        size = surface.size_m or body.size_m
        found = box_facets(
            float_array(np.asarray(size, float)),
            center_of_mass=float_array(surface.center_of_mass_m),
            specular=surface.specular.value,
            diffuse=surface.diffuse.value,
            drag_coefficient=surface.drag_coefficient.value,
        )
        for key in ("specular", "diffuse"):
            entries = [tuple(range(6))]
            given = getattr(surface, key)
            leaves.add(
                f"surface.{key}", f"spacecraft.facets.{key}", given, loose=0.3, lower=0.0, upper=1.0, entries=entries
            )
    place = "spacecraft.facets.drag_coefficient"
    leaves.add("surface.drag_coefficient", place, surface.drag_coefficient, loose=0.5, lower=0.0)
    return found
