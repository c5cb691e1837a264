"""A satellite that turns faster than the search goes, beyond half a turn between readings."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fitting.doctor.bench import Bench
from fitting.doctor.searches import anew
from fitting.doctor.trial import Trial

STARTS = 256
FASTER = 2.0
"""Times the rate that was searched; the steps of the fit follow no more."""


def faster_turns(bench: Bench) -> Iterator[Trial]:
    """Twice the rates, where no minimum is near that of the data."""
    if not bench.hopeless:
        return
    searched_deg_s = float(np.degrees(bench.fastest))
    limit_deg_s = FASTER * searched_deg_s
    faster = replace(bench, settings=bench.settings.changed(max_rate_deg_s=limit_deg_s))
    every_s = float(np.median(np.diff(bench.samples.t)))
    for chi2 in anew(faster, bench.samples, STARTS):
        yield Trial(
            "rate",
            f"the satellite turns faster than {searched_deg_s:.1f} deg/s, up to which was searched",
            f"readings every {every_s:.0f} s tell turns of up to {180.0 / every_s:.1f} deg/s, faster ones look slow: "
            f"sample faster, or search up to max_rate_deg_s = {limit_deg_s:.1f} by a configuration",
            chi2,
            1,
        )
