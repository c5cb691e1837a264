"""The scenario `emergency-mode` with the files of a single case: figures 4 to 6 of Somov 2018 for any of them."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from jaxsat.cli.sweep.case import with_replay, write_history
from jaxsat.sweep.scenarios import emergency_mode


def _replay(options: Mapping[str, str], seed: int, case: int, directory: Path) -> None:
    samples = emergency_mode.history(options, seed, case)
    error, rate, dipole = np.degrees(samples.error), np.degrees(samples.rate_error), np.asarray(samples.dipole)
    columns = {
        **{f"error_{c}_deg": error[:, k] for k, c in enumerate("xyz")},
        **{f"rate_error_{c}_deg_s": rate[:, k] for k, c in enumerate("xyz")},
        "tilt_deg": np.degrees(samples.tilt),
        **{f"dipole_{c}_A_m2": dipole[:, k] for k, c in enumerate("xyz")},
    }
    panels = {
        "angular errors, deg": dict(zip("xyz", error.T, strict=True)),
        "rates against the orbital axes, deg/s": dict(zip("xyz", rate.T, strict=True)),
        "angle of body y from the vertical, deg": {"": np.degrees(samples.tilt)},
        "dipoles, A m2": dict(zip("xyz", dipole.T, strict=True)),
    }
    t_s = 16.0 * np.arange(1, len(error) + 1)
    write_history(directory, t_s, columns, panels, title=f"Emergency mode, case {case}", subtitle=f"seed {seed}")


make = with_replay(emergency_mode.make, _replay)
