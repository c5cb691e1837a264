"""Writes everything that a fit of any satellite leaves in its directory."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fitting.orbit.orbit_fit import OrbitFit
from fitting.outcome.result import FitResult
from fitting.report.curves_document import curves_document
from fitting.report.fit.document import fit_document
from fitting.report.fit.drawing import Draw
from fitting.report.fit.owned import file_stems
from fitting.report.fit.surroundings import Surroundings
from fitting.report.fit.tables import ATTITUDE_COLUMNS, write_attitude, write_channel
from fitting.report.orbit_document import elements_document
from fitting.report.page.page import fit_page
from jaxsat.files.json_files import plain, write_json
from jaxsat.satellites import Satellite
from jaxsat.telemetry import TableSession
from jaxsat.time import Epoch
from jaxsat.versions import versions

if TYPE_CHECKING:
    from fitting.profile.profile import Profile


def write_fit(
    stage: Path,
    result: FitResult,
    *,
    telemetry: str,
    label: str,
    epoch: Epoch,
    session: TableSession,
    settings: Mapping[str, Any],
    draw: Draw | None,
    surroundings: Surroundings | None = None,
    orbit_fit: OrbitFit | None = None,
    satellite: Satellite | None = None,
    profiles: Sequence["Profile"] = (),
    remarks: Sequence[str] = (),
) -> list[str]:
    """Writes the files of one fit into the empty directory `stage`; returns warnings.

    `telemetry` and `label` are the session as it was named and for people; `settings` holds the settings of the fit,
    its `seed` among them; `draw` makes the pictures, if there are to be any; `surroundings` are what the orbit and the
    page's view of the motion come from: without them there are none. `orbit_fit` is the orbit where it was fitted to
    positions; `remarks` are warnings so far.
    """
    scene = None if surroundings is None else surroundings.scene(result)
    pictures = {} if draw is None else draw(result, label, scene, profiles)
    name = session.object_name or ("" if satellite is None else satellite.name)
    for file, png in pictures.items():
        (stage / file).write_bytes(png)
    write_attitude(stage / "attitude.csv", result, epoch)
    columns = {"attitude.csv": ATTITUDE_COLUMNS}
    for channel, stem in file_stems(result.channels).items():
        columns[f"{stem}.csv"] = dict(write_channel(stage / f"{stem}.csv", result.channels[channel], epoch))
    document, nulls = fit_document(
        result,
        telemetry=telemetry,
        epoch=epoch,
        rejections=session.rejections,
        orbit=None if surroundings is None else surroundings.orbit_document(name, session.object_id, orbit_fit),
        profiles=profiles,
    )
    orbit_remarks = [f"orbit: {orbit_fit.message}"] if orbit_fit is not None and not orbit_fit.converged else []
    null_remarks = [f"{place} {NOT_FINITE}" for place in nulls if not _expected(place)]
    warnings = [*remarks, *session.remarks, *orbit_remarks, *null_remarks]
    provenance = {
        "schema": "jaxsat.provenance/1",
        "telemetry": telemetry,
        "label": label,
        "epoch_utc": epoch.iso(3),
        "paths": [str(path) for path in session.paths],
        "sha256": list(session.sha256),
        "seed": settings.get("seed"),
        "versions": versions(),
        "satellite": name,
        "size_m": satellite and satellite.size_m,
        "settings": dict(settings),
        "satellite_path": None if satellite is None else str(satellite.path),
        "satellite_file": {} if satellite is None else dict(satellite.tables),
        "warnings": warnings,
        "rows": session.rows,
        "samples": len(result.t_s),
        "orbit": None if orbit_fit is None else elements_document(orbit_fit),
        "rejections": [{**vars(rejection), "path": str(rejection.path)} for rejection in session.rejections],
        "columns": columns,
        "limited_t_s": [] if result.limited is None else result.t_s[result.limited],
        "notes": {p.name: p.note for p in result.parameters if p.note},
    }
    provenance = plain(provenance)[0]
    html = fit_page(result, pictures, provenance=provenance, scene=scene, profiles=profiles)
    (stage / "report.html").write_text(html, encoding="utf-8")
    if scene is not None:
        write_json(stage / "scene.json", scene)
    if result.between is not None:
        write_json(stage / "curves.json", curves_document(result.between))
    write_json(stage / "provenance.json", provenance)
    write_json(stage / "fit.json", document)
    return warnings


NOT_FINITE = "is not a finite number and stands as null in fit.json"


def _expected(place: str) -> bool:
    """A 1-sigma that nothing tells is no news: the verdict says so."""
    return place.startswith("attitude.") and "sigma" in place
