"""The scenario `earth-search` with the files of a single case: what the four sensors said and where the Earth was."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from jaxsat.cli.sweep.case import with_replay, write_history
from jaxsat.cli.sweep.earth_search_page import PAGE, search_page
from jaxsat.sweep.scenarios import earth_search


def _replay(options: Mapping[str, str], seed: int, case: int, directory: Path) -> None:
    settings, cases, samples = earth_search.history(options, seed, case)
    columns, panels = case_history(samples)
    t_s = settings.period_s * np.arange(len(samples.mode))
    subtitle = f"seed {seed}, {options['spacecraft']} spacecraft, {options['strategy']} strategy"
    title = f"Earth search, case {case}"
    write_history(directory, t_s, columns, panels, title=title, subtitle=subtitle)
    png = (directory / "history.png").read_bytes()
    page = search_page(options, cases, samples, t_s, png, title=title, subtitle=subtitle)
    (directory / PAGE).write_text(page, encoding="utf-8")


make = with_replay(earth_search.make, _replay)


def case_history(samples) -> tuple[dict[str, np.ndarray], dict[str, dict[str, np.ndarray]]]:
    """Columns and panels of a case's history, a `SearchSample` with the steps in front."""
    from jaxsat.control.earth_search.law import SENSORS

    nadir, present, first = np.asarray(samples.nadir_body), np.asarray(samples.present), np.asarray(samples.first)
    rates, error = np.degrees(samples.angular_velocity), np.degrees(samples.error)
    toward = {f"toward {c}": np.degrees(np.arctan2(nadir[:, k], nadir[:, 2])) for k, c in enumerate("xy")}
    # Away from the body axis a jump by a whole turn is no motion.
    shown = {name: np.where(np.abs(np.diff(v, prepend=v[0])) > 180.0, np.nan, v) for name, v in toward.items()}
    columns = {
        **{f"nadir_{c}": nadir[:, k] for k, c in enumerate("xyz")},
        "error_deg": error,
        **{f"present{name}": present[:, k].astype(float) for k, name in enumerate(SENSORS)},
        **{f"first{name}_W_m2_sr": first[:, k] for k, name in enumerate(SENSORS)},
        "mode": np.asarray(samples.mode),
        **{f"rate_{c}_deg_s": rates[:, k] for k, c in enumerate("xyz")},
    }
    panels = {
        "Earth's centre from body z, deg": {"angle": error, **shown},
        "presence of the Earth, one line a sensor": {
            name: np.where(present[:, k], 1.0 + k, np.nan) for k, name in enumerate(SENSORS)
        },
        "first harmonic, W/(m² sr)": {name: first[:, k] for k, name in enumerate(SENSORS)},
        "angular rate, deg/s": dict(zip("xyz", rates.T, strict=True)),
        "mode: 0 search, 1 approach, 2 track": {"": np.asarray(samples.mode)},
    }
    return columns, panels
