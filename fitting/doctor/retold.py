"""The session read otherwise, as the option of a cause says: what a fit would be made of then."""

from dataclasses import dataclass

from fitting.doctor.bench import Bench
from fitting.measurements.assembly import Samples, channels_within
from fitting.measurements.sky import Around
from fitting.surroundings import surroundings
from jaxsat.telemetry.table.as_if import taken_as


@dataclass(frozen=True)
class Retold:
    """Samples and surroundings of a session that is read otherwise."""

    samples: Samples
    around: Around
    missed_m: float | None
    """By which positions miss their orbit, RMS of a coordinate."""


def retold(bench: Bench, text: str) -> Retold:
    """What `--as TEXT` makes of the session; raises `InputError` where it has no orbit then."""
    satellite, session = taken_as([text], bench.satellite, bench.session)
    around, orbit = surroundings(satellite, session, bench.given)
    samples = Samples.of(channels_within(session, bench.settings.arc_s), session.epoch, dict(session.columns))
    return Retold(samples, around, None if orbit is None else orbit.rms_after_m)
