"""The satellite of a configuration: the bundled file of Munin with the configuration's numbers in it."""

import tomllib
from typing import TYPE_CHECKING, Any

import numpy as np

from jaxsat.bundled import MUNIN_SATELLITE

if TYPE_CHECKING:
    from jaxsat.cli.settings.sections import Config
    from jaxsat.satellites import Satellite

QUOTED_FIELD_T = 3.0e-5
"""Field in which results quote the moments of rods."""
LEAST_IMAX = 0.05
"""Bound of the largest current, of the nominal one: none is blind."""
LIMB = "limb"
"""Channel of limb angles."""


def satellite_of_config(config: "Config", *, limb: bool = False) -> "Satellite":
    """Munin as the configuration has it; with `limb` one that measures limb angles too.

    Raises `InputError` naming what of the configuration cannot be.
    """
    from jaxsat.satellites.satellite import satellite_of

    return satellite_of(_tables(config, limb), MUNIN_SATELLITE)


def _tables(config: "Config", limb: bool) -> dict[str, Any]:
    tables = tomllib.loads(MUNIN_SATELLITE.read_text(encoding="utf-8"))
    craft, prior, fit = config.spacecraft, config.fit.prior_sigma, config.fit
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
        tables["albedo"][name] |= {"value": getattr(config.albedo, name), "sigma": prior.albedo}
    cells = tables["sensors"]["cells"]
    cells["imax"] |= {
        "value": craft.imax_mA,
        "sigma": prior.imax_relative * craft.imax_mA,
        "bounds": [LEAST_IMAX * craft.imax_mA, cells["imax"]["bounds"][1]],
    }
    cells["gain"] |= {"value": list(craft.gains), "sigma": prior.gains}
    cells["tilts_deg"] |= {"value": [list(pair) for pair in craft.panel_tilts_deg], "sigma": prior.tilts_deg}
    channel = tables["channels"]["cells"]
    channel |= {"sigma": fit.noise_mA, "zero_is_floor": fit.zero_is_floor}
    channel |= {"quantum": fit.quantum_mA} if fit.quantum_mA else {}
    if not fit.quantum_mA:
        del channel["quantum"]
    tables["gauge"]["hold"] = [name for name in tables["gauge"]["hold"] if name != "magnet" or craft.magnet().any()]
    if limb:
        tables["sensors"][LIMB] = {"kind": "limb", "earth_radius_km": config.earth.radius_km}
        tables["channels"][LIMB] = {
            "columns": ["distance", "turn"],
            "unit": "deg",
            "sigma": fit.limb_sigma_deg / fit.limb_weight**0.5,
        }
    return tables
