"""`jaxsat orbit`: Keplerian elements from the positions of a session (the program `raw_Or`)."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from jaxsat.bundled import BUNDLED
from jaxsat.cli.shared.folders import default_folder
from jaxsat.cli.shared.options import ConfigFile, Drop
from jaxsat.cli.shared.talk import USUAL, Talking

if TYPE_CHECKING:
    from fitting.orbit.orbit_fit import OrbitFit
    from jaxsat.telemetry import Session

SCHEMA = "jaxsat.orbit/1"
FILES = ("residuals_before.png", "residuals_after.png", "residuals.csv", "orbit.json")


def _check_doubtful(_: Any, value: float) -> None:
    if not value >= 2.0:
        raise ValueError(f"Expected 2 sigmas or more, or inf to drop nothing, got {value:g}.")


def orbit(
    file: Annotated[Path | None, Parameter(help="RAW_SUN file. [default: a bundled synthetic one]")] = None,
    /,
    *,
    doubtful: Annotated[
        float,
        Parameter(
            help="Positions more than this many sigmas off the fit are dropped, and the elements found again without "
            "them; inf drops nothing.",
            validator=_check_doubtful,
        ),
    ] = 6.0,
    average: Annotated[
        Literal["median", "mean"],
        Parameter(help="Of the integrals of energy, area and Laplace that the start is made from."),
    ] = "median",
    config: ConfigFile = None,
    drop: Drop = None,
    out: Annotated[Path, Parameter(help="Directory for the results.")] = default_folder("orbit"),
    plots: Annotated[bool, Parameter(help="Draw pictures.")] = True,
    talk: Talking = USUAL,
) -> int:
    """Find the Keplerian elements of a session's positions, and the residuals before and after.

    The start comes from averaged integrals of positions and velocities, the
    elements from least squares on positions alone.
    Writes orbit.json, residuals.csv, residuals_before.png, residuals_after.png.

    Exit status: 0 done, 1 bad input, 2 wrong usage, 3 not converged.

    Example: jaxsat orbit a.RAW_SUN --average mean --doubtful 3 --out a-orbit
    """
    from jaxsat.cli.settings.given import read_settings

    settings = read_settings(config, drop=drop)
    if file is None:
        talk.note(f"no file given: the orbit of the bundled synthetic session {BUNDLED.name}")
        file = BUNDLED

    from jaxsat.numerics import set_up_jax

    set_up_jax()
    import numpy as np

    from fitting.orbit.orbit_fit import fit_without_doubtful
    from jaxsat.files.csv_files import write_columns_csv
    from jaxsat.files.json_files import plain, write_json
    from jaxsat.files.staging import staged_directory
    from jaxsat.telemetry import read_session

    with staged_directory(out, FILES) as stage:
        session = read_session(file, settings.numbers, cleaning=settings.cleaning)
        everything, kept = fit_without_doubtful(
            session.t_s,
            session.position_eci_m,
            session.velocity_eci_m_s,
            sigmas=doubtful,
            average=np.mean if average == "mean" else np.median,
            file=file,
        )
        if plots:
            for name, png in _pictures(session, kept).items():
                (stage / name).write_bytes(png)
        columns = {
            f"{when}_{axis}_km": residual[:, k] / 1e3
            for when, residual in (("before", kept.residual_before_m), ("after", kept.residual_after_m))
            for k, axis in enumerate("xyz")
        }
        columns["doubtful"] = kept.outlier.astype(float)
        write_columns_csv(stage / "residuals.csv", session.t_s, session.epoch, columns)
        chosen = {"average": average, "doubtful_sigmas": doubtful if math.isfinite(doubtful) else "inf"}
        document = _document(session, everything, kept, chosen, file)
        write_json(stage / "orbit.json", plain(document)[0])
    talk.result(*_summary(session, everything, kept), f"\nresults in {out}", document=out / "orbit.json")
    return 0 if kept.converged else 3


def _document(
    session: "Session", everything: "OrbitFit", kept: "OrbitFit", settings: dict[str, Any], file: Path
) -> dict[str, Any]:
    """Returns the content of orbit.json; SI units and radians."""
    from fitting.report.orbit_document import FRAME, orbit_document

    left_out = session.t_s[kept.outlier]
    return {
        "schema": SCHEMA,
        "telemetry": str(file),
        "sha256": session.sha256,
        "epoch_utc": session.epoch.iso(3),
        "frame": FRAME,
        "settings": settings,
        "status": "converged" if kept.converged else "not_converged",
        "message": kept.message,
        "samples": session.t_s.size,
        "doubtful_t_s": left_out,
        **orbit_document(kept),
        "all_positions": orbit_document(everything),
    }


def _pictures(session: "Session", fit: "OrbitFit") -> dict[str, bytes]:
    from jaxsat.plotting import draw_orbit_stage, png_bytes
    from jaxsat.plotting.preparation import ORBIT_STAGES

    subtitle = f"{session.name}, epoch {session.epoch.iso(3)} UTC"
    residuals = (fit.residual_before_m / 1e3, fit.residual_after_m / 1e3)
    figures = (
        draw_orbit_stage(session.t_s, residual, fit.outlier, stage=stage, subtitle=subtitle)
        for residual, stage in zip(residuals, ORBIT_STAGES, strict=True)
    )
    return dict(zip(FILES[:2], map(png_bytes, figures), strict=True))


def _summary(session: "Session", everything: "OrbitFit", kept: "OrbitFit") -> list[Any]:
    from fitting.report.rows import element_rows
    from jaxsat.cli.shared.terminal import plain_table
    from jaxsat.significant import count_text

    total, dropped = session.t_s.size, int(kept.outlier.sum())
    table = plain_table("orbital element", "value", "1σ", "unit", right=(1,))
    for row in element_rows(kept.elements, kept.sigma):
        table.add_row(*row)
    residuals = plain_table("position residuals, RMS of a coordinate", "before, m", "after, m", right=(1, 2))
    rows = {f"all {total} positions": everything}
    if dropped:
        rows[f"without {count_text(dropped, 'doubtful one')}"] = kept
    for name, fit in rows.items():
        residuals.add_row(name, f"{fit.rms_before_m:.1f}", f"{fit.rms_after_m:.1f}")
    perigee = f"perigee at t = {kept.time_of_perigee_s:.3f} s, epoch {session.epoch.iso(3)} UTC"
    return [table, perigee, residuals]
