"""A date of another year, or a clock of another zone: field, Sun and Greenwich are those of another instant."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fitting.doctor.bench import Bench
from fitting.doctor.searches import changed_residual, first, searched
from fitting.doctor.trial import Trial
from fitting.measurements.assembly import Samples
from fitting.measurements.sky import Around
from fitting.starts.multi_start import Starts
from jaxsat.environment import igrf_field
from jaxsat.time import SECONDS_PER_DAY, Epoch, greenwich_angle

YEAR_DAYS = 365.25
OLD_DAYS = 200.0
"""Age of the table's own element set from which another year is tried."""
HOURS = tuple(hours for hours in range(-12, 15) if hours)
"""By which a clock is tried to be ahead of UTC."""
STARTS = 64
"""Of a search under another hour: what it leaves at the right one stands out by its cost."""
TRIED = 3
"""Hours that are fitted, those that promise most."""


def other_year(bench: Bench) -> Iterator[Trial]:
    """The year that brings the first row nearest to the table's own element set."""
    elements_epoch = bench.session.elements_epoch
    if elements_epoch is None:
        return
    epoch = bench.samples.epoch
    age = epoch.seconds_since(elements_epoch) / SECONDS_PER_DAY
    years = round(age / YEAR_DAYS)
    if abs(age) < OLD_DAYS or years == 0:
        return
    text = epoch.iso(6)
    try:
        meant = Epoch.from_iso(f"{int(text[:4]) - years:04d}{text[4:]}")
    except ValueError:
        return
    off = f"{abs(years)} year{'s' * (abs(years) > 1)} {'late' if years > 0 else 'early'}"
    yield Trial(
        "date",
        f"the date is {off}: {meant.iso(0)} is {_near(meant, elements_epoch)}",
        "field, Sun and Greenwich are those of another date: correct it",
        _chi2(bench, _dated(bench, meant)),
        1,
        f"--as dated:{meant.iso(3)}",
    )


def other_zone(bench: Bench) -> Iterator[Trial]:
    """Hours by which the clock is ahead of UTC, where positions stand in the table: the field turns with the Earth."""
    if bench.session.positions is None:
        return
    told = {hours: _dated(bench, _behind(bench, hours)) for hours in HOURS}
    known = {}
    if not bench.hopeless:
        hunches = {
            hours: bench.score.moved_to(changed_residual(bench, bench.rebuilt(*each))) for hours, each in told.items()
        }
        known = {hours: _chi2(bench, told[hours]) for hours in sorted(hunches, key=lambda h: hunches[h])[:TRIED]}
    if not any(chi2 < bench.enough for chi2 in known.values()):
        known |= _searched(bench, told)
    if not known:
        return
    best = min(known, key=lambda hours: known[hours])
    meant = _behind(bench, best)
    yield Trial(
        "date",
        f"the clock is {abs(best)} h {'ahead of' if best > 0 else 'behind'} UTC",
        "stamps of another zone: field and Greenwich are those of another hour",
        known[best],
        1,
        f"--as dated:{meant.iso(3)}",
    )


def _behind(bench: Bench, hours: int) -> Epoch:
    return bench.samples.epoch.shifted(-3600.0 * hours)


def _dated(bench: Bench, epoch: Epoch) -> tuple[Samples, Around]:
    """Samples and surroundings with another instant for t = 0; positions in inertial axes stay where they are."""
    greenwich = np.asarray(greenwich_angle(epoch))
    around = replace(bench.around, field=igrf_field(epoch.decimal_year()), greenwich_angle=greenwich)
    return replace(bench.samples, epoch=epoch), around


def _searched(bench: Bench, told: dict[int, tuple[Samples, Around]]) -> dict[int, float]:
    """Chi2 of the hours whose own searches end lowest; no further hour is searched after one that explains the data.

    Costs are compared at the end, on whole arcs: on short ones any sky explains something.
    """
    ends: dict[int, Starts] = {}
    for hours in sorted(told, key=abs):
        samples, around = told[hours]
        starts = searched(bench, samples, STARTS, around=around)
        if starts is not None:
            ends[hours] = first(starts)
        if hours in ends and 2.0 * ends[hours].cost[0] < bench.enough:
            break
    best = sorted(ends, key=lambda hours: ends[hours].cost[0])[:TRIED]
    found = {hours: bench.chi2_near(bench.rebuilt(*told[hours]), ends[hours]) for hours in best}
    # The field of an hour beside leads near the motion, where the search under the right one may have missed it.
    for hours in (best[0] - 1, best[0] + 1) if best else ():
        if hours in told:
            chi2 = bench.chi2_near(bench.rebuilt(*told[hours]), ends[best[0]])
            found[hours] = min(chi2, found.get(hours, np.inf))
    return found


def _chi2(bench: Bench, told: tuple[Samples, Around]) -> float:
    return bench.chi2_near(bench.rebuilt(*told))


def _near(meant: Epoch, elements_epoch: Epoch) -> str:
    days = abs(meant.seconds_since(elements_epoch)) / SECONDS_PER_DAY
    return f"{math.ceil(days)} days from the element set in the table"
