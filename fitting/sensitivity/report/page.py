"""The page of a sensitivity: one HTML file with its tables and pictures inside."""

from collections.abc import Mapping

from fitting.sensitivity.analysis import Sensitivity
from fitting.sensitivity.contributions import Contribution
from fitting.sensitivity.report.document import verdict
from jaxsat.report import Contents, Lead, Link, Picture, Remarks, Section, Table, page, sentence
from jaxsat.significant import unit_text, value_text

TITLES = {
    "limits.png": ("Numbers and channels", "Bars: 1-sigma of each number over its prior, and shares of the channels"),
    "arc.png": ("Along the arc", "1-sigma of the attitude over time, and what each part of the arc tells"),
    "sampling.png": ("Arc length and interval", "Contours of 1-sigma over arc length and sampling interval"),
    "scenarios.png": ("Scenarios", "1-sigma of the attitude over spin rate and angle of the Sun, and its distribution"),
}


def sensitivity_page(found: Sensitivity, drawn: Mapping[str, bytes], subtitle: str) -> str:
    """Returns the HTML text."""
    first, *rest = verdict(found)
    told = Remarks("What to know", [sentence(text) for text in rest])
    beside = Contents("On this page", [Link("sensitivity.json", "sensitivity.json")])
    sections: list[Section] = [Lead([told], [beside])]
    sections += [Picture(TITLES[name][0], png, TITLES[name][1]) for name, png in drawn.items() if name in TITLES]
    sections += [_numbers(found), _bias(found)]
    sections += [_shares("Channels", found, found.contributions.channels)]
    sections += [_shares("Parts of the arc", found, found.contributions.parts)]
    sections += [
        Table(
            "Worst known combinations",
            ("in words", "1σ in prior sigmas"),
            [(each.words, value_text(each.sigma, 3)) for each in found.worst],
            (1,),
        ),
        Table(
            "How far the linear picture holds",
            ("direction", "second order over linear at 1σ", "holds to, σ"),
            [(e.words, value_text(e.second_order, 2), value_text(e.holds_to, 2)) for e in found.linearity],
            (1, 2),
            note="Residuals of the full model after steps of one sigma both ways (Bates & Watts 1980).",
        ),
        Table(
            "Strongest correlations",
            ("of", "with", "correlation"),
            [(a, b, f"{value:+.3f}") for a, b, value in found.correlations],
            (2,),
        ),
    ]
    return page(
        f"Sensitivity of {found.vantage.satellite.name}",
        subtitle=subtitle,
        verdict="good" if found.regular else "doubtful",
        verdict_text="Regular." if found.regular else "Not regular.",
        message=sentence(first),
        sections=sections,
    )


def _numbers(found: Sensitivity) -> Table:
    rows = []
    for row in found.quoted.rows:
        sigmas = (value_text(each, 3) for each in (row.sigma_noise, row.sigma_assumed, row.sigma))
        rows.append((row.name, *sigmas, "" if row.prior is None else value_text(row.prior, 3), unit_text(row.unit)))
    columns = ("number", "1σ from noise", "from what is assumed", "both", "prior", "unit")
    return Table("Numbers", columns, rows, (1, 2, 3, 4))


def _bias(found: Sensitivity) -> Table:
    """By what the attitude and the number that suffers most are off."""
    leaves, rows = {leaf.name: leaf for leaf in found.vantage.satellite.leaves}, []
    sigma = {row.name: row.sigma_noise for row in found.quoted.rows}
    for (name, table), by in zip(found.bias_per_unit().items(), found.choice.sigma, strict=True):
        size = float(by * leaves[name].to_unit)
        off = {each: abs(value) * size / sigma[each] for each, value in table.items() if each in sigma}
        most = max(off, key=lambda each: off[each])
        rows.append(
            (
                name,
                f"{value_text(size, 3)} {unit_text(leaves[name].unit)}".strip(),
                value_text(table["attitude_rms_deg"] * size, 3),
                f"{most}: {value_text(table[most] * size, 3)}",
                value_text(off[most], 3),
            )
        )
    columns = ("considered", "off by", "attitude, deg RMS", "most biased", "in its 1σ of noise")
    note = "To first order, where the true number is above the assumed one by its sigma."
    return Table("What a wrong assumption costs", columns, rows, (2, 4), note=note)


def _shares(heading: str, found: Sensitivity, each: tuple[Contribution, ...]) -> Table:
    moves = found.vantage.free_motion
    rows = [
        (
            e.name,
            str(e.readings),
            f"{100 * e.share:.1f} %",
            *([value_text(e.attitude_deg, 3) if e.attitude_deg < 180.0 else "unknown"] if moves else []),
        )
        for e in each
    ]
    columns = ("name", "readings", "share", *(["attitude without it, deg RMS"] if moves else []))
    return Table(heading, columns, rows, (1, 2, 3))
