"""Rods of soft magnetic material with hysteresis (Flatley & Henretty 1995), minor loops included.

With H the field along a rod, the boundary loops are B = (2 Bs/pi) atan(k (H -+ Hc)), k = tan(pi Br / (2 Bs)) / Hc.
Everywhere dB/dH is the slope of a boundary loop at the same B times Q = q0 + (1 - q0) F^p, F the distance from the
boundary left behind over the width 2 Hc, held within 0 to 1. The state kept here is not B but the lag z, in which the
law is

    B = (2 Bs/pi) atan(k (H - Hc z)),   Hc dz/dt = (1 - Q) dH/dt,   F = (1 + z sign(dH/dt)) / 2 in 0..1.

The boundary loops are z = +-1. A rod may be beyond them: one without flux in a field of more than Hc is. As the field
goes on it then moves parallel to the loop, and when it turns its flux stands still (but for q0) until it is within. So
does a step that ends beyond a loop stay there until the field turns: steps are good while H changes by less than Hc.
"""

import math
from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxsat.constants import VACUUM_PERMEABILITY
from jaxsat.spacecraft import HysteresisRods, Spacecraft
from jaxsat.torques.abstract import AbstractTorque, BodyEnvironment, required
from jaxsat.torques.magnetic import magnetic_torque


def steepness(rods: HysteresisRods) -> Float[Array, " rods"]:
    return jnp.tan(0.5 * math.pi * rods.remanence / rods.saturation) / rods.coercive_field


def field_along_rods(rods: HysteresisRods, b_field_body: Float[Array, "3"]) -> Float[Array, " rods"]:
    """Magnetic field strength along each rod, B . e / mu0 [A/m], of a flux density in body axes [T]."""
    return rods.axes @ b_field_body / VACUUM_PERMEABILITY


def induction_from_lag(
    rods: HysteresisRods, lag: Float[Array, " rods"], b_field_body: Float[Array, "3"]
) -> Float[Array, " rods"]:
    """Flux density in each rod [T] in a field [T]."""
    effective = field_along_rods(rods, b_field_body) - rods.coercive_field * lag
    return 2.0 / math.pi * rods.saturation * jnp.arctan(steepness(rods) * effective)


def lag_from_induction(
    rods: HysteresisRods, induction: Float[Array, " rods"], b_field_body: Float[Array, "3"]
) -> Float[Array, " rods"]:
    """Lag of rods with a flux density [T], within 0.999 of saturation, in a field [T].

    Zero induction, a demagnetised rod, is where a simulation usually starts: in a strong field beyond the loops.
    """
    saturated = jnp.clip(induction / rods.saturation, -0.999, 0.999)
    effective = jnp.tan(0.5 * math.pi * saturated) / steepness(rods)
    return (field_along_rods(rods, b_field_body) - effective) / rods.coercive_field


def lag_rate(
    rods: HysteresisRods,
    lag: Float[Array, " rods"],
    b_field_rate_body: Float[Array, "3"],
    rising: Bool[Array, " rods"] | None = None,
) -> Float[Array, " rods"]:
    """Time derivative of the lag [1/s]; `b_field_rate_body` is that of the field's components in body axes [T/s].

    Continuous where the field turns, with a break in its slope: a fixed-step method falls to second order there. With
    `rising` the branches of the law are those of a field that rises or falls, whatever it does: without the break.
    """
    field_rate = field_along_rods(rods, b_field_rate_body)
    return _share(rods, lag, field_rate >= 0.0 if rising is None else rising) * field_rate / rods.coercive_field


def lag_along_branch(
    rods: HysteresisRods, lag: Float[Array, " rods"], rising: Bool[Array, " rods"], field_change: Float[Array, " rods"]
) -> Float[Array, " rods"]:
    """Lag after the field along the rods has changed [A/m] by less than Hc, forward or back along one branch.

    On a branch the lag depends on the field alone; one step of RK4 in the field, whose error is its fifth power.
    """
    step = field_change / rods.coercive_field
    a = _share(rods, lag, rising)
    b = _share(rods, lag + 0.5 * step * a, rising)
    c = _share(rods, lag + 0.5 * step * b, rising)
    d = _share(rods, lag + step * c, rising)
    return lag + step / 6.0 * (a + 2.0 * b + 2.0 * c + d)


def _share(rods: HysteresisRods, lag: Float[Array, " rods"], rising: Bool[Array, " rods"]) -> Float[Array, " rods"]:
    """1 - Q: change of the lag with the field over Hc, on the branch of rising or falling fields."""
    distance = jnp.clip(0.5 * (1.0 + jnp.where(rising, lag, -lag)), 0.0, 1.0)
    return (1.0 - rods.initial_slope) * (1.0 - distance**rods.exponent)


def hysteresis_dipole(
    rods: HysteresisRods, lag: Float[Array, " rods"], b_field_body: Float[Array, "3"]
) -> Float[Array, "3"]:
    """Sum of the rods' moments V B / mu0, body axes [A m^2] (Flatley & Henretty 1995; Gerhardt & Palo 2010).

    Less the field's own share, V H, they would be two thousandths smaller: less than the apparent numbers are known to.
    """
    return moment_of_induction(rods, induction_from_lag(rods, lag, b_field_body))


def moment_of_induction(rods: HysteresisRods, induction: Float[Array, " rods"]) -> Float[Array, "3"]:
    """Sum of the moments of rods with a flux density [T], body axes [A m^2]."""
    return (rods.volumes * induction / VACUUM_PERMEABILITY) @ rods.axes


class HysteresisRodsTorque(AbstractTorque):
    """Torque on the moment of the hysteresis rods, whose lag is integrated with the attitude."""

    smooth: ClassVar[bool] = False

    def __call__(self, spacecraft: Spacecraft, around: BodyEnvironment) -> Float[Array, "3"]:
        user, source = "HysteresisRodsTorque", "AttitudeState(..., rod_lag=lag_from_induction(...))"
        rods = required(spacecraft.hysteresis_rods, user, "Spacecraft.hysteresis_rods", "the rods, as HysteresisRods")
        lag = required(around.rod_lag, user, "AttitudeState.rod_lag", source)
        return magnetic_torque(hysteresis_dipole(rods, lag, around.b_field_body), around.b_field_body)
