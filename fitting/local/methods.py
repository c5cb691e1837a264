"""The local methods by name: from a prepared session to an attitude of each sample by itself."""

from typing import Literal

import jax.numpy as jnp
import numpy as np

from fitting.local.session import LocalSamples, solve_field_roll, solve_five_parameters, solve_sun_field
from fitting.local.shares import mirror_earth, mirror_light
from fitting.local.solutions import LocalSolutions
from fitting.measurements.sky import sky_at
from fitting.session import PreparedSession
from jaxsat.satellites import SatelliteNumbers
from jaxsat.satellites.assembly import assembled_panels
from jaxsat.sensors import Albedo

Method = Literal["field-roll", "five-parameter", "sun-field"]
DIRECTIONS = {"along": (1.0,), "against": (-1.0,), "both": (1.0, -1.0)}
"""Signs of the magnet's axis on the field's line by name."""
SUN_SIGMA_DEG, FIELD_SIGMA_UT = 10.0, 0.5
"""Errors of a Sun seen by six panels in the light of the Earth, and of a magnetometer, where not given."""


def local_samples(
    prepared: PreparedSession,
    satellite: SatelliteNumbers,
    *,
    noise_mA: float,
    arc_s: tuple[float, float] | None = None,
    earth: Literal["mirror", "diffuse"] = "mirror",
    axis_body: tuple[float, float, float] | None = None,
) -> LocalSamples:
    """Samples of the arc with the light and the field on them; raises `InputError`.

    `axis_body` is what a magnet holds along the field, by default the satellite's dipole, or x where it has none.
    """
    axis = np.array(satellite.spacecraft.magnet() if axis_body is None else axis_body, float)
    if not axis.any():
        axis = np.array([1.0, 0.0, 0.0])
    inside, session = prepared.within(arc_s), prepared.session
    t = session.t_s[inside]
    sky = sky_at(prepared.around, t, prepared.sun_eci(t), {})
    assert sky.light is not None
    mirror = earth == "mirror"
    return LocalSamples(
        t,
        1e-3 * session.currents_mA[inside],
        np.asarray(sky.b_field_eci),
        mirror_light(sky.light) if mirror else sky.light,
        assembled_panels(satellite),
        mirror_earth() if mirror else Albedo(jnp.asarray(0.0), jnp.asarray(1.0)),
        1e-3 * noise_mA,
        axis / np.linalg.norm(axis),
    )


def solve(
    method: Method,
    prepared: PreparedSession,
    samples: LocalSamples,
    *,
    albedo_max: float | None = None,
    direct_sigma: float | None = None,
    x: Literal["along", "against", "both"] | None = None,
    sun_sigma_deg: float = SUN_SIGMA_DEG,
    field_sigma_uT: float = FIELD_SIGMA_UT,
) -> LocalSolutions:
    """Attitudes of the samples by one of the methods; `x` is the direction of the magnet's axis on the field's
    line, for sun-field that of body x.
    """
    given = {} if x is None else {"directions": DIRECTIONS[x]}
    if method == "five-parameter":
        return solve_five_parameters(samples, max_albedo=albedo_max, direct_sigma=direct_sigma, **given)
    limit = 1.0 if albedo_max is None else albedo_max
    if method == "field-roll":
        return solve_field_roll(samples, max_albedo=limit, **given)
    session = prepared.session
    readings = 1e-6 * session.b_field_uT[np.isin(session.t_s, samples.t)]
    field_body = np.column_stack([np.full(len(readings), np.nan), readings])
    return solve_sun_field(
        samples,
        field_body,
        sun_sigma=np.radians(sun_sigma_deg),
        field_sigma=1e-6 * field_sigma_uT,
        max_albedo=limit,
        **given,
    )
