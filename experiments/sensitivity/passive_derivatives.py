"""Exact derivatives through the motion of passive satellites: of what they are good, and from when on of nothing."""

from typing import Any

import numpy as np

from experiments.sensitivity.passive_motion import Numbers, Orbits, by_orbit, slopes_by_orbit
from jaxsat.dynamics import AttitudeState

SMALL, LARGE = 1e-6, 0.1
"""Of logarithms, for differences."""
FIRST = 2
"""Orbits over which those of captured satellites are compared."""
NAMES = ("dipole", "rods y", "rods z")


def directions_of(numbers: Numbers) -> Numbers:
    """Changes of a logarithm of the dipole, of the rods along y and of those along z, in front of the cases."""
    zero = Numbers(*(np.zeros((3, *np.shape(each))) for each in numbers))
    zero.dipole[0] = numbers.dipole
    for axis in range(2):
        zero.volumes[1 + axis, :, axis] = np.asarray(numbers.volumes)[:, axis]
    return zero


def changed(numbers: Numbers, number: int, by: float) -> Numbers:
    """With one of the three logarithms greater."""
    directions = directions_of(numbers)
    factor = np.expm1(by)
    return Numbers(*(each + factor * own[number] for each, own in zip(numbers, directions, strict=True)))


def differences(numbers: Numbers, start: AttitudeState, orbits: Orbits, step: float) -> np.ndarray:
    """Central ones of the means by each of the three logarithms, [3, cases, orbits, 2]."""
    rows = []
    for number in range(3):
        high, low = (
            by_orbit(changed(numbers, number, by), start, orbits, chunk=len(numbers.dipole))[0] for by in (step, -step)
        )
        rows.append((high - low) / (2.0 * step))
    return np.array(rows)


def captured_slopes(numbers: Numbers, start: AttitudeState, orbits: Orbits) -> dict[str, Any]:
    """Of the RMS angle over the first orbits of satellites that follow the field: exact, and by differences.

    And how the exact ones grow over all orbits.
    """
    means, exact = slopes_by_orbit(numbers, directions_of(numbers), start, orbits)
    first = orbits._replace(tables=orbits.tables[:FIRST])

    def of_log(slopes):
        return 0.5 * slopes[:, :, :FIRST, 0].mean(axis=2) / means[:, :FIRST, 0].mean(axis=1)

    own, small, large = map(of_log, (exact, *(differences(numbers, start, first, step) for step in (SMALL, LARGE))))
    count = np.sqrt(own.shape[1])
    return {
        "cases": means.shape[0],
        "orbits": FIRST,
        "names": NAMES,
        "exact": own.mean(axis=1).tolist(),
        "exact_sigma": (own.std(axis=1, ddof=1) / count).tolist(),
        "difference_10_percent": large.mean(axis=1).tolist(),
        "difference_10_percent_sigma": (large.std(axis=1, ddof=1) / count).tolist(),
        "largest": float(np.abs(own).max()),
        "off_small_median": float(np.median(np.abs(own - small)) / np.median(np.abs(own))),
        "off_small_largest": float(np.abs(own - small).max() / np.abs(own).max()),
        **growth(means, exact[..., 0]),
    }


def growth(means: np.ndarray, slopes: np.ndarray) -> dict[str, Any]:
    """Median over cases of the size of the derivative of each orbit's logarithm of the RMS angle by the dipole's."""
    size = np.abs(0.5 * slopes[0] / means[..., 0])
    return {"size_by_orbit": np.median(size, axis=0).tolist(), "largest_by_orbit": size.max(axis=0).tolist()}


def tumbling_slopes(numbers: Numbers, start: AttitudeState, orbits: Orbits) -> dict[str, Any]:
    """The same from a tumble, and by how much differences of 1e-6 are off it, orbit by orbit."""
    means, own = slopes_by_orbit(numbers, directions_of(numbers), start, orbits)
    small = differences(numbers, start, orbits, SMALL)
    off = np.abs(own - small)[0, ..., 0] / np.abs(own[0, ..., 0])
    return {
        "cases": means.shape[0],
        **growth(means, own[..., 0]),
        "off_small_by_orbit": np.median(off, axis=0).tolist(),
    }
