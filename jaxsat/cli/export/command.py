"""`jaxsat export`: the attitude and orbit of a fit in the formats of its neighbours."""

from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from jaxsat.cli.shared.folders import default_folder
from jaxsat.cli.shared.talk import USUAL, Talking
from jaxsat.errors import InputError

SCHEMA = "jaxsat.export/1"
NAMES = {
    "aem": "attitude.aem",
    "aem1": "attitude-v1.aem",
    "oem": "orbit.oem",
    "czml": "session.czml",
    "csv": "session.csv",
    "parquet": "session.parquet",
}
"""File of each format."""
FILES = (*NAMES.values(), "export.json")
Format = Literal["aem", "aem1", "oem", "czml", "csv", "parquet"]
Frame = Literal["tod", "eme2000", "gcrf"]


def export(
    run: Annotated[Path, Parameter(help="Directory of a fit, or its fit.json.")],
    /,
    *,
    format: Annotated[
        list[Format] | None,
        Parameter(
            help="aem: attitude, CCSDS AEM 2.0; aem1: the same in AEM 1.0; oem: orbit, CCSDS OEM 2.0; czml: both, for "
            "Cesium; csv, parquet: both, a row a sample. Repeatable. [default: aem, oem]",
            negative=(),
        ),
    ] = None,
    frame: Annotated[
        Frame,
        Parameter(
            help="Inertial axes of aem, aem1, oem, csv and parquet: tod, true equator and equinox of date, in which "
            "the fit works; eme2000, mean equator of J2000; gcrf."
        ),
    ] = "tod",
    object_name: Annotated[str | None, Parameter(help="OBJECT_NAME of messages. [default: that of the file]")] = None,
    object_id: Annotated[
        str | None, Parameter(help="OBJECT_ID, as 2000-075C. [default: that of the file's element set]")
    ] = None,
    out: Annotated[Path, Parameter(help="Directory for the results.")] = default_folder("export"),
    talk: Talking = USUAL,
) -> int:
    """Write the attitude and the orbit of a fit for other programs.

    Writes attitude.aem, attitude-v1.aem, orbit.oem, session.czml, session.csv
    or session.parquet, and export.json, which says what is in them.

    Exit status: 0 done, 1 bad input, 2 wrong usage.

    Example: jaxsat export munin-fit --format aem --format czml --out munin-out
    """
    from jaxsat.cli.export.formats import ExportedRun, file_bytes
    from jaxsat.files.json_files import plain, write_json
    from jaxsat.files.staging import staged_directory

    formats = list(dict.fromkeys(format or ["aem", "oem"]))
    path = run / "fit.json" if run.is_dir() else run
    fitted = ExportedRun.read(path, object_name=object_name, object_id=object_id)
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "run": str(path),
        "status": fitted.status,
        "epoch_utc": fitted.epoch.iso(3),
        "samples": len(fitted.t_s),
        "frame": frame,
        "files": {},
    }
    with staged_directory(out, FILES) as stage:
        for name in formats:
            try:
                content = file_bytes(fitted, name, frame)
            except ValueError as error:
                reason = error.reason if isinstance(error, InputError) else str(error)
                raise InputError(reason, file=path, field=name) from None
            (stage / NAMES[name]).write_bytes(content)
            document["files"][name] = NAMES[name]
        write_json(stage / "export.json", plain(document)[0])
    warning = "" if fitted.status == "converged" else f" (the fit is {fitted.status.replace('_', ' ')})"
    written = ", ".join(NAMES[name] for name in formats)
    said = f"{fitted.object_name}: {len(fitted.t_s)} samples in {written}{warning}"
    talk.result(said, f"\nresults in {out}", document=out / "export.json")
    return 0
