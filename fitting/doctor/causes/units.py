"""Readings in another unit than the file says: rad/s for deg/s, mG for uT."""

from collections.abc import Iterator

import numpy as np

from fitting.doctor.bench import Bench
from fitting.doctor.searches import anew
from fitting.doctor.trial import Trial
from fitting.measurements.units import field_ratio
from jaxsat.sensors import Gyroscope

STARTS = 32
RATES = (np.degrees(1.0), np.radians(1.0), 1e3, 1e-3, 6.0, 1.0 / 6.0)
"""Deg/s for rad/s, and so on; revolutions a minute."""
NEAR = 0.2
"""Of a power of ten, in its logarithm, by which a field may miss it."""


def other_units(bench: Bench) -> Iterator[Trial]:
    """Magnetometers by the size of the field, gyroscopes by the units that there are."""
    for name, channel in bench.samples.channels.items():
        sensor, rows = bench.problem.model.sensors[name], bench.samples.values[name]
        if channel.witness:
            continue
        factors: tuple[float, ...] = ()
        ratio = field_ratio(bench.problem, bench.samples, name)
        if ratio is not None:
            # What is off by far is refused before the search.
            power = float(np.log10(ratio))
            factors = (10.0 ** -round(power),) if round(power) and abs(power - round(power)) < NEAR else ()
        elif isinstance(sensor, Gyroscope):
            factors = RATES
        for factor in factors:
            for chi2 in anew(bench, bench.with_values(name, rows * factor), STARTS):
                yield Trial(
                    "unit",
                    f"readings of {name} times {factor:.6g} fit",
                    f"its unit is not {channel.unit!r}: as rad/s for deg/s, mG for uT",
                    chi2,
                    1,
                    f"--as scaled:{name}:{factor:.8g}",
                )
