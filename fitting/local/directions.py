"""Attitude of each sample of any satellite by what its sensors see at once, without a model of the motion."""

import itertools
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fitting.local.solutions import SOLVED, UNDETERMINED, UNSOLVED
from fitting.measurements.assembly import Samples, build_problem, channels_within
from fitting.measurements.problem import Problem
from fitting.measurements.sky import Around
from fitting.starts.conventions import Convention, conventions, with_axes
from fitting.starts.ladder import finite_turn_rates
from fitting.starts.sights import LONGEST_GAP, MODEL_ERROR, Directions, Sights, carried, known_directions
from jaxsat.math.on_host import angles_between
from jaxsat.satellites import Satellite
from jaxsat.telemetry import TableSession

INCONSISTENT = "inconsistent"
"""Two directions are further apart or nearer than they can be: a wrong reading, axes, a bias, or stamps."""
INCONSISTENT_SIGMAS = 4.0
LONGEST_STEP = 32.0
"""Of the grid on which the surroundings are laid out [s]."""


@dataclass(frozen=True)
class DirectAttitudes:
    """What each sample says by itself; NaN where it does not."""

    t: np.ndarray
    """[samples] instants of measurement: stamps less the delays of the satellite file [s]."""
    quaternion: np.ndarray
    """[samples 4] inertial-from-body."""
    sigma: np.ndarray
    """[samples] 1-sigma about the least seen axis [rad]."""
    rate: np.ndarray
    """[samples 3] by the shorter turns to the neighbours, body axes [rad/s]: half a turn between samples and more
    shows as another rate."""
    mismatch: np.ndarray
    """[samples] angle between two directions in the body less that outside [rad]; of several pairs the worst one."""
    mismatch_sigma: np.ndarray
    """[samples] what it may be by the sensors and `MODEL_ERROR` of their calibration [rad]."""
    seen: tuple[tuple[str, ...], ...]
    """Sensors that see a direction or stars in each sample, those carried between two readings with them."""
    status: tuple[str, ...]
    reason: tuple[str, ...]
    """Why a sample is not solved, else empty."""
    conventions: tuple[Convention, ...]
    """Axes by their mismatch, the ones that were taken first."""

    @property
    def solved(self) -> np.ndarray:
        """[samples] bool: whether there is an attitude."""
        return np.isfinite(self.quaternion[:, 0])

    @property
    def fits(self) -> bool:
        """Whether there are attitudes, and no more than half of them contradict their directions."""
        solved = self.solved
        denied = np.array(self.status, dtype=object) == INCONSISTENT
        return bool(solved.any() and 2 * np.sum(denied & solved) <= np.sum(solved))


def direct_attitudes(
    satellite: Satellite, session: TableSession, around: Around, *, arc_s: tuple[float, float] | None = None
) -> DirectAttitudes:
    """Least squares of all directions (Wahba 1965) at each time at which some sensor measured, or its star tracker.

    A direction is carried between two near readings of its sensor, so that sensors need not measure at once; its sigma
    then grows by what a curved path would add. Where the axes of a sensor are unknown, those are taken under which
    angles between directions and rates agree best. Raises `InputError` where there is no reading.
    """
    model = satellite.model
    # Instants of measurement in place of stamps.
    channels = {
        name: replace(each, t_s=each.t_s - float(np.asarray(model.delays[name])))
        for name, each in channels_within(session, arc_s).items()
    }
    samples = Samples.of(channels, session.epoch, dict(session.columns))
    problem = build_problem(samples, model, around, delayed=(), max_step=LONGEST_STEP, room_for=LONGEST_STEP)
    unknown = {name: each for name, each in satellite.conventions.items() if name in channels}
    found = conventions(problem, samples, unknown)
    return _solved(with_axes(problem, found[0]), samples, tuple(found))


def _solved(problem: Problem, samples: Samples, found: tuple[Convention, ...]) -> DirectAttitudes:
    directions, tracked, tracked_sigma, seen = _sights(problem, samples)
    n = len(samples.t)
    blank = np.full((n, 3), np.nan)
    sights = Sights(samples.t, tuple(directions.values()), tracked, blank, np.full(n, np.inf))
    attitude, sigma = sights.wahba()
    has_tracker = np.isfinite(tracked[:, 0])
    sigma[has_tracker] = tracked_sigma[has_tracker]
    sigma[~np.isfinite(attitude[:, 0])] = np.nan
    mismatch, spread = _mismatch(directions, n)
    count = np.sum([np.isfinite(each.body).all(axis=1) for each in directions.values()], axis=0) + np.zeros(n, int)
    verdicts = []
    for k in range(n):
        if has_tracker[k]:
            verdicts.append((SOLVED, ""))
        elif count[k] < 2:
            verdicts.append((UNSOLVED, "only one direction is seen" if count[k] else "no direction is seen"))
        elif not np.isfinite(sigma[k]):
            verdicts.append((UNDETERMINED, "the directions are nearly on one line"))
        elif abs(mismatch[k]) > INCONSISTENT_SIGMAS * spread[k]:
            verdicts.append((INCONSISTENT, "the directions are not as far apart as they must be"))
        else:
            verdicts.append((SOLVED, ""))
    status, reason = zip(*verdicts, strict=True)
    # An attitude that is wrong by a wrong reading would spoil the rates of its neighbours.
    trusted = np.where((np.array(status) == SOLVED)[:, None], attitude, np.nan)
    rate = sample_rates(samples.t, trusted)
    return DirectAttitudes(samples.t, attitude, sigma, rate, mismatch, spread, seen, status, reason, found)


def _sights(
    problem: Problem, samples: Samples
) -> tuple[Mapping[str, Directions], np.ndarray, np.ndarray, tuple[tuple[str, ...], ...]]:
    """Directions by sensor with the sigma of each reading; attitudes of a star tracker; who sees something when."""
    n, t = len(samples.t), samples.t
    known = known_directions(problem, n)
    directions, names = {}, [[] for _ in range(n)]
    tracked, tracked_sigma = np.full((n, 4), np.nan), np.full(n, np.nan)
    for name, rows in samples.values.items():
        sensor = problem.model.sensors[name]
        if sensor.sees in (None, "rate"):
            continue
        told = sensor.direct(rows, samples.channels[name].sigma)
        if told is None:
            continue
        vectors, sigma = (np.asarray(array, float) for array in told)
        if sensor.sees == "attitude":
            seen = np.isfinite(vectors).all(axis=1)
            tracked[seen], tracked_sigma[seen] = vectors[seen], sigma[seen]
        else:
            body = carried(t, vectors, unit=True)
            seen = np.isfinite(body).all(axis=1)
            directions[name] = Directions(body, known[sensor.sees], _carried_sigma(vectors, sigma))
        for k in np.flatnonzero(seen):
            names[k].append(name)
    return directions, tracked, tracked_sigma, tuple(tuple(each) for each in names)


def _carried_sigma(vectors: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """[samples] sigma of each reading, and between readings with the rise of an arc above its chord, angle^2 / 8."""
    good = np.flatnonzero(np.isfinite(vectors).all(axis=1) & np.isfinite(sigma))
    if len(good) < 2:
        return sigma
    place = np.clip(np.searchsorted(good, np.arange(len(sigma)), side="right") - 1, 0, len(good) - 2)
    left, right = good[place], good[place + 1]
    bent = angles_between(vectors[left], vectors[right]) ** 2 / 8.0
    return np.where(np.isfinite(sigma), sigma, np.hypot(np.maximum(sigma[left], sigma[right]), bent))


def _mismatch(directions: Mapping[str, Directions], n: int) -> tuple[np.ndarray, np.ndarray]:
    """[samples] the worst mismatch of a pair of directions, in its sigmas, and that sigma [rad]."""
    worst, spread = np.full(n, np.nan), np.full(n, np.nan)
    for a, b in itertools.combinations(directions.values(), 2):
        off = angles_between(a.body, b.body) - angles_between(a.inertial, b.inertial)
        sigma = np.sqrt(a.sigma**2 + b.sigma**2 + 2.0 * MODEL_ERROR**2)
        with np.errstate(invalid="ignore"):
            worse = np.isfinite(off) & ~(np.abs(off) / sigma <= np.abs(worst) / spread)
        worst[worse], spread[worse] = off[worse], sigma[worse]
    return worst, spread


def sample_rates(t: np.ndarray, attitude: np.ndarray) -> np.ndarray:
    """[samples 3] body rates [rad/s] by the turns from the attitude before and to the one after, or one of both.

    NaN without attitude, or where the neighbours are further than `LONGEST_GAP` usual intervals.
    """
    found = np.full((len(t), 3), np.nan)
    good = np.flatnonzero(np.isfinite(attitude).all(axis=1))
    if len(good) < 2:
        return found
    gaps = np.diff(t[good])
    turns = finite_turn_rates(t[good], attitude[good])
    turns[gaps > LONGEST_GAP * np.median(gaps)] = np.nan
    sides = np.full((2, len(good), 3), np.nan)
    sides[0, 1:], sides[1, :-1] = turns, turns
    # By the shares of time: the mean rate across both intervals, at the sample in the middle of equal ones.
    weight = np.where(np.isfinite(sides), 1.0, 0.0)
    total = np.sum(weight, axis=0)
    mean = np.sum(np.nan_to_num(sides) * weight, axis=0) / np.maximum(total, 1.0)
    found[good] = np.where(total > 0.0, mean, np.nan)
    return found


def status_counts(found: DirectAttitudes) -> dict[tuple[str, str], int]:
    """Samples by status and reason, most frequent first."""
    return dict(Counter(zip(found.status, found.reason, strict=True)).most_common())
