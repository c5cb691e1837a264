"""The scenario `gravity-gradient` with the files of a single case."""

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from jaxsat.cli.sweep.case import with_replay, write_history
from jaxsat.sweep import number_of
from jaxsat.sweep.scenarios import gravity_gradient


def _replay(options: Mapping[str, str], seed: int, case: int, directory: Path) -> None:
    tilt, rate = (math.radians(number_of(options, name)) for name in ("tilt_deg", "rate_deg_s"))
    orbits = number_of(options, "orbits")
    # In its own chunk, whose program is compiled and whose last digits are those of the sweep.
    cases = case - case % gravity_gradient.CHUNK + np.arange(gravity_gradient.CHUNK, dtype=np.int64)
    found = gravity_gradient.histories(seed, cases, tilt=tilt, rate=rate, orbits=orbits)
    own = case % gravity_gradient.CHUNK
    rates, tilts = np.degrees(found.rate[own]), np.degrees(found.tilt[own])
    columns = {
        **{f"q_{c}": found.quaternion[own, :, k] for k, c in enumerate("wxyz")},
        **{f"rate_{c}_deg_s": rates[:, k] for k, c in enumerate("xyz")},
        "tilt_deg": tilts,
    }
    panels = {
        "long axis from the vertical, deg": {"": tilts},
        "rate against the orbit, deg/s": dict(zip("xyz", rates.T, strict=True)),
    }
    title = f"Gravity gradient, case {case}"
    write_history(directory, found.t_s, columns, panels, title=title, subtitle=f"seed {seed}")


make = with_replay(gravity_gradient.make, _replay)
