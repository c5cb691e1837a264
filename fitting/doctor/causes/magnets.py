"""Magnets of the other sign or axis than the satellite file says, and coils that act otherwise than commanded."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fitting.doctor.bench import Bench
from fitting.doctor.searches import anew
from fitting.doctor.trial import Trial
from jaxsat.satellites.model import MAGNET_PLACE
from jaxsat.torques import Coil

STARTS = 24
FAR = 2.0
"""Of its prior sigmas by which a magnet's size must stand out for another direction of it to be another magnet."""


def other_magnets(bench: Bench) -> Iterator[Trial]:
    """The nominal moment along each of the other body axes, searched anew."""
    leaves = bench.parameters.leaves
    numbers = [k for k, leaf in enumerate(leaves) if leaf.place == MAGNET_PLACE]
    if len(numbers) != 3:
        return
    nominal = np.asarray(bench.parameters.tree.nominal)[numbers]
    sigma = np.array([leaves[k].sigma or leaves[k].loose for k in numbers])
    size = float(np.linalg.norm(nominal))
    if size < FAR * float(sigma.max()):
        return
    for axis in range(3):
        for sign in (1.0, -1.0):
            moment = size * sign * np.eye(3)[axis]
            if np.linalg.norm(moment - nominal) < 0.5 * size:
                continue
            parameters = bench.parameters.with_nominal(dict(zip(numbers, moment.tolist(), strict=True)))
            for chi2 in anew(bench, bench.samples, STARTS, parameters=parameters):
                told = ", ".join(f"{m:g}" for m in moment)
                yield Trial(
                    "magnet",
                    f"the magnet is along {'+' if sign > 0 else '-'}{'xyz'[axis]}",
                    f"the magnet stands otherwise than the satellite file says: dipole_A_m2 = [{told}]",
                    chi2,
                    1,
                )


def other_commands(bench: Bench) -> Iterator[Trial]:
    """All coils the other way round, as by a sign of currents or axes; all of them still, as where none was driven."""
    names = {part.column for part in bench.problem.model.spacecraft.parts if isinstance(part, Coil)}
    driven = [name for name in names if bench.samples.columns[name][1].any()]
    if not driven:
        return
    for factor, cause, meaning in (
        (-1.0, "coils turn it the other way", "the sign of the commands is turned, or the axes of [[coils]] are"),
        (0.0, "coils do nothing", "the commands in the table were not carried out: leave [[coils]] out"),
    ):
        columns = dict(bench.samples.columns)
        for name in driven:
            t, value = columns[name]
            columns[name] = (t, factor * value)
        for chi2 in anew(bench, replace(bench.samples, columns=columns), STARTS, around=bench.around):
            yield Trial("commands", f"{cause}: {', '.join(sorted(driven))}", meaning, chi2, 1, "")
