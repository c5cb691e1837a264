"""A session of Munin whose panels give other currents than their file says, and whose stamps jump."""

from dataclasses import replace

import numpy as np
import pytest

from fitting.doctor.bench import Bench
from fitting.doctor.causes.freeing import freed_parts, parts_to_free
from fitting.doctor.causes.stamps import jumping_stamps
from fitting.doctor.trial import ranked
from fitting.run import fit
from fitting.settings import FitSettings
from fitting.surroundings import surroundings
from jaxsat.bundled import BUNDLED
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import read_telemetry

pytestmark = pytest.mark.slow

GAINS = np.array([1.2, 0.85, 1.1, 0.8, 0.9, 1.15])
JUMP_S = 30.0
FREE = ("magnet", "rods", "imax", "inertia", "albedo")


def denied(change) -> tuple[Bench, str]:
    """The bundled session with its channels changed, fitted and not explained."""
    satellite = read_satellite()
    session = read_telemetry(BUNDLED, satellite)
    session = replace(session, channels={name: change(channel) for name, channel in session.channels.items()})
    settings = FitSettings(free=FREE)
    found = fit(satellite, session, settings=settings, causes=False)
    around, _ = surroundings(satellite, session)
    return Bench(found.found, around, settings, (), satellite, session), found.verdict


@pytest.fixture(scope="module")
def unequal():
    return denied(lambda own: replace(own, values=own.values * GAINS) if own.name == "cells" else own)


def test_unequal_panels_are_named_first(unequal):
    bench, verdict = unequal
    assert verdict == "not this model"
    assert set(parts_to_free(bench)) == {"gains", "tilts"}
    best = ranked(list(freed_parts(bench)), bench.chi2, bench.readings)[0]
    assert best.cause == "gains is not free" and best.explains
    assert best.option == "--free inertia,magnet,rods,albedo,imax,gains"


def test_a_jump_of_regular_stamps_is_found_with_its_size():
    def late(own):
        return replace(own, t_s=np.where(own.t_s < 2500.0, own.t_s, own.t_s + JUMP_S))

    bench, verdict = denied(late)
    assert verdict == "not this model"
    best = ranked(list(jumping_stamps(bench)), bench.chi2, bench.readings)[0]
    assert best.cause.startswith("stamps jump by +30.0 s between ") and best.explains
