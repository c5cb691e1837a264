"""Magnetorquers, wheels and thrusters of a satellite file, as control laws command them."""

import math
from collections.abc import Sequence

import numpy as np

from jaxsat.control.actuators import Magnetorquers, ReactionWheels, Thrusters
from jaxsat.errors import InputError
from jaxsat.satellites.satellite import Satellite
from jaxsat.satellites.sections.parts import Thruster, Wheel

RPM = 2.0 * math.pi / 60.0


def torquers_of(satellite: Satellite) -> Magnetorquers:
    """Those with a `max_dipole_A_m2`; `InputError` where the file has none."""
    coils = [coil for coil in satellite.coils if coil.max_dipole_A_m2 is not None]
    if not coils:
        raise InputError("has no [[coils]] with max_dipole_A_m2, which is needed here", file=satellite.path)
    dipoles = np.array([coil.max_dipole_A_m2 for coil in coils])
    return Magnetorquers.along(
        np.array([coil.axis for coil in coils]), dipoles, np.array([coil.residual for coil in coils])
    )


def wheels_of(satellite: Satellite) -> ReactionWheels:
    """Those with a `max_torque_N_m`; `InputError` where they do not span the body's axes."""
    wheels = [wheel for wheel in satellite.wheels if wheel.max_torque_N_m is not None]
    return ReactionWheels.along(
        _spanning(satellite, wheels, "[[wheels]] with max_torque_N_m"),
        np.array([wheel.inertia.value for wheel in wheels]),
        np.array([wheel.max_torque_N_m for wheel in wheels], float),
        RPM * np.array([wheel.max_speed_rpm for wheel in wheels], float),
        coulomb=np.array([wheel.coulomb_N_m for wheel in wheels]),
        viscous=np.array([wheel.viscous_N_m_s for wheel in wheels]),
    )


def thrusters_of(satellite: Satellite) -> Thrusters:
    """Those of the file; `InputError` where their axes do not span the body's."""
    found = satellite.thrusters
    axes = _spanning(satellite, found, "[[thrusters]]")
    numbers = np.array([(each.torque_N_m, each.lever_m, each.min_pulse_s) for each in found]).T
    return Thrusters.along(axes, *numbers)


def _spanning(satellite: Satellite, parts: Sequence[Wheel | Thruster], what: str) -> np.ndarray:
    """Axes of actuators [parts 3], with which any torque can be had."""
    axes = np.array([part.axis for part in parts]).reshape(-1, 3)
    if np.linalg.matrix_rank(axes, tol=1e-3) < 3:
        raise InputError(
            f"has no three {what} about axes that span the body's, which are needed here", file=satellite.path
        )
    return axes
