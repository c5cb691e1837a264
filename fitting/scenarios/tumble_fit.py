"""Telemetry of a satellite file simulated and fitted blind: is the truth found, and do sigmas hold?

Each case draws the numbers of the file from their sigmas, an attitude and a rate, makes the table that the file
describes, and fits it as `jaxsat fit TABLE --satellite FILE --holdout H` does, without a first guess. A case has
succeeded if the fit converged and its attitude is within three of its own sigmas.
"""

import functools
import tempfile
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from jaxsat.errors import InputError
from jaxsat.sweep.flights.inputs import start_inputs
from jaxsat.sweep.flights.options import COMMON
from jaxsat.sweep.history import History
from jaxsat.sweep.inputs import upright
from jaxsat.sweep.scenario import Factory, Metric, Option, Scenario, choice_of, number_of

NAME = "tumble-fit"
STATUSES = ("found", "denied", "ambiguous", "wrong", "refused")
CHUNK = 4
WRONG = 3.0
"""Attitude error over the stated sigma, RMS, beyond which a fit that says converged is wrong."""
METRICS = {
    "attitude_error_deg": Metric("deg", "RMS over the samples that were fitted"),
    "attitude_sigma_deg": Metric("deg", "the same as the fit states it; none of a fit that was denied"),
    "attitude_error_over_sigma": Metric("1", "RMS over axes and samples; 1 where sigmas are honest", limit=WRONG),
    "ahead_error_deg": Metric("deg", "attitude over the samples that were held out, RMS"),
    "largest_number_over_sigma": Metric("1", "largest error of a fitted number of the satellite over its sigma"),
    "chi2_over_dof": Metric("1", "of the readings that were fitted"),
}
SHARED = tuple(option for option in COMMON if option.name in ("satellite", "orbit", "start_utc"))
OPTIONS = (
    *SHARED,
    Option("duration_s", "900", "length of a session"),
    Option("every_s", "10", "time between readings, where the file has none"),
    Option("rate_deg_s", "2", "largest rate at the start, in any direction"),
    Option("holdout", "0.3", "share of the time that is predicted and not fitted"),
    Option("free", "", "what is fitted, as magnet,mag.bias; empty: all that has a sigma"),
    Option("starts", "64", "of the search"),
    Option("nominal", "off", "on: satellites are as the file says, and only motion and noise are drawn"),
)
ASSUMPTIONS = (
    "Numbers of the satellite are drawn from the sigmas of its file, which the fit takes for priors: true priors.",
    "The simulator that makes the readings is the model of the fit: what no model has is in none of its errors.",
)
_ONE_FIT = threading.Lock()
"""A fit uses all cores by itself."""


@dataclass(frozen=True)
class Drawn:
    """What cases begin with."""

    seeds: np.ndarray
    """[cases] of all else that is drawn: numbers of the satellite, axes, noise."""
    attitude: np.ndarray
    """[cases 4] scalar first, inertial from body."""
    rate_deg_s: np.ndarray
    """[cases 3] body axes."""
    numbers: np.ndarray
    """[cases leaves] of the satellite, SI."""

    @property
    def motion(self) -> SimpleNamespace:
        """As `start_inputs` looks at it."""
        return SimpleNamespace(quaternion=self.attitude, angular_velocity=np.radians(self.rate_deg_s))


class _Study:
    """The sessions of one set of options."""

    def __init__(self, options: Mapping[str, str]):
        from jaxsat.bundled import CUBESAT
        from jaxsat.satellites import read_satellite
        from jaxsat.sweep.flights.spread import spread_of
        from jaxsat.sweep.pinned import path_of

        number = functools.partial(number_of, options)
        self.plan: dict[str, Any] = {name: number(name, low=0.01) for name in ("duration_s", "every_s")}
        if options["start_utc"]:
            self.plan["start_utc"] = options["start_utc"]
        self.plan["nominal"] = choice_of(options, "nominal", ("off", "on")) == "on"
        self.max_rate = number("rate_deg_s", low=0.0, high=60.0)
        holdout, starts = number("holdout", low=0.0, high=0.9), int(number("starts", low=1.0, high=4096.0))
        free = tuple(part.strip() for part in options["free"].split(",") if part.strip())
        self.fitting: dict[str, Any] = {"holdout": holdout, "starts": starts, **({"free": free} if free else {})}
        self.satellite = read_satellite(path_of(options["satellite"]) if options["satellite"] else CUBESAT)
        self.orbit = path_of(options["orbit"]) if options["orbit"] else None
        self.spread = spread_of(self.satellite, tuple(self.satellite.channels), 0.0 if self.plan["nominal"] else 1.0)
        self.settings(0, np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3))

    def settings(self, seed: int, attitude: np.ndarray, rate_deg_s: np.ndarray):
        """`TwinSettings` of a case; raises `InputError` for options that are none."""
        from jaxsat.synthetic.twins import twin_settings

        start = {"quaternion": tuple(attitude.tolist()), "rate_deg_s": tuple(rate_deg_s.tolist())}
        return twin_settings({**self.plan, **start, "seed": seed}, several="duration_s, every_s", strict=False)

    def draw(self, seed: int, cases: np.ndarray) -> Drawn:
        """Each case by its own number and the seed alone."""
        from jaxsat.satellites.model import nominal_values
        from jaxsat.synthetic.twins.drawn import drawn_model

        found = []
        for case in cases.tolist():
            random = np.random.default_rng([seed, case])
            own, attitude, axis = int(random.integers(2**32)), random.standard_normal(4), random.standard_normal(3)
            size = self.max_rate * np.cbrt(random.uniform())
            model = self.satellite.model
            if not self.plan["nominal"]:
                # As `make_twin` draws it by the same seed.
                model = drawn_model(self.satellite, np.random.default_rng(own))
            numbers = nominal_values(model, [leaf.spot for leaf in self.spread.leaves])
            found.append((own, attitude / np.linalg.norm(attitude), size * axis / np.linalg.norm(axis), numbers))
        seeds, attitude, rate, numbers = (np.array(column) for column in zip(*found, strict=True))
        return Drawn(seeds, upright(attitude), rate, numbers)

    def fitted(self, drawn: Drawn, number: int):
        """Session and fit of one of the cases; raises `InputError` where it cannot be made or fitted."""
        from fitting.run import fit
        from fitting.settings import FitSettings
        from jaxsat.satellites import read_satellite
        from jaxsat.synthetic.twins import make_twin, write_twin
        from jaxsat.synthetic.twins.files import name_of
        from jaxsat.telemetry import read_telemetry

        settings = self.settings(int(drawn.seeds[number]), drawn.attitude[number], drawn.rate_deg_s[number])
        twin = make_twin(self.satellite, settings, orbit=self.orbit)
        with tempfile.TemporaryDirectory() as folder:
            write_twin(Path(folder), twin, plots=False)
            place = Path(folder) / name_of(self.satellite.path)
            satellite = read_satellite(place.with_name(f"{place.name}.sat.toml"))
            session = read_telemetry(place.with_name(f"{place.name}.csv"), satellite)
            return twin, fit(satellite, session, settings=FitSettings(**self.fitting), causes=False)


@functools.lru_cache(maxsize=4)
def _study(options: tuple[tuple[str, str], ...]) -> _Study:
    return _Study(dict(options))


def _errors_deg(twin: Any, found: Any) -> np.ndarray:
    """Small turns from the true attitude to the fitted one, body axes [samples 3]."""
    from scipy.spatial.transform import Rotation, Slerp

    result = found.result
    path = Slerp(twin.motion.t_s, Rotation.from_quat(twin.motion.quaternion, scalar_first=True))
    t = np.asarray(result.t_s) + found.session.epoch.seconds_since(twin.epoch)
    attitude = Rotation.from_quat(result.quaternion_inertial_from_body, scalar_first=True)
    true = path(np.clip(t, twin.motion.t_s[0], twin.motion.t_s[-1]))
    return np.degrees((true.inv() * attitude).as_rotvec())


def _judged(study: _Study, twin: Any, found: Any) -> dict[str, float]:
    """Status and metrics of a fit."""
    from jaxsat.satellites.model import nominal_values

    result, error = found.result, _errors_deg(twin, found)
    t = np.asarray(result.t_s)
    inside = t <= t[-1] - study.fitting["holdout"] * (t[-1] - t[0]) + 1e-9
    size = np.linalg.norm(error, axis=1)
    row = {"attitude_error_deg": _rms(size[inside]), "chi2_over_dof": result.chi2 / max(result.dof, 1)}
    row["ahead_error_deg"] = _rms(size[~inside]) if not inside.all() else np.nan
    over = np.nan
    if result.attitude_sigma_deg is not None and np.isfinite(result.attitude_sigma_deg[inside]).all():
        sigma = np.asarray(result.attitude_sigma_deg)
        row["attitude_sigma_deg"] = _rms(np.linalg.norm(sigma[inside], axis=1))
        over = row["attitude_error_over_sigma"] = _rms((error / sigma)[inside])
    leaves = study.satellite.leaves
    true = dict(
        zip([leaf.name for leaf in leaves], nominal_values(twin.model, [leaf.spot for leaf in leaves]), strict=True)
    )
    to_unit = {leaf.name: leaf.to_unit for leaf in leaves}
    z = [
        abs(p.value - true[p.name] * to_unit[p.name]) / p.sigma
        for p in result.parameters
        if p.free and p.sigma and p.name in true
    ]
    row["largest_number_over_sigma"] = max(z, default=np.nan)
    word = {"not_converged": "denied", "ambiguous": "ambiguous"}.get(result.status)
    row["status"] = STATUSES.index(word or ("wrong" if over > WRONG else "found"))
    return row


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _build(options: Mapping[str, str]) -> Scenario:
    chosen = tuple(options.items())
    study = _study(chosen)

    def run(seed: int, cases: np.ndarray) -> dict[str, np.ndarray]:
        drawn, rows = study.draw(seed, cases), []
        for number in range(len(cases)):
            try:
                with _ONE_FIT:
                    rows.append(_judged(study, *study.fitted(drawn, number)))
            except InputError:
                rows.append({"status": STATUSES.index("refused")})
        found = {name: np.array([row.get(name, np.nan) for row in rows]) for name in METRICS}
        return {"status": np.array([row["status"] for row in rows]), **found}

    def history(seed: int, case: int) -> History:
        twin, found = study.fitted(study.draw(seed, np.array([case])), 0)
        error, sigma, result = _errors_deg(twin, found), found.result.attitude_sigma_deg, found.result
        stated = np.full_like(error, np.nan) if sigma is None else np.asarray(sigma)
        columns = {f"error_{axis}_deg": error[:, k] for k, axis in enumerate("xyz")}
        columns |= {f"sigma_{axis}_deg": stated[:, k] for k, axis in enumerate("xyz")}
        charts = {
            "attitude error, body axes, deg": dict(zip("xyz", error.T, strict=True)),
            "stated 1-sigma, deg": dict(zip("xyz", stated.T, strict=True)),
        }
        return History(np.asarray(result.t_s), columns, charts, f"{study.satellite.name}; {result.verdict}")

    inputs = (*start_inputs(study.max_rate), *study.spread.inputs())
    return Scenario(
        NAME,
        STATUSES,
        METRICS,
        CHUNK,
        run,
        history=history,
        inputs=inputs,
        draw=study.draw,
        only_float64="a fit needs its digits",
    )


make = Factory(_build, OPTIONS, ASSUMPTIONS)
