"""`jaxsat local`: attitude of each sample by itself, without a model of the motion."""

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import CycloptsError, Parameter, validators

from jaxsat.cli.fit.command import read_settings
from jaxsat.cli.session.prepared import BUNDLED
from jaxsat.cli.shared.options import Arc, ConfigFile, Drop
from jaxsat.errors import InputError

if TYPE_CHECKING:
    from fitting.local.session import LocalSamples
    from fitting.local.solutions import LocalSolutions
    from fitting.measurements.observations import Observations
    from jaxsat.cli.session.prepared import PreparedSession
    from jaxsat.cli.settings.sections import Config

FILES = ("attitude.csv", "currents.csv", "currents.png", "attitude.png", "local.json")
Method = Literal["field-roll", "five-parameter", "sun-field"]
PROGRAM = {"field-roll": "OrbfiGraf", "five-parameter": "OptLoc", "sun-field": "OrSB"}
DIRECTIONS = {"along": (1.0,), "against": (-1.0,), "both": (1.0, -1.0)}
SUN_SIGMA_DEG, FIELD_SIGMA_UT = 10.0, 0.5
"""Errors of a Sun seen by six panels in the light of the Earth, and of a magnetometer, where not given."""


def local(
    file: Annotated[Path | None, Parameter(help="RAW_SUN file. [default: a bundled synthetic one]")] = None,
    /,
    *,
    method: Annotated[
        Method,
        Parameter(
            help="field-roll (OrbfiGraf): body x along the field or against it, best roll about it. five-parameter "
            "(OptLoc): three angles and two factors, where four panels show 2 mA. sun-field (OrSB): Sun from the "
            "currents, and the magnetometers."
        ),
    ] = "field-roll",
    albedo_max: Annotated[
        float | None,
        Parameter(
            help="Largest factor of the Earth's light over that of direct sunlight, albedomax. [default: 1 for "
            "field-roll, no limit for five-parameter]",
            validator=validators.Number(gte=0.0, lte=1e3),
        ),
    ] = None,
    earth: Annotated[
        Literal["mirror", "diffuse"], Parameter(help="How the Earth returns light: as published, or by Lambert's law.")
    ] = "mirror",
    x: Annotated[
        Literal["along", "against", "both"] | None,
        Parameter(
            help="Direction of body x on the field's line; for five-parameter that of its starts, for sun-field the "
            "sign of the component that is not measured. [default: along for five-parameter, else both]",
        ),
    ] = None,
    direct_sigma: Annotated[
        float | None,
        Parameter(
            help="Relative 1-sigma of spacecraft.imax_mA, for five-parameter: a fifth equation where four panels are "
            "lit. [default: not known, as published]",
            validator=validators.Number(gt=0.0, lte=10.0),
        ),
    ] = None,
    sun_sigma_deg: Annotated[
        float | None,
        Parameter(
            help="1-sigma of the Sun's direction from the currents, for sun-field: what the light of the Earth adds. "
            "[default: 10]",
            validator=validators.Number(gt=0.0, lte=90.0),
        ),
    ] = None,
    field_sigma_ut: Annotated[
        float | None,
        Parameter(
            name="--field-sigma-uT",
            help="1-sigma of a magnetometer axis, for sun-field. [default: 0.5]",
            validator=validators.Number(gt=0.0, lte=100.0),
        ),
    ] = None,
    config: ConfigFile = None,
    arc: Arc = None,
    drop: Drop = None,
    out: Annotated[Path, Parameter(help="Directory for the results.")] = Path("jaxsat-local"),
    plots: Annotated[bool, Parameter(help="Draw pictures.")] = True,
) -> int:
    """Find the attitude of each sample by itself, from six panel currents.

    Writes attitude.csv (direction cosines of the body axes and other attitudes
    that explain a sample), currents.csv (direct and returned sunlight apart),
    local.json and pictures. What cannot be told has a status and a reason.

    Exit status: 0 done, 1 bad input or no sample in sunlight, 2 wrong usage,
    3 no sample has an attitude.

    Example: jaxsat local a.RAW_SUN --albedo-max 0.3 --out a-local

    Example: jaxsat local --method five-parameter --direct-sigma 0.05
    """
    began = time.perf_counter()
    if direct_sigma is not None and method != "five-parameter":
        raise CycloptsError(msg="--direct-sigma is for --method five-parameter.")
    for option, value in {"--sun-sigma-deg": sun_sigma_deg, "--field-sigma-uT": field_sigma_ut}.items():
        if value is not None and method != "sun-field":
            raise CycloptsError(msg=f"{option} is for --method sun-field.")
    settings = read_settings(config, arc=arc, drop=drop)
    if file is None:
        print(f"jaxsat: no file given: taking the bundled synthetic session {BUNDLED.name}", file=sys.stderr)

    from jaxsat.cli.shared.numerics import set_up_jax

    notice = set_up_jax()
    if notice:
        print(f"jaxsat: {notice}", file=sys.stderr)
    from jaxsat.cli.local.files import local_summary, write_local
    from jaxsat.cli.session.prepared import prepare_session
    from jaxsat.cli.shared.staging import staged_directory
    from jaxsat.cli.shared.terminal import show

    with staged_directory(out, FILES) as stage:
        prepared = prepare_session(file or BUNDLED, settings)
        observed, samples = local_samples(prepared, settings, earth)
        limits: dict[str, Any] = {"albedo_max": albedo_max, "direct_sigma": direct_sigma, "x": x}
        if method == "sun-field":
            limits["sun_sigma_deg"] = SUN_SIGMA_DEG if sun_sigma_deg is None else sun_sigma_deg
            limits["field_sigma_uT"] = FIELD_SIGMA_UT if field_sigma_ut is None else field_sigma_ut
        solutions = solve(method, prepared, observed, samples, **limits)
        options = {"method": method, "program": PROGRAM[method], "earth": earth, **limits}
        write_local(stage, prepared, observed, samples, solutions, options=options, began=began, plots=plots)
    show(local_summary(solutions, f"{prepared.label}, {method}"), f"\nresults in {out}")
    return 0 if solutions.count.any() else 3


def local_samples(prepared: "PreparedSession", settings: "Config", earth: str) -> "tuple[Observations, LocalSamples]":
    """Samples of the arc with the light and the field on them; raises `InputError`."""
    import jax.numpy as jnp
    import numpy as np

    from fitting.local.session import LocalSamples
    from fitting.local.shares import mirror_earth, mirror_light
    from fitting.measurements.observations import tabulate
    from jaxsat.cli.session.inputs import nominal, observations
    from jaxsat.sensors import Albedo
    from jaxsat.spacecraft import SolarPanels, box_normals, tilted

    try:
        observed = observations(prepared.session, prepared.orbit_fit, settings)
    except InputError as error:
        raise InputError(error.reason, file=prepared.session.path, row=error.row, field=error.field) from None
    table, light = tabulate(
        observed.orbit,
        observed.field,
        jnp.asarray(observed.greenwich_angle),
        jnp.asarray(observed.earth_rotation_rate),
        jnp.asarray(observed.earth_radius),
        observed.t,
        observed.t,
        observed.sun_eci,
    )
    mirror = earth == "mirror"
    pattern = mirror_earth() if mirror else Albedo(jnp.asarray(0.0), jnp.asarray(1.0))
    craft = nominal(settings)
    panels = SolarPanels(
        tilted(box_normals(), jnp.asarray(craft.tilts.reshape(6, 2))),
        jnp.asarray(craft.max_current),
        jnp.asarray(craft.gains),
    )
    return observed, LocalSamples(
        observed.currents,
        np.asarray(table.b_field_eci),
        mirror_light(light) if mirror else light,
        panels,
        pattern,
        1e-3 * settings.fit.noise_mA,
    )


def solve(
    method: str,
    prepared: "PreparedSession",
    observed: "Observations",
    samples: "LocalSamples",
    *,
    albedo_max: float | None = None,
    direct_sigma: float | None = None,
    x: str | None = None,
    sun_sigma_deg: float = SUN_SIGMA_DEG,
    field_sigma_uT: float = FIELD_SIGMA_UT,
) -> "LocalSolutions":
    """Attitudes of the samples by one of the methods."""
    import numpy as np

    from fitting.local.session import solve_field_roll, solve_five_parameters, solve_sun_field

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
