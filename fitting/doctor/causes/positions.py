"""Positions that belong to other instants, or that stand in other axes."""

from collections.abc import Iterator
from dataclasses import replace

import equinox as eqx
import numpy as np

from fitting.doctor.bench import Bench
from fitting.doctor.retold import retold
from fitting.doctor.searches import along, anew
from fitting.doctor.trial import Trial
from fitting.measurements.problem import Problem
from fitting.outcome.verdict import ORBIT_ODD_KM
from jaxsat.environment import KeplerOrbit

LATE_S = (-20.0, -10.0, 10.0, 20.0)
MOST_LATE_S = 300.0
"""By which positions are tried to belong to other instants, and the most."""
AHEAD_S, NEAR_S = {" (GPS time?)": 18.0, " (TAI?)": 37.0, " (TT?)": 69.184}, 1.5
"""Clocks by what they are ahead of UTC since 2017, and how near to that a shift is taken for one."""
BESIDE = (0.85, 1.15)
"""Of the best shift, what is tried beside it."""
STARTS = 32


def late_positions(bench: Bench) -> Iterator[Trial]:
    """Positions that belong to instants before or after their stamps: the whole orbit is shifted."""
    orbit = bench.around.orbit
    if bench.session.positions is None or not isinstance(orbit, KeplerOrbit):
        return

    def changed(late_s: float) -> Problem:
        # At the stamp the satellite was not there yet.
        moved = eqx.tree_at(lambda o: o.mean_anomaly, orbit, orbit.mean_anomaly - orbit.mean_motion * late_s)
        return bench.rebuilt(bench.samples, replace(bench.around, orbit=moved))

    found = along(bench, changed, 2.0, (-MOST_LATE_S, MOST_LATE_S), LATE_S)
    if found is None:
        return
    late_s, least = found
    yield Trial(
        "positions",
        f"positions are those of {abs(late_s):.1f} s {'after' if late_s > 0 else 'before'} their stamps",
        "the orbit was computed for other instants, or from an old element set: compare their clocks",
        least,
        1,
        f"--as late:positions:{-late_s:.1f}",
    )


def late_clock(bench: Bench) -> Iterator[Trial]:
    """All stamps late against UTC, or an orbit that is ahead on its track, where elements tell the orbit.

    Orbit, field, Sun and Greenwich are then those of other instants, while all sensors agree with each other.
    """
    if bench.session.positions is not None:
        return
    epoch = bench.session.epoch

    def meant(late_s: float) -> str:
        return epoch.shifted(-late_s).iso(3)

    def changed(late_s: float) -> Problem:
        told = retold(bench, f"dated:{meant(late_s)}")
        return bench.rebuilt(told.samples, told.around)

    found = along(bench, changed, 2.0, (-MOST_LATE_S, MOST_LATE_S), (-40.0, *LATE_S, 40.0))
    if found is None:
        return
    # Which clock it is shows in a second or two: the vertex of a parabola about the best.
    three = np.array([*BESIDE, 1.0]) * found[0]
    costs = np.array([bench.chi2_near(changed(late_s)) for late_s in three[:2]] + [found[1]])
    told = [found, *((float(late), float(chi2)) for late, chi2 in zip(three, costs, strict=True))]
    if np.isfinite(costs).all():
        a, b, _ = np.polyfit(three, costs, 2)
        if a > 0.0:
            vertex = float(np.clip(-0.5 * b / a, three.min(), three.max()))
            told.append((vertex, bench.chi2_near(changed(vertex))))
    late_s, least = min(told, key=lambda each: each[1])
    scale = next((name for name, ahead in AHEAD_S.items() if abs(late_s - ahead) < NEAR_S), "")
    yield Trial(
        "clock",
        f"all stamps are {abs(late_s):.1f} s {'late' if late_s > 0 else 'early'}{scale}, or the orbit is as much "
        f"{'ahead' if late_s < 0 else 'behind'} on its track",
        "the clock is not that of UTC ([time] offset_s), or the element set is old or another satellite's",
        least,
        1,
        f"--as dated:{meant(late_s)}",
    )


def earth_fixed(bench: Bench) -> Iterator[Trial]:
    """Positions that are no orbit as they stand, and one if their axes turn with the Earth."""
    if bench.session.positions is None or not _missed(bench.missed_m):
        return
    told = retold(bench, "frame:ecef")
    if _missed(told.missed_m):
        return
    for chi2 in anew(bench, told.samples, STARTS, around=told.around):
        yield Trial(
            "frame",
            "positions are in axes that turn with the Earth",
            'what the table or the satellite file takes for inertial axes is not: frame = "ecef"',
            chi2,
            # An orbit that is missed by so much is wrong whatever the readings say.
            0,
            "--as frame:ecef",
        )


def _missed(missed_m: float | None) -> bool:
    return missed_m is not None and bool(missed_m > 1e3 * ORBIT_ODD_KM or np.isnan(missed_m))
