"""`jaxsat prepare`: reading, cleaning and orbit of a session, and what was dropped and why."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from jaxsat.bundled import BUNDLED
from jaxsat.cli.shared.folders import default_folder
from jaxsat.cli.shared.options import ConfigFile, Drop
from jaxsat.cli.shared.talk import USUAL, Talking

if TYPE_CHECKING:
    from fitting.session import PreparedSession
    from jaxsat.cli.settings.fit import FitSection
    from jaxsat.satellites import SatelliteNumbers

SCHEMA = "jaxsat.prepare/1"
FILES = ("coordinates.png", "magnetometers.png", "currents.png", "orbit_residuals.png", "samples.csv", "prepare.json")


def prepare(
    file: Annotated[Path | None, Parameter(help="RAW_SUN file. [default: a bundled synthetic one]")] = None,
    /,
    *,
    config: ConfigFile = None,
    drop: Drop = None,
    out: Annotated[Path, Parameter(help="Directory for the results.")] = default_folder("prepare"),
    plots: Annotated[bool, Parameter(help="Draw pictures.")] = True,
    talk: Talking = USUAL,
) -> int:
    """Read and clean a session, fit its orbit, and show what was left out and why.

    Writes prepare.json, samples.csv and pictures before and after cleaning.

    Exit status: 0 done, 1 bad input, 2 wrong usage.

    Example: jaxsat prepare a.RAW_SUN --drop 2000 2500 --out a-prepared
    """
    from jaxsat.cli.settings.given import read_settings

    settings = read_settings(config, drop=drop)
    if file is None:
        talk.note(f"no file given: preparing the bundled synthetic session {BUNDLED.name}")

    from fitting.session import prepare_session
    from jaxsat.cli.prepare.samples import write_samples_csv
    from jaxsat.cli.prepare.text import preparation_summary
    from jaxsat.files.json_files import plain, write_json
    from jaxsat.files.staging import staged_directory
    from jaxsat.numerics import set_up_jax
    from jaxsat.telemetry import read_session

    set_up_jax()
    with staged_directory(out, FILES) as stage:
        session = read_session(file or BUNDLED, settings.numbers, cleaning=settings.cleaning)
        prepared = prepare_session(session, settings.given)
        if plots:
            for name, png in draw_preparation(prepared).items():
                (stage / name).write_bytes(png)
        write_samples_csv(stage / "samples.csv", prepared.session)
        write_json(stage / "prepare.json", plain(preparation_document(prepared, settings.numbers, settings.fit))[0])
    summary = preparation_summary(prepared.session, prepared.orbit_fit, prepared.label)
    talk.result(summary, f"\nresults in {out}", document=out / "prepare.json")
    return 0


def preparation_document(
    prepared: "PreparedSession", satellite: "SatelliteNumbers", settings: "FitSection"
) -> dict[str, Any]:
    """Returns the content of prepare.json; SI units and radians but where a name says otherwise."""
    from fitting.report.orbit_document import orbit_document
    from fitting.report.settings_document import settings_document

    session = prepared.session
    return {
        "schema": SCHEMA,
        "telemetry": prepared.telemetry,
        "sha256": session.sha256,
        "satellite": session.raw.satellite,
        "epoch_utc": session.epoch.iso(3),
        "rows": session.raw_t_s.size,
        "samples": session.t_s.size,
        "rejections": [{"row": r.row, "reason": r.reason, "detail": r.detail} for r in session.rejections],
        **orbit_document(prepared.orbit_fit),
        "greenwich_angle_rad": prepared.greenwich_angle,
        "sun_direction_eci": prepared.sun_eci(session.t_s)[0],
        "settings": settings_document(prepared, satellite, settings),
    }


def draw_preparation(prepared: "PreparedSession") -> dict[str, bytes]:
    """Returns the pictures of cleaning as PNG by file name."""
    from jaxsat.plotting import (
        draw_coordinates,
        draw_magnetometers,
        draw_orbit_residuals,
        draw_panel_currents,
        png_bytes,
    )

    s, subtitle = prepared.session, prepared.subtitle
    before, after = prepared.orbit_fit.residual_before_m, prepared.orbit_fit.residual_after_m
    figures = {
        "coordinates.png": draw_coordinates(
            s.raw_t_s, s.raw.position_eci_km, s.t_s, s.position_eci_m / 1e3, subtitle=subtitle
        ),
        "magnetometers.png": draw_magnetometers(
            s.raw_t_s, s.raw.magnetometer_uT, s.t_s, s.b_field_uT, subtitle=subtitle
        ),
        "currents.png": draw_panel_currents(
            s.raw_t_s, s.raw_currents_mA, s.t_s, s.currents_mA, raw_used=s.raw_used, subtitle=subtitle
        ),
        "orbit_residuals.png": draw_orbit_residuals(s.t_s, before / 1e3, after / 1e3, subtitle=subtitle),
    }
    return {name: png_bytes(figure) for name, figure in figures.items()}
