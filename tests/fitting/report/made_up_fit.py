"""A fit of four kinds of sensors that no solver has made: numbers with the shapes of real ones."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fitting.measurements.sky import Around
from fitting.orbit.orbit_fit import OrbitFit, fit_orbit, states
from fitting.outcome.result import PREDICTS, Between, Break, ChannelFit, FitResult, FittedParameter, Holdout
from fitting.outcome.series import panel_residuals, slots
from fitting.parameters.null_space import Direction
from fitting.profile.profile import Profile
from fitting.report.fit.drawing import draw_all
from fitting.report.fit.files import write_fit
from fitting.report.fit.owned import owned_files
from fitting.report.fit.surroundings import Surroundings
from jaxsat.constants import EARTH_RADIUS_MEAN, EARTH_ROTATION_RATE
from jaxsat.environment import KeplerOrbit, igrf_field, orbit_from_elements_km_deg
from jaxsat.files.staging import staged_directory
from jaxsat.satellites import Satellite
from jaxsat.satellites.satellite import satellite_of
from jaxsat.telemetry import RejectedRow, TableSession
from jaxsat.time import Epoch, greenwich_angle

EPOCH = Epoch.from_iso("2024-03-01T12:00:00.000")
SETTINGS = {"seed": 3, "free": ["magnet", "mag.bias"], "holdout": 0.3}


def make_session() -> TableSession:
    """A table of which three cells or rows were not used."""
    path = Path("pass.csv")
    rejections = (
        RejectedRow(path, 7, "bx", "out of range", "999.9"),
        RejectedRow(path, 9, "", "unreadable time", "'x'"),
        RejectedRow(path, 12, "by", "out of range", "-999.9"),
    )
    facts = {"rows": 250, "object_name": "TESTSAT", "object_id": "2024-001A"}
    return TableSession((path,), ("ab" * 32,), EPOCH, {}, {}, rejections, ("stamps are whole seconds",), **facts)


def make_satellite() -> Satellite:
    """A box with a magnetometer."""
    return satellite_of(
        {
            "name": "Test satellite",
            "body": {"size_m": [0.1, 0.1, 0.34], "inertia_kg_m2": {"value": [0.002, 0.002, 0.001], "sigma": 0.001}},
            "orbit": {"tle": "pass.tle"},
            "time": {"column": "t", "form": "seconds", "epoch": "2024-03-01T12:00:00"},
            "sensors": {"mag": {"kind": "magnetometer", "unit": "nT"}},
            "channels": {"mag": {"columns": ["bx", "by", "bz"], "unit": "nT", "sigma": 300.0}},
        },
        Path("test.sat.toml"),
    )


def make_around() -> Around:
    """A circular orbit at 520 km with its field."""
    orbit = orbit_from_elements_km_deg(
        a_km=6900.0, e=0.001, i_deg=97.5, raan_deg=30.0, argp_deg=10.0, mean_anomaly_deg=80.0
    )
    angle, rate, radius = (np.asarray(x) for x in (greenwich_angle(EPOCH), EARTH_ROTATION_RATE, EARTH_RADIUS_MEAN))
    return Around(orbit, igrf_field(EPOCH.decimal_year()), angle, rate, radius)


def make_orbit_fit() -> OrbitFit:
    """That orbit, found from a hundred positions with noise of 100 m."""
    t = np.linspace(0.0, 5000.0, 100)
    orbit = make_around().orbit
    assert isinstance(orbit, KeplerOrbit)
    position, velocity = states(orbit, t)
    noise = np.random.default_rng(8).normal(scale=100.0, size=position.shape)
    return fit_orbit(t, position + noise, velocity)


def write_made_up(
    directory: Path, result: FitResult | None = None, *, plots: bool, profiles: Sequence[Profile] = ()
) -> list[str]:
    """Writes the files of such a fit as the command does; returns warnings."""
    result = result or make_fit_result()
    with staged_directory(directory, owned_files(directory, result.channels)) as stage:
        return write_fit(
            stage,
            result,
            telemetry="pass.csv",
            label="pass",
            epoch=EPOCH,
            session=make_session(),
            settings=SETTINGS,
            draw=draw_all if plots else None,
            surroundings=Surroundings.of(result.t_s, make_around(), EPOCH),
            orbit_fit=make_orbit_fit(),
            satellite=make_satellite(),
            profiles=profiles,
        )


def channel(
    name: str, kind: str, unit: str, columns: tuple[str, ...], every: int, size: float, seed: int
) -> ChannelFit:
    """Readings every so many seconds with noise of one sigma, three wild ones and a third held out."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 600.0, every)
    count = 3 if kind == "StarTracker" else len(columns)
    modelled = size * np.sin(t[:, None] / 60.0 + np.arange(len(columns)))
    if kind == "StarTracker":
        modelled /= np.linalg.norm(modelled, axis=1, keepdims=True)
    sigma = 0.01 * size
    residual = rng.normal(size=(len(t), count))
    noise = residual if count == len(columns) else rng.normal(size=modelled.shape)
    measured = modelled + sigma * noise
    if kind == "StarTracker":
        measured[::2] *= -1.0
    used = np.ones(len(t), bool)
    used[[3, 8]] = False
    measured[3], residual[3] = 40.0 * size, 4000.0
    measured[5, 0], residual[5] = np.nan, np.nan
    fitted = t < 400.0
    weight = np.where((fitted & used)[:, None] & np.isfinite(residual), 1.0, 0.0)
    # Two readings of the first column were in doubt.
    weight[10:12, 0] *= 0.1
    counted = weight > 0.0
    slot = slots(t)
    return ChannelFit(
        name=name,
        kind=kind,
        unit=unit,
        columns=columns,
        t_s=t,
        measured=measured,
        modelled=modelled,
        sigma=sigma,
        residual=residual,
        promised=np.where(fitted, 1.0, 1.0 + (t - 400.0) / 200.0)[:, None] * np.ones(count),
        fitted=fitted,
        used=used,
        rms=1.02 * sigma,
        chi2_per_reading=1.04,
        angle_deg=0.6 if kind != "Gyroscope" else None,
        holdout=Holdout(3 * int((~fitted).sum()), 1, 1.6 * sigma, 1.5 * sigma, None if kind == "Gyroscope" else 0.9),
        delay_s=0.9 if kind == "Magnetometer" else None,
        delay_sigma_s=0.05 if kind == "Magnetometer" else None,
        breaks=(Break(300.0, 4.0, 0.05 * size, 190.0),) if kind == "Magnetometer" else (),
        residuals=tuple(panel_residuals(residual[counted[:, k], k], slot[counted[:, k]]) for k in range(count)),
        direct=0.8 * modelled if kind == "Panels" else None,
        weight=weight,
    )


def make_between(t: np.ndarray, channels: Sequence[ChannelFit]) -> Between:
    """Between each two times one more: the motion of `make_fit_result`, and readings without noise."""
    fine = np.sort(np.concatenate([t, 0.5 * (t[1:] + t[:-1])]))
    q = np.stack([np.cos(fine / 80.0), *(np.sin(fine / 80.0) * part for part in (0.6, 0.0, 0.8))], axis=1)
    rate = np.tile(np.array([0.6, 0.0, 0.8]) / 40.0, (len(fine), 1))
    readings = {}
    for c in channels:
        wave = np.sin(fine[:, None] / 60.0 + np.arange(len(c.columns)))
        size = np.linalg.norm(wave, axis=1, keepdims=True) if c.kind == "StarTracker" else 0.01 / c.sigma
        readings[c.name] = np.round(wave / size, 6)
    direct = {c.name: np.round(0.8 * readings[c.name], 6) for c in channels if c.direct is not None}
    return Between(fine, np.round(q, 7), rate, readings, direct)


def make_fit_result(**changes) -> FitResult:
    """The result, with other values of some fields."""
    rng = np.random.default_rng(1)
    channels = (
        channel("mag", "Magnetometer", "nT", ("bx", "by", "bz"), 5, 30_000.0, 2),
        channel("gyro", "Gyroscope", "deg/s", ("wx", "wy", "wz"), 4, 2.0, 3),
        channel("star", "StarTracker", "1", ("q0", "q1", "q2", "q3"), 30, 1.0, 4),
        channel("a/b cells", "Panels", "mA", tuple(f"i{k}" for k in range(8)), 10, 400.0, 5),
    )
    t = np.unique(np.concatenate([c.t_s for c in channels]))
    q = np.stack([np.cos(t / 80.0), *(np.sin(t / 80.0) * part for part in (0.6, 0.0, 0.8))], axis=1)
    fields = {
        "status": "converged",
        "message": "one motion explains the data and predicts what was held out",
        "verdict": PREDICTS,
        "remarks": ("2 of 80 samples of mag left out as outliers or in doubtful light",),
        "chi2": 812.5,
        "dof": 790,
        "parameters": (
            FittedParameter("inertia.xx", 0.0021, None, "kg m2", False),
            FittedParameter("magnet.x", 0.3049, 0.0012, "A m2", True),
            FittedParameter("magnet.y", -0.01, 0.002, "A m2", True, "held by its prior"),
            FittedParameter("mag.bias.x", 412.0, 31.0, "nT", True),
            FittedParameter("gyro.delay", 0.21, 0.02, "s", True),
        ),
        "buys": {"magnet": 54321.0, "mag.bias": 77.7, "gyro.delay": 0.01},
        "correlations": {"magnet.x": {"mag.bias.x": -0.95, "magnet.y": 0.1}},
        "t_s": t,
        "quaternion_inertial_from_body": q,
        "angular_velocity_rad_s": np.array([0.6, 0.0, 0.8]) / 40.0 + rng.normal(scale=1e-5, size=(len(t), 3)),
        "attitude_sigma_deg": np.full((len(t), 3), [0.2, 0.3, 0.5])
        * (1.0 + np.maximum(t - 400.0, 0.0)[:, None] / 99.0),
        "illumination": np.where((t > 150.0) & (t < 250.0), 0.0, 1.0),
        "fitted": t < 400.0,
        "channels": {c.name: c for c in channels},
        "axes": {"mag": ["+x", "-z", "+y"]},
        "alternatives": (
            {
                "chi2_above_best": 31.5,
                "attitude_distance_deg": 88.0,
                "rate_deg_s": [1.0, 0.0, 0.25],
                "axes": {"mag": ["+y", "-z", "-x"]},
            },
        ),
        "timing_s": {"prepare": 0.4, "solve": 2.5, "total": 3.0},
        "field_angle_deg": 40.0 + 10.0 * np.sin(t / 50.0),
        "field_angle_sigma_deg": np.full(len(t), 0.3),
        "limited": (t > 29.0) & (t < 41.0),
        "unseen": (Direction("common scale of magnet and inertia", 1e-6, "its prior", {"magnet.x": 0.01}),),
        "gauge": "|magnet| held at the nominal value",
        "between": make_between(t, channels),
    }
    return FitResult(**{**fields, **changes})
