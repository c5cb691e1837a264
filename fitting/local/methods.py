"""The local methods by name: from a prepared session to an attitude of each sample by itself."""

from typing import Literal

import jax.numpy as jnp
import numpy as np

from fitting.local.session import LocalSamples, solve_field_roll, solve_five_parameters, solve_sun_field
from fitting.local.shares import mirror_earth, mirror_light
from fitting.local.solutions import LocalSolutions
from fitting.measurements.observations import Observations, tabulate
from fitting.session import PreparedSession
from jaxsat.errors import InputError
from jaxsat.satellites import SatelliteNumbers
from jaxsat.satellites.assembly import assembled_panels
from jaxsat.sensors import Albedo

Method = Literal["field-roll", "five-parameter", "sun-field"]
DIRECTIONS = {"along": (1.0,), "against": (-1.0,), "both": (1.0, -1.0)}
"""Signs of body x on the field's line by name."""
SUN_SIGMA_DEG, FIELD_SIGMA_UT = 10.0, 0.5
"""Errors of a Sun seen by six panels in the light of the Earth, and of a magnetometer, where not given."""


def local_samples(
    prepared: PreparedSession,
    satellite: SatelliteNumbers,
    *,
    noise_mA: float,
    arc_s: tuple[float, float] | None = None,
    earth: Literal["mirror", "diffuse"] = "mirror",
) -> tuple[Observations, LocalSamples]:
    """Samples of the arc with the light and the field on them; raises `InputError`."""
    try:
        observed = prepared.observations(arc_s)
    except InputError as error:
        raise InputError(error.reason, file=prepared.session.path, row=error.row, field=error.field) from None
    table, light = tabulate(
        observed.orbit,
        observed.field,
        *(jnp.asarray(x) for x in (observed.greenwich_angle, observed.earth_rotation_rate, observed.earth_radius)),
        observed.t,
        observed.t,
        observed.sun_eci,
    )
    mirror = earth == "mirror"
    return observed, LocalSamples(
        observed.currents,
        np.asarray(table.b_field_eci),
        mirror_light(light) if mirror else light,
        assembled_panels(satellite),
        mirror_earth() if mirror else Albedo(jnp.asarray(0.0), jnp.asarray(1.0)),
        1e-3 * noise_mA,
    )


def solve(
    method: Method,
    prepared: PreparedSession,
    observed: Observations,
    samples: LocalSamples,
    *,
    albedo_max: float | None = None,
    direct_sigma: float | None = None,
    x: Literal["along", "against", "both"] | None = None,
    sun_sigma_deg: float = SUN_SIGMA_DEG,
    field_sigma_uT: float = FIELD_SIGMA_UT,
) -> LocalSolutions:
    """Attitudes of the samples by one of the methods; `x` is the direction of body x on the field's line."""
    given = {} if x is None else {"directions": DIRECTIONS[x]}
    if method == "five-parameter":
        return solve_five_parameters(samples, max_albedo=albedo_max, direct_sigma=direct_sigma, **given)
    limit = 1.0 if albedo_max is None else albedo_max
    if method == "field-roll":
        return solve_field_roll(samples, max_albedo=limit, **given)
    session = prepared.session
    readings = 1e-6 * session.b_field_uT[np.isin(session.t_s, observed.t)]
    field_body = np.column_stack([np.full(len(readings), np.nan), readings])
    return solve_sun_field(
        samples,
        field_body,
        sun_sigma=np.radians(sun_sigma_deg),
        field_sigma=1e-6 * field_sigma_uT,
        max_albedo=limit,
        **given,
    )
