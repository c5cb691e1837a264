"""A satellite of Munin's kind with sensors of its own: the bundled file of Munin with other numbers in it."""

import tomllib
from typing import Any

import numpy as np
from pydantic import Field

from jaxsat.bundled import MUNIN_SATELLITE
from jaxsat.satellites.numbers import SatelliteNumbers
from jaxsat.satellites.satellite import Satellite, satellite_of
from jaxsat.setting_types import NonNegative, Positive, Section

QUOTED_FIELD_T = 3.0e-5
"""Field in which results quote the moments of rods."""
LEAST_IMAX = 0.05
"""Bound of the largest current, of the nominal one: no panel is blind."""
LIMB = "limb"
"""Channel of limb angles."""


class PriorSigma(Section):
    """Weak priors about the nominal values, 1-sigma."""

    magnet_A_m2: Positive = Field(default=0.05, description="each component [A m2]")
    rods_A_m2: Positive = Field(default=0.05, description="each rod [A m2]")
    imax_relative: Positive = Field(default=0.2, description="relative to imax_mA [1]")
    gains: Positive = Field(default=0.1, description="each gain [1]")
    inertia_relative: Positive = Field(
        default=0.15, description="each entry, relative to the mean moment of inertia [1]"
    )
    albedo: Positive = Field(default=0.5, description="each reflectivity [1]")
    tilts_deg: Positive = Field(default=2.0, description="each turn of a panel [deg]")


class Readings(Section):
    """What the telemetry's numbers are worth."""

    noise_mA: Positive = Field(default=2.0, description="1-sigma of a current [mA]")
    quantum_mA: NonNegative = Field(default=1.0, description="step in which currents are telemetered [mA]")
    zero_is_floor: bool = Field(
        default=True,
        description="a current of 0 was half a step or less, for the telemetry has nothing below it; false where 0 is "
        "a current as any other",
    )


def described(
    numbers: SatelliteNumbers,
    *,
    prior: PriorSigma | None = None,
    readings: Readings | None = None,
    limb_sigma_deg: float | None = None,
    earth_radius_km: float = 6371.2,
) -> Satellite:
    """The satellite of these numbers, which `prior` is about, with the channels of a RAW_SUN file.

    With `limb_sigma_deg`, the 1-sigma of a limb angle on a sphere of `earth_radius_km`, also one of limb angles.
    Raises `InputError` naming what cannot be.
    """
    tables = tomllib.loads(MUNIN_SATELLITE.read_text(encoding="utf-8"))
    craft, prior, readings = numbers.spacecraft, prior or PriorSigma(), readings or Readings()
    inertia = craft.inertia_kg_m2.tensor()
    quoted = QUOTED_FIELD_T / craft.reference_field_T
    tables["body"]["inertia_kg_m2"] = {
        "value": inertia.tolist(),
        "sigma": prior.inertia_relative * float(np.trace(inertia)) / 3.0,
    }
    tables["magnet"]["dipole_A_m2"] = {"value": craft.magnet().tolist(), "sigma": prior.magnet_A_m2}
    for rod, moment in zip(tables["rods"], craft.rods_A_m2, strict=True):
        rod["moment"] |= {"value": quoted * moment, "sigma": quoted * prior.rods_A_m2}
    for name in ("specular", "diffuse"):
        tables["albedo"][name] |= {"value": getattr(numbers.albedo, name), "sigma": prior.albedo}
    cells, imax = tables["sensors"]["cells"], craft.imax_mA
    cells["imax"] |= {"value": imax, "sigma": prior.imax_relative * imax}
    cells["imax"]["bounds"] = [LEAST_IMAX * imax, max(1e5, 10.0 * imax)]
    cells["gain"] |= {"value": list(craft.gains), "sigma": prior.gains}
    cells["tilts_deg"] |= {"value": [list(pair) for pair in craft.panel_tilts_deg], "sigma": prior.tilts_deg}
    tables["channels"]["cells"] |= _noise(readings)
    # A magnet of no length holds nothing.
    tables["gauge"]["hold"] = [name for name in tables["gauge"]["hold"] if name != "magnet" or craft.magnet().any()]
    if limb_sigma_deg is not None:
        tables["sensors"][LIMB] = {"kind": "limb", "earth_radius_km": earth_radius_km, "noise": "sphere"}
        angles = {"columns": ["distance_deg", "turn_deg"], "unit": "deg", "sigma": limb_sigma_deg}
        tables["channels"][LIMB] = angles
    return satellite_of(tables, MUNIN_SATELLITE)


def _noise(readings: Readings) -> dict[str, Any]:
    # Without a step there is no floor either, but for zero itself.
    step = {"quantum": readings.quantum_mA or 1e-9, "zero_is_floor": readings.zero_is_floor}
    return {"sigma": readings.noise_mA, **step}
