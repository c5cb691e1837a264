"""The scenario `gravity-gradient` with the files of a single case."""

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from jaxsat.cli.case_files import write_history
from jaxsat.sweep import Factory, Scenario, gravity_gradient, number_of


def _build(options: Mapping[str, str]) -> Scenario:
    scenario = gravity_gradient.make(options)
    tilt, rate = (math.radians(number_of(options, name)) for name in ("tilt_deg", "rate_deg_s"))
    orbits = number_of(options, "orbits")

    def replay(seed: int, case: int, directory: Path) -> None:
        # In its own chunk, whose program is compiled and whose last digits are those of the sweep.
        cases = case - case % scenario.chunk + np.arange(scenario.chunk, dtype=np.int64)
        found = gravity_gradient.histories(seed, cases, tilt=tilt, rate=rate, orbits=orbits)
        own = case % scenario.chunk
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

    return dataclasses.replace(scenario, replay=replay)


make = Factory(_build, gravity_gradient.OPTIONS)
