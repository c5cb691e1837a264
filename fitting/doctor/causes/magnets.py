"""A magnet of the other sign, or along another axis, than the satellite file says."""

from collections.abc import Iterator

import numpy as np

from fitting.doctor.bench import Bench
from fitting.doctor.searches import anew
from fitting.doctor.trial import Trial
from jaxsat.satellites.model import MAGNET_PLACE

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
