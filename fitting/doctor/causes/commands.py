"""Commands of coils that turn the satellite the other way, or that never reached them."""

from collections.abc import Iterator
from dataclasses import replace

from fitting.doctor.bench import Bench
from fitting.doctor.searches import anew
from fitting.doctor.trial import Trial
from jaxsat.torques import Coil

STARTS = 32


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
