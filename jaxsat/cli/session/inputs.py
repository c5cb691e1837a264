"""From a prepared session and the configuration to what the fit takes, in SI."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from fitting.estimate import FitSettings
from fitting.measurements.observations import Observations
from fitting.parameters.names import parse_free
from fitting.parameters.parametrization import Nominal, PriorSigma
from fitting.solvers.adaptive import AdaptiveRules
from jaxsat.environment import apparent_sun, igrf_field
from jaxsat.errors import InputError
from jaxsat.telemetry.raw_sun.cleaning import check_usable
from jaxsat.time import greenwich_angle

if TYPE_CHECKING:
    from fitting.orbit.orbit_fit import OrbitFit
    from jaxsat.cli.settings.sections import Config
    from jaxsat.telemetry.raw_sun.cleaning import Session


@dataclass(frozen=True)
class Surroundings:
    """Earth's rotation and Sun of a session: found from it, or given by the configuration."""

    greenwich_angle: float
    """At t = 0 [rad]."""
    sun_eci: np.ndarray
    """[time 3] unit vectors at the samples."""


def surroundings(session: "Session", orbit_fit: "OrbitFit", config: "Config") -> Surroundings:
    """What the configuration gives of `globP` in place of what `Start` finds."""
    # The passage that the configuration means, which need not be the first after t = 0.
    perigee_s = config.orbit.time_of_perigee_s
    angle = config.earth.greenwich_angle(orbit_fit.time_of_perigee_s if perigee_s is None else perigee_s)
    if config.sun.direction_eci is None:
        sun_eci, _ = apparent_sun(session.epoch, session.t_s)
    else:
        direction = np.array(config.sun.direction_eci)
        sun_eci = np.broadcast_to(direction / np.linalg.norm(direction), (len(session.t_s), 3))
    return Surroundings(greenwich_angle(session.epoch) if angle is None else angle, sun_eci)


def observations(
    session: "Session", orbit_fit: "OrbitFit", config: "Config", limb: np.ndarray | None = None
) -> Observations:
    """Samples of the arc that is to be fitted; raises `InputError` where they cannot tell an attitude.

    `limb` [time 2] are the limb angles at all samples of the session [rad], NaN where not measured.
    """
    around = surroundings(session, orbit_fit, config)
    inside = np.ones(len(session.t_s), bool)
    if config.fit.arc_s is not None:
        begin, end = config.fit.arc_s
        inside = (session.t_s >= begin) & (session.t_s <= end)
        if not inside.any():
            raise InputError(
                f"no sample between {begin:g} and {end:g} s; the session runs from {session.t_s[0]:g} to "
                f"{session.t_s[-1]:g} s",
                file=session.path,
                field="arc",
            )
    arc = replace(session, t_s=session.t_s[inside], currents_mA=session.currents_mA[inside])
    check_usable(arc)
    return Observations(
        t=session.t_s[inside],
        currents=1e-3 * session.currents_mA[inside],
        orbit=orbit_fit.orbit,
        field=igrf_field(session.epoch.decimal_year()),
        greenwich_angle=around.greenwich_angle,
        earth_rotation_rate=config.earth.rotation_rate_rad_s,
        earth_radius=1e3 * config.earth.radius_km,
        sun_eci=around.sun_eci[inside],
        limb=None if limb is None else limb[inside],
    )


def nominal(config: "Config") -> Nominal:
    """The satellite of the configuration."""
    craft, inertia = config.spacecraft, config.spacecraft.inertia_kg_m2
    return Nominal(
        magnet=craft.magnet(),
        rods=np.array(craft.rods_A_m2),
        reference_field=craft.reference_field_T,
        inertia=np.array([inertia.xx, inertia.yy, inertia.zz, inertia.xy, inertia.xz, inertia.yz]),
        max_current=1e-3 * craft.imax_mA,
        gains=np.array(craft.gains),
        albedo=np.array([config.albedo.specular, config.albedo.diffuse]),
        tilts=np.radians(craft.panel_tilts_deg).ravel(),
    )


def fit_settings(config: "Config") -> FitSettings:
    """Choices of the fit."""
    fit, sigma = config.fit, config.fit.prior_sigma
    return FitSettings(
        free=parse_free(fit.free),
        starts=fit.starts,
        seed=fit.seed,
        noise_mA=fit.noise_mA,
        quantum_mA=fit.quantum_mA,
        zero_is_floor=fit.zero_is_floor,
        max_rate_deg_s=fit.max_rate_deg_s,
        step_s=fit.step_s,
        likelihood=fit.likelihood,
        solver=fit.solver,
        limb_sigma_deg=fit.limb_sigma_deg,
        limb_weight=fit.limb_weight,
        adaptive=AdaptiveRules(**fit.adaptive.model_dump(exclude={"on"})) if fit.adaptive.on else None,
        prior=PriorSigma(
            magnet=sigma.magnet_A_m2,
            rods=sigma.rods_A_m2,
            imax_relative=sigma.imax_relative,
            gains=sigma.gains,
            inertia_relative=sigma.inertia_relative,
            albedo=sigma.albedo,
            tilts_deg=sigma.tilts_deg,
        ),
    )
