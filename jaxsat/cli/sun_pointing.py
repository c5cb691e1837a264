"""The scenario `sun-pointing` with the files of a single case: figures 20 to 22 of Zhukov 2019 for any of them."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from jaxsat.cli.sweep.case import with_replay, write_history
from jaxsat.sweep.scenarios import sun_pointing


def _replay(options: Mapping[str, str], seed: int, case: int, directory: Path) -> None:
    settings, samples = sun_pointing.history(options, seed, case)
    columns, panels = case_history(samples)
    t_s = settings.period_s * np.arange(len(samples.mode))
    subtitle = f"seed {seed}, {settings.estimator} estimator; seen every {settings.period_s:g} s"
    write_history(directory, t_s, columns, panels, title=f"Sun pointing, case {case}", subtitle=subtitle)


make = with_replay(sun_pointing.make, _replay)


def case_history(samples) -> tuple[dict[str, np.ndarray], dict[str, dict[str, np.ndarray]]]:
    """Columns and panels of a case's history, a `jaxsat.control.sun_pointing.loop.Sample` with the periods in front.

    An estimate is nan where the Sun was not known.
    """
    known = np.asarray(samples.known)
    sun, estimate = np.asarray(samples.sun_instrument), np.where(known[:, None], samples.estimate, np.nan)
    rates = np.degrees(samples.angular_velocity)

    def angles(v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        azimuth = np.degrees(np.arctan2(v[:, 2], v[:, 1])) % 360.0
        # On the axis itself there is none.
        azimuth = np.where(np.hypot(v[:, 1], v[:, 2]) > 0.02, azimuth, np.nan)
        return np.degrees(np.arccos(np.clip(v[:, 0], -1.0, 1.0))), azimuth

    (true_angle, true_azimuth), (angle, azimuth) = angles(sun), angles(estimate)
    columns = {
        **{f"sun_{c}": sun[:, k] for k, c in enumerate("xyz")},
        **{f"estimate_{c}": estimate[:, k] for k, c in enumerate("xyz")},
        "view_angle_deg": true_angle,
        "estimated_view_angle_deg": angle,
        "faces_lit": np.asarray(samples.lit),
        "mode": np.asarray(samples.mode),
        **{f"rate_{c}_deg_s": rates[:, k] for k, c in enumerate("xyz")},
        "error_deg": np.degrees(samples.error),
        "impulse_N_s": np.cumsum(samples.impulse),
    }
    panels = {
        "Sun from the sensor's axis, deg": {"true": true_angle, "estimated": angle},
        "azimuth of the Sun about the axis, deg": {"true": true_azimuth, "estimated": azimuth},
        "Sun in instrument axes": dict(zip("xyz", sun.T, strict=True)),
        "angular rate, deg/s": dict(zip("xyz", rates.T, strict=True)),
        "mode: 0 damping, 1 search, 2 slew, 3 hold": {"": np.asarray(samples.mode)},
        "impulse spent, N s": {"": np.cumsum(samples.impulse)},
    }
    return columns, panels
