"""The file provenance.json; keys that are not read back are not looked at."""

from typing import Annotated, Any

from pydantic import Field

from fitting.report.schema.kinds import Count, Instant, Stored, Value


class Rejected(Stored):
    """A row or a cell of the telemetry."""

    path: str
    row: Count
    column: str
    reason: str
    detail: str


class Provenance(Stored):
    """The file provenance.json."""

    telemetry: str
    label: str
    epoch_utc: Instant
    paths: list[str]
    sha256: list[str]
    seed: int | None
    versions: dict[str, str]
    size_m: Annotated[list[Annotated[float, Field(gt=0.0)]], Field(min_length=3, max_length=3)] | None
    settings: dict[str, Any]
    satellite_file: dict[str, Any]
    warnings: list[str]
    rows: Count
    samples: Count
    orbit: dict[str, Value] | None
    rejections: list[Rejected]
    columns: dict[str, dict[str, str]]
    notes: dict[str, str]
