"""A fit of the bundled session that no solver has made: numbers with the shapes and the life of real ones."""

from functools import cache
from pathlib import Path

import numpy as np

from fitting.outcome.result import FITS, ChannelFit, FitResult, FittedParameter, Holdout
from fitting.outcome.series import panel_residuals, slots
from fitting.report.fit.drawing import draw_all
from fitting.report.fit.files import write_fit
from fitting.report.fit.owned import owned_files
from fitting.report.fit.surroundings import Surroundings
from fitting.settings import FitSettings
from fitting.surroundings import surroundings
from jaxsat.bundled import BUNDLED, told_names
from jaxsat.files.staging import staged_directory
from jaxsat.satellites import Satellite, read_satellite
from jaxsat.telemetry import TableSession, read_telemetry

PANELS = ("+X", "-X", "+Y", "-Y", "+Z", "-Z")


@cache
def munin_session() -> tuple[Satellite, TableSession]:
    """Munin and the bundled session."""
    satellite = read_satellite()
    return satellite, read_telemetry(BUNDLED, satellite)


@cache
def munin_surroundings(samples: int = 71) -> Surroundings:
    """Orbit and sky of so many samples of it."""
    satellite, session = munin_session()
    return Surroundings.of(64.0 * np.arange(samples), surroundings(satellite, session)[0], session.epoch)


def make_munin_result(samples: int = 71, **changes) -> FitResult:
    """The result, with other values of some fields."""
    rng = np.random.default_rng(5)
    t = 64.0 * np.arange(samples)
    quaternion = rng.normal(size=(samples, 4))
    lit = np.arange(samples) < samples - 3
    flat = np.ones(samples, bool)
    fields = {
        "status": "converged",
        "message": "best of 8 starts",
        "verdict": FITS,
        "remarks": (),
        "chi2": 101.5,
        "dof": 92,
        "parameters": (
            FittedParameter("magnet.x", 0.3049, 0.0012, "A m2", True),
            FittedParameter("imax", 251.4, float("nan"), "mA", True, "held by its prior"),
            FittedParameter("gains.+x", 1.0, 0.5, "1", False),
        ),
        "buys": {"magnet": 84.0},
        "correlations": {"magnet.x": {"imax": -0.95}, "attitude.x": {"rate.x": 0.1}},
        "t_s": t,
        "quaternion_inertial_from_body": quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True),
        "angular_velocity_rad_s": rng.normal(scale=0.01, size=(samples, 3)),
        "attitude_sigma_deg": np.full((samples, 3), 0.2),
        "illumination": lit.astype(float),
        "fitted": flat,
        "channels": {"cells": _cells(t, lit, rng), "mag": _mag(t, rng)},
        "axes": {},
        "alternatives": ({"chi2_above_best": 58.5, "attitude_distance_deg": 20.0, "rate_deg_s": [1.0, 0.0, 0.2]},),
        "gauge": "|magnet| held",
        "timing_s": {"compile": 1.0, "solve": 0.5},
        "limited": np.arange(samples) == 4,
        "field_angle_deg": 10.0 + np.sin(t / 300.0),
        "field_angle_sigma_deg": np.full(samples, 0.3),
    }
    return FitResult(**{**fields, **changes})


def _cells(t: np.ndarray, lit: np.ndarray, rng: np.random.Generator) -> ChannelFit:
    modelled = np.where(lit[:, None], np.maximum(200.0 * np.sin(t[:, None] / 90.0 + np.arange(6)), 0.0), 0.0)
    measured = np.round(modelled + rng.normal(scale=2.0, size=modelled.shape) * (modelled > 0.0))
    used = np.arange(len(t)) != 4
    weight = ((modelled > 0.0) & used[:, None]).astype(float)
    residual, counted, slot = (measured - modelled) / 2.0, weight > 0.0, slots(t)
    return ChannelFit(
        name="cells",
        kind="Panels",
        unit="mA",
        columns=PANELS,
        t_s=t,
        measured=measured,
        modelled=modelled,
        sigma=2.0,
        residual=residual,
        promised=np.ones_like(residual),
        fitted=np.ones(len(t), bool),
        used=used,
        rms=2.05,
        chi2_per_reading=1.05,
        angle_deg=0.5,
        holdout=None,
        delay_s=None,
        delay_sigma_s=None,
        residuals=tuple(panel_residuals(residual[counted[:, k], k], slot[counted[:, k]]) for k in range(6)),
        direct=0.8 * modelled,
        weight=weight,
    )


def _mag(t: np.ndarray, rng: np.random.Generator) -> ChannelFit:
    modelled = 20.0 * np.sin(t[:, None] / 70.0 + np.arange(2))
    residual = rng.normal(size=modelled.shape)
    return ChannelFit(
        name="mag",
        kind="Magnetometer",
        unit="uT",
        columns=("By", "Bz"),
        t_s=t,
        measured=modelled + residual,
        modelled=modelled,
        sigma=1.0,
        residual=residual,
        promised=np.ones_like(residual),
        fitted=np.zeros(len(t), bool),
        used=np.ones(len(t), bool),
        rms=None,
        chi2_per_reading=None,
        angle_deg=None,
        holdout=Holdout(2 * len(t), 0, 0.98, 1.0, None),
        delay_s=None,
        delay_sigma_s=None,
        weight=np.zeros_like(residual),
        witness=True,
    )


def write_munin(directory: Path, result: FitResult | None = None, *, plots: bool) -> list[str]:
    """Writes the files of such a fit as the command does; returns warnings."""
    satellite, session = munin_session()
    result = result or make_munin_result()
    telemetry, label = told_names(BUNDLED)
    with staged_directory(directory, owned_files(directory, result.channels)) as stage:
        return write_fit(
            stage,
            result,
            telemetry=telemetry,
            label=label,
            epoch=session.epoch,
            session=session,
            settings=FitSettings().model_dump(mode="json"),
            draw=draw_all if plots else None,
            surroundings=munin_surroundings(len(result.t_s)),
            orbit_fit=surroundings(satellite, session)[1],
            satellite=satellite,
        )
