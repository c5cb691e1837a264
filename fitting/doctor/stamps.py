"""Times that are wrong: positions that are late, stamps that jump, a date of another year."""

import math
from collections.abc import Iterator
from dataclasses import replace

import equinox as eqx
import numpy as np

from fitting.doctor.bench import Bench
from fitting.doctor.lines import lowest
from fitting.doctor.trial import Trial
from jaxsat.environment import KeplerOrbit, igrf_field
from jaxsat.time import SECONDS_PER_DAY, Epoch, greenwich_angle

LATE_S = (-40.0, -20.0, -10.0, 10.0, 20.0, 40.0)
"""By which positions are tried to belong to instants after their stamps."""
ODD, ODD_S = 0.02, 1.5
"""Of the usual interval, and seconds, by which an interval must be off a multiple of it to be odd."""
MOST_JUMPS = 3
"""Odd intervals beyond which the stamps are not regular."""
STARTS = 32
YEAR_DAYS = 365.25
OLD_DAYS = 200.0
"""Age of the table's own element set from which another year is tried."""


def late_positions(bench: Bench) -> Iterator[Trial]:
    """Positions that belong to instants before or after their stamps: the whole orbit is shifted."""
    orbit = bench.around.orbit
    if not isinstance(orbit, KeplerOrbit) or bench.samples.given is not None:
        return

    def chi2(late_s: float) -> float:
        # At the stamp the satellite was not there yet.
        moved = eqx.tree_at(lambda o: o.mean_anomaly, orbit, orbit.mean_anomaly - orbit.mean_motion * late_s)
        problem = bench.rebuilt(bench.samples, replace(bench.around, orbit=moved))
        return bench.best_of(problem, bench.refitted(problem))[0]

    late_s, least = lowest(chi2, LATE_S, bench.chi2)
    yield Trial(
        "positions",
        f"positions are those of {abs(late_s):.1f} s {'after' if late_s > 0 else 'before'} their stamps",
        "the orbit was computed for other instants, or from an old element set: compare their clocks",
        least,
        1,
    )


def jumping_stamps(bench: Bench) -> Iterator[Trial]:
    """Stamps that are regular but for an interval: from there on they are moved back to the usual pace."""
    t = bench.samples.t
    intervals = np.diff(t)
    usual = float(np.median(intervals))
    odd = (intervals + 0.5 * usual) % usual - 0.5 * usual
    places = np.flatnonzero(np.abs(odd) > max(ODD * usual, ODD_S))
    if len(places) > MOST_JUMPS:
        return
    for place in places:
        for late_s in (odd[place], odd[place] - np.sign(odd[place]) * usual):
            moved = t.copy()
            moved[place + 1 :] -= late_s
            if moved[place + 1] - moved[place] < 1.0:
                continue
            for chi2 in bench.anew(replace(bench.samples, t=moved), STARTS, same_sky=False):
                yield Trial(
                    "clock",
                    f"stamps jump by {late_s:+.1f} s between {t[place]:.0f} and {t[place + 1]:.0f} s",
                    "the clock was set, or frames were lost: correct the stamps from there on, or fit the parts by "
                    "themselves",
                    chi2,
                    2,
                    f"--arc {t[0]:.0f} {t[place]:.0f}",
                )


def other_year(bench: Bench, elements_epoch: Epoch | None) -> Iterator[Trial]:
    """The year that brings the first row nearest to the table's own element set."""
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
    around = replace(
        bench.around, field=igrf_field(meant.decimal_year()), greenwich_angle=np.asarray(greenwich_angle(meant))
    )
    problem = bench.rebuilt(replace(bench.samples, epoch=meant), around)
    off = f"{abs(years)} years {'late' if years > 0 else 'early'}"
    yield Trial(
        "date",
        f"the date is {off}: {meant.iso(0)} is {_near(meant, elements_epoch)}",
        "field, Sun and Greenwich are those of another date: correct it",
        bench.best_of(problem, bench.refitted(problem))[0],
        1,
    )


def _near(meant: Epoch, elements_epoch: Epoch) -> str:
    days = abs(meant.seconds_since(elements_epoch)) / SECONDS_PER_DAY
    return f"{math.ceil(days)} days from the element set in the table"
