"""Writes everything that a fit of any satellite leaves in its directory."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from fitting.measurements.sky import Around
from fitting.outcome.sensed_result import SensedResult
from fitting.profile.profile import Profile
from fitting.report.files import FILES
from fitting.report.sensed.document import sensed_document
from fitting.report.sensed.page import sensed_page
from fitting.report.sensed.pictures import draw_sensed
from fitting.report.sensed.profiles import draw_profiles
from fitting.report.sensed.shown import file_stems
from fitting.report.sensed.surroundings import Surroundings
from fitting.report.sensed.tables import SENSED_ATTITUDE_COLUMNS, write_channel, write_sensed_attitude
from jaxsat.files.json_files import plain, write_json
from jaxsat.telemetry import TableSession
from jaxsat.time import Epoch
from jaxsat.versions import versions

PICTURES = ("attitude.png", "parameters.png", "worth.png")


def owned_files(directory: Path, channels: Iterable[str]) -> list[str]:
    """All names that a fit with such channels may write, and those that earlier fits have left in the directory.

    Of profiles those alone: new ones are known by what is written.
    """
    own = [f"{stem}.{ending}" for stem in file_stems(channels).values() for ending in ("csv", "png")]
    left = [path.name for ending in ("csv", "png") for path in sorted(directory.glob(f"channel-*.{ending}"))]
    left += [path.name for path in sorted(directory.glob("profile-*.png"))]
    return list(dict.fromkeys([*FILES, *PICTURES, *own, *left]))


def write_sensed(
    stage: Path,
    result: SensedResult,
    *,
    telemetry: str,
    label: str,
    epoch: Epoch,
    session: TableSession,
    settings: Mapping[str, Any],
    plots: bool,
    around: Around | None = None,
    name: str = "",
    size_m: Sequence[float] | None = None,
    profiles: Sequence[Profile] = (),
    remarks: Sequence[str] = (),
) -> list[str]:
    """Writes the files of one fit into the empty directory `stage`; returns warnings.

    `telemetry` and `label` are the session as it was named and for people; `settings` holds the settings of the fit,
    its `seed` among them; `around` is what the orbit and the page's view of the motion come from: without it there are
    none. `name` and `size_m` are those of the satellite, `remarks` warnings that are there already, as of profiles that
    could not be taken.
    """
    surroundings = None if around is None else Surroundings.of(result, around, epoch)
    scene = None if surroundings is None else surroundings.scene(result)
    pictures = {**draw_sensed(result, label), **draw_profiles(profiles, label)} if plots else {}
    for file, png in pictures.items():
        (stage / file).write_bytes(png)
    write_sensed_attitude(stage / "attitude.csv", result, epoch)
    columns = {"attitude.csv": SENSED_ATTITUDE_COLUMNS}
    for channel, stem in file_stems(result.channels).items():
        columns[f"{stem}.csv"] = dict(write_channel(stage / f"{stem}.csv", result.channels[channel], epoch))
    document, nulls = sensed_document(
        result,
        telemetry=telemetry,
        epoch=epoch,
        rejections=session.rejections,
        profiles=profiles,
        orbit=None if surroundings is None else surroundings.orbit_document(name),
    )
    warnings = [*remarks, *session.remarks, *(f"{place} {NOT_FINITE}" for place in nulls if not _expected(place))]
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
        "size_m": None if size_m is None else list(size_m),
        "settings": dict(settings),
        "warnings": warnings,
        "rejections": [{**vars(rejection), "path": str(rejection.path)} for rejection in session.rejections],
        "columns": columns,
        "notes": {p.name: p.note for p in result.parameters if p.note},
    }
    provenance = plain(provenance)[0]
    html = sensed_page(result, pictures, profiles=profiles, provenance=provenance, scene=scene)
    (stage / "report.html").write_text(html, encoding="utf-8")
    if scene is not None:
        write_json(stage / "scene.json", scene)
    write_json(stage / "provenance.json", provenance)
    write_json(stage / "fit.json", document)
    return warnings


NOT_FINITE = "is not a finite number and stands as null in fit.json"


def _expected(place: str) -> bool:
    """A 1-sigma that nothing tells is no news: the verdict says so."""
    return place.startswith("attitude.") and "sigma" in place
