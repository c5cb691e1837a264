"""The report of a fit of any satellite as one HTML page."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from fitting.outcome.diagnostics import diagnose
from fitting.outcome.result import FitResult
from fitting.report.fit.document import delays
from fitting.report.fit.owned import file_stems
from fitting.report.fit.profiles import PROFILE_COLUMNS, PROFILE_NOTE, profile_pictures, profile_row
from fitting.report.fit.result_rows import (
    CHANNEL_COLUMNS,
    CHANNEL_NUMBERS,
    VERDICTS,
    alternative_rows,
    buys_text,
    cause_rows,
    channel_rows,
    diagnostic_note,
    diagnostic_rows,
    fit_facts,
    orbit_rows,
    rejected_rows,
    unseen_rows,
    verdict_text,
    worth_rows,
)
from fitting.report.page.data import page_data_of
from fitting.report.page.head import confirmations, doubts, key_numbers
from fitting.report.rows import STRONG_CORRELATION, setting_rows, strong_correlations
from jaxsat.report import (
    Contents,
    Facts,
    Folded,
    KeyNumbers,
    Lead,
    Link,
    Live,
    Picture,
    Remarks,
    Section,
    Table,
    page,
    sentence,
)
from jaxsat.significant import unit_text, value_and_sigma, value_text
from jaxsat.telemetry import RejectedRow

if TYPE_CHECKING:
    from fitting.profile.profile import Profile

SHOWN_ALTERNATIVES = 24


def fit_page(
    result: FitResult,
    pictures: Mapping[str, bytes],
    *,
    provenance: Mapping[str, Any],
    scene: Mapping[str, Any] | None = None,
    profiles: Sequence["Profile"] = (),
    base: str = "",
) -> str:
    """Returns the HTML of one fit from what its files hold.

    `pictures` maps file names to PNG content, `provenance` and `scene` are the contents of their JSON files. Without a
    scene the motion is not shown. `base` is what stands before the names of the files beside the page, where it is
    elsewhere.
    """
    epoch_utc = provenance["epoch_utc"]
    return page(
        f"Fit of {provenance['label']}",
        subtitle=f"{provenance['telemetry']}, epoch {epoch_utc} UTC",
        verdict=VERDICTS.get(result.verdict, "bad"),
        verdict_text=verdict_text(result),
        message=f"{result.message[0].upper()}{result.message[1:]}." if result.message else "",
        data=page_data_of(result, scene, epoch_utc, provenance["size_m"]),
        sections=[
            _lead(result, provenance, base),
            Table("What would explain the data", CAUSE_COLUMNS, cause_rows(result), (1, 2), note=CAUSE_NOTE),
            *_live(result, pictures, base),
            Facts("Fit", fit_facts(result)),
            *_tables(result),
            *_profiles(profiles, pictures),
            *_diagnostics(result),
            Table(
                "Left out before the fit",
                ("reason", "count", "columns", "rows of the file", "first"),
                rejected_rows(_rejections(provenance)),
                (1,),
                note=f"{provenance['rows']} rows gave samples at {provenance['samples']} times.",
            ),
            Table("Orbit", ("element", "value", "1σ", "unit"), orbit_rows(provenance["orbit"]), (1,), note=ORBIT_NOTE),
            Folded(Facts("Provenance", list(_origin(provenance)))),
            Folded(Table("Settings", ("key", "value"), list(setting_rows(_used(provenance["settings"]))))),
            Folded(Table("Satellite file", ("key", "value"), list(setting_rows(provenance["satellite_file"])))),
        ],
    )


def _lead(result: FitResult, provenance: Mapping[str, Any], base: str) -> Lead:
    """The answer: numbers, doubts and parameters, and what else there is."""
    confirmed = confirmations(result)
    left = [
        KeyNumbers("Key numbers", key_numbers(result)),
        Remarks("What to doubt", doubts(result, provenance["warnings"]) or [NO_DOUBT]),
        Remarks("What confirms it", [sentence(text) for text in confirmed]),
        Contents("On this page", list(_files(provenance, base).values())),
    ]
    rows = [(name, value, f"± {s}" if s else "", *rest) for name, value, s, *rest in worth_rows(result)]
    free = sum(p.free for p in result.parameters)
    fixed = [(name, value, unit) for name, value, _, unit, *_ in rows[free:]]
    right = [
        Table("Parameters", ("parameter", "value", "1σ", "unit", "buys chi2", "note"), rows[:free], (1, 4), WORTH_NOTE),
        Folded(Table("Parameters that were held", ("parameter", "value", "unit"), fixed, (1,))),
        Table("Channels", CHANNEL_COLUMNS, channel_rows(result), CHANNEL_NUMBERS, note=CHANNEL_NOTE),
    ]
    return Lead(left, right)


def _files(provenance: Mapping[str, Any], base: str) -> dict[str, Link]:
    """Links to the tables and documents of a fit, by file name."""
    names = [*provenance["columns"], "fit.json", "provenance.json"]
    return {name: Link(base + quote(name), name) for name in names}


def _used(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings without the numbers of what is switched off."""
    return {k: {"on": False} if isinstance(v, Mapping) and v.get("on") is False else v for k, v in settings.items()}


CAUSE_COLUMNS = ("cause", "chi2 before", "after", "it would mean", "option")
CAUSE_NOTE = (
    "Tried by short refits of the data so changed, since the fit is denied; none of them is taken. Chi2 has in it the "
    "priors, what witnesses are off, and large residuals up to the limit of an outlier."
)
CHANNEL_NOTE = (
    "RMS of measured less modelled where it was fitted; where a part was held out, the same there beside what noise "
    "and covariance of the fit promise for it: a ratio beyond 2 says that the model is wrong where it was not fitted. "
    "Angle: median between the direction that the sensor saw and the one that the motion has there."
)


def _live(result: FitResult, pictures: Mapping[str, bytes], base: str) -> Iterator[Live]:
    def table(name: str) -> list[Link]:
        return [Link(base + quote(name), name)]

    yield Live("motion", "Motion", _picture(pictures, "orbit.png", ORBIT_ALT))
    yield Live("attitude", "Attitude", files=table("attitude.csv"))
    alt = "Attitude, rates and 1σ of the attitude against time"
    yield Live("rates", "Angular velocity", _picture(pictures, "attitude.png", alt), table("attitude.csv"))
    if result.field_angle_deg is not None:
        alt = "Angle of body x to the field with its band, against time"
        yield Live(
            "field-angle",
            "Attitude to the magnetic field",
            _picture(pictures, "field_angle.png", alt),
            table("attitude.csv"),
        )
    for number, (name, stem) in enumerate(file_stems(result.channels).items()):
        alt = f"Readings of {name} with residuals in sigmas, against time"
        yield Live(f"channel-{number}", f"Channel {name}", _picture(pictures, f"{stem}.png", alt), table(f"{stem}.csv"))


def _picture(pictures: Mapping[str, bytes], file: str, alt: str) -> Picture | None:
    return Picture(file, pictures[file], alt) if file in pictures else None


def _tables(result: FitResult) -> Iterator[Section]:
    parts = [(part, buys_text(rise)) for part, rise in result.buys.items()]
    columns = ("direction", "information of data / prior", "held by", "largest components, one prior sigma along it")
    yield Table("What the data hardly see", columns, unseen_rows(result), (1,), note=UNSEEN_NOTE)
    yield Table("What each part buys", ("part", "rise of chi2 without it"), parts, (1,))
    others = alternative_rows(result)[:SHOWN_ALTERNATIVES]
    columns = ("chi2 above the best", "attitude differs by", "rate at the start, deg/s", "axes")
    yield Table("Other motions and conventions", columns, others, (0, 1))
    yield Table("Breaks", ("channel", "from, s", "turn", "bias", "saving of chi2"), _breaks(result), (1, 2, 3, 4))
    yield Table("Stamps", ("channel", "late by, s", "1σ", "from"), _delays(result), (1,))
    strong = [(a, b, f"{value:+.3f}") for a, b, value in strong_correlations(_plain(result.correlations))]
    yield Table(f"Correlations beyond ±{STRONG_CORRELATION}", ("parameter", "with", "correlation"), strong, (2,))


def _profiles(profiles: Sequence["Profile"], pictures: Mapping[str, bytes]) -> Iterator[Section]:
    yield Table("Profiles", PROFILE_COLUMNS, [profile_row(p) for p in profiles], (1,), note=PROFILE_NOTE)
    for name, file in profile_pictures(p.name for p in profiles).items():
        picture = _picture(pictures, file, f"Rise of the cost against {name} with its intervals")
        if picture is not None:
            yield replace(picture, heading=f"Profile of {name}")


def _diagnostics(result: FitResult) -> Iterator[Section]:
    found = diagnose(result)
    columns = ("residuals", "RMS / σ", "mean / σ", "z of the mean", "lag 1", "z of lag 1", "Ljung-Box p")
    rows, note = diagnostic_rows(found), diagnostic_note(found)
    yield Table("Residual diagnostics", ("channel", "column", *columns), rows, tuple(range(2, 9)), note=note)


NO_DOUBT = "Nothing that the fit itself could find."
ORBIT_ALT = (
    "The Earth with day and night, the orbit with its arc in shadow, body x and the field along it; the satellite at "
    "four instants"
)
ORBIT_NOTE = "Kepler's, fitted to the positions that the telemetry tells; the mean anomaly is that at the epoch."
UNSEEN_NOTE = (
    "From the information matrix, the state eliminated: combinations on which the priors say more than the data, and "
    "those of which the data say nothing."
)
WORTH_NOTE = "Buys: rise of chi2 where the parameter's part is put back to its nominal values and the rest fitted anew."


def _plain(correlations: Mapping[str, Mapping[str, float]]) -> dict[str, dict[str, float]]:
    return {name: dict(row) for name, row in correlations.items()}


def _breaks(result: FitResult) -> list[tuple[str, ...]]:
    return [
        (
            name,
            f"{b.t_s:.0f}",
            f"{b.turn_deg:.1f}°",
            f"{value_text(b.bias, 3)} {unit_text(c.unit)}".strip(),
            buys_text(b.saving),
        )
        for name, c in result.channels.items()
        for b in c.breaks
    ]


def _delays(result: FitResult) -> list[tuple[str, ...]]:
    rows = []
    for name, found in delays(result).items():
        value, sigma = value_and_sigma(found["value"], found["sigma"])
        rows.append((name, value, f"± {sigma}" if sigma else "", found["from"]))
    return rows


def _rejections(provenance: Mapping[str, Any]) -> Sequence[RejectedRow]:
    return [RejectedRow(**{**rejection, "path": Path(rejection["path"])}) for rejection in provenance["rejections"]]


def _origin(provenance: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    for path, digest in zip(provenance["paths"], provenance["sha256"], strict=True):
        yield from (("telemetry", path), ("SHA-256 of the file", digest))
    yield "seed", str(provenance["seed"])
    yield "versions", ", ".join(f"{name} {version}" for name, version in provenance["versions"].items())
