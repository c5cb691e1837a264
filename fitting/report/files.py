"""Writes everything that a fit leaves in its directory."""

import dataclasses
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fitting.outcome.currents_diagnostics import diagnose
from fitting.outcome.result import FitResult
from fitting.outcome.sensed_verdict import Witness
from fitting.parameters.names import NAMED, STATE
from fitting.profile.profile import Profile
from fitting.report.document import (
    ATTITUDE_COLUMNS,
    CURRENT_COLUMNS,
    fit_document,
    limb_document,
    write_attitude_csv,
    write_currents_csv,
)
from fitting.report.orbit_document import elements_document, orbit_states
from fitting.report.page import fit_page
from fitting.report.rows import parameter_rows, profile_picture
from fitting.report.scene import Sky, scene_document
from fitting.report.sensed.document import witness_document
from fitting.report.settings_document import settings_document
from fitting.session import PreparedSession
from fitting.settings import FitSettings
from jaxsat.files.json_files import plain, write_json
from jaxsat.satellites import SatelliteNumbers
from jaxsat.significant import unit_text
from jaxsat.telemetry import MatchedLimbAngles
from jaxsat.versions import versions

FILES = (
    "attitude.csv",
    "currents.csv",
    "currents.png",
    "field_angle.png",
    "orbit.png",
    "parameters.png",
    "provenance.json",
    "report.html",
    "scene.json",
    "fit.json",
    *(profile_picture(name) for name in STATE + NAMED),
)
"""All names that a fit may write."""


def write_fit(
    directory: Path,
    result: FitResult,
    prepared: PreparedSession,
    satellite: SatelliteNumbers,
    settings: FitSettings,
    *,
    sky: Sky,
    began: float,
    plots: bool,
    profiles: Sequence[Profile] = (),
    limb: MatchedLimbAngles | None = None,
    witness: Witness | None = None,
    remarks: Sequence[str] = (),
) -> tuple[FitResult, list[str]]:
    """Writes the files of one fit; returns the result with its total time since `began` (perf_counter) and warnings.

    `sky` is what the motion happens in; `limb` are the limb angles that were fitted too; `witness` is a sensor that was
    asked about the motion; `remarks` are warnings that are there already.
    """

    epoch = prepared.session.epoch
    diagnostics = diagnose(result, noise_mA=settings.reading_sigma_mA)
    scene = scene_document(result, sky)
    pictures = {}
    if plots:
        pictures = {**draw_fit(result, prepared.subtitle, scene), **draw_profiles(profiles, prepared.subtitle)}
    for name, png in pictures.items():
        (directory / name).write_bytes(png)
    write_attitude_csv(directory / "attitude.csv", result, epoch)
    write_currents_csv(directory / "currents.csv", result, epoch)

    result = dataclasses.replace(result, timing_s={**result.timing_s, "total": time.perf_counter() - began})
    document, nulls = fit_document(
        result,
        telemetry=prepared.telemetry,
        epoch=epoch,
        diagnostics=diagnostics,
        profiles=profiles,
        limb=None if limb is None else limb_document(limb, result),
        witness=None if witness is None else {witness.name: witness_document(witness)},
        orbit=orbit_states(prepared.session, prepared.orbit_fit, result.t_s),
    )
    warnings = [*remarks, *(f"{place} is not a finite number and stands as null in fit.json" for place in nulls)]
    if witness is not None and witness.denies:
        warnings.append(witness.text)
    if not prepared.orbit_fit.converged:
        warnings.append(f"orbit: {prepared.orbit_fit.message}")
    provenance = provenance_document(result, prepared, satellite, settings, warnings, limb)
    found = {"diagnostics": diagnostics, "profiles": profiles, "provenance": provenance, "scene": scene}
    (directory / "report.html").write_text(fit_page(result, pictures, **found), encoding="utf-8")
    if scene is not None:
        write_json(directory / "scene.json", scene)
    write_json(directory / "provenance.json", provenance)
    write_json(directory / "fit.json", document)
    return result, warnings


def draw_fit(result: FitResult, subtitle: str, scene: Mapping[str, Any] | None) -> dict[str, bytes]:
    """Returns the pictures of a fit as PNG by file name."""
    from jaxsat.plotting import draw_currents, draw_field_angle, draw_orbit, draw_parameters, png_bytes

    subtitle = f"{subtitle}, {result.status.replace('_', ' ')}"
    currents = draw_currents(
        result.t_s,
        result.measured_mA,
        result.modelled_mA,
        result.modelled_direct_mA,
        weight=result.weight,
        lit=result.lit,
        limited=result.limited,
        subtitle=subtitle,
    )
    field_angle = draw_field_angle(
        result.t_s,
        result.field_angle_deg,
        result.field_angle_sigma_deg,
        attitude_sigma_deg=result.attitude_sigma_deg,
        lit=result.lit,
        subtitle=subtitle,
    )
    footer = [f"Gauge: {result.gauge}"] if result.gauge else []
    parameters = draw_parameters(parameter_rows(result.parameters), subtitle=subtitle, footer=footer)
    figures = {
        "currents.png": currents,
        "field_angle.png": field_angle,
        **({} if scene is None else {"orbit.png": draw_orbit(scene, subtitle=subtitle)}),
        "parameters.png": parameters,
    }
    return {name: png_bytes(figure) for name, figure in figures.items()}


def draw_profiles(profiles: Sequence[Profile], subtitle: str) -> dict[str, bytes]:
    """Returns the pictures of profiles as PNG by file name."""
    from jaxsat.plotting import png_bytes
    from jaxsat.plotting.profile import draw_profile

    figures = {
        profile_picture(p.name): draw_profile(
            p.values,
            p.rise,
            best=p.best,
            sigma=p.sigma,
            interval_68=p.interval_68,
            interval_95=p.interval_95,
            name=p.name,
            unit=unit_text(p.unit),
            rise_data=p.rise_data,
            settled=p.settled,
            subtitle=subtitle,
        )
        for p in profiles
    }
    return {name: png_bytes(figure) for name, figure in figures.items()}


def provenance_document(
    result: FitResult,
    prepared: PreparedSession,
    satellite: SatelliteNumbers,
    settings: FitSettings,
    warnings: list[str],
    limb: MatchedLimbAngles | None = None,
) -> dict[str, Any]:
    """Returns what is needed to repeat the fit and to judge it, beside what fit.json holds."""
    session, orbit_fit = prepared.session, prepared.orbit_fit
    file = None if limb is None else {"file": str(limb.file.path), "sha256": limb.file.sha256}
    document = {
        "schema": "jaxsat.provenance/1",
        "telemetry": prepared.telemetry,
        "label": prepared.label,
        "epoch_utc": session.epoch.iso(3),
        "sha256": session.sha256,
        **({} if file is None else {"limb": file}),
        "seed": settings.seed,
        "versions": versions(),
        "settings": settings_document(prepared, satellite, settings),
        "warnings": warnings,
        "rows": session.raw_t_s.size,
        "samples": session.t_s.size,
        "orbit": elements_document(orbit_fit),
        "rejections": [{"row": r.row, "reason": r.reason, "detail": r.detail} for r in session.rejections],
        "columns": {"attitude.csv": ATTITUDE_COLUMNS, "currents.csv": CURRENT_COLUMNS},
        "notes": {p.name: p.note for p in result.parameters if p.note},
        "limited_t_s": result.t_s[result.limited.astype(bool)].tolist(),
        "alternatives": list(result.alternatives),
    }
    return plain(document)[0]
