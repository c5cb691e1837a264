"""A first guess of the motion that comes from elsewhere: where a fit begins in place of a search."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.assembly import Samples
from fitting.parameters.free import FreeParameters
from fitting.parameters.names import STATE
from fitting.starts.growing import FIRST_ARC
from fitting.starts.multi_start import Starts
from jaxsat.errors import InputError
from jaxsat.satellites.model import Leaf
from jaxsat.time import Epoch

STARTS = 16
"""The guess itself, and others about it."""
ATTITUDE_SIGMA = np.radians(10.0)
RATE_SIGMA, RATE_SHARE = np.radians(0.05), 0.1
"""1-sigma where nobody says one [rad, rad/s, share of the rate]."""
LEAST_ATTITUDE, LEAST_RATE = np.radians(0.5), np.radians(0.01)
"""By which the others lie about it at least: a guess is of another model than the fit's."""


@dataclass(frozen=True)
class Guess:
    """Attitudes and rates at one instant or at several, of which that nearest to where the fit begins is taken."""

    quaternion: np.ndarray
    """[times 4] inertial (true equator and equinox of date) from body, scalar first, of any length."""
    rate: np.ndarray
    """[times 3] angular velocity, body axes [rad/s]."""
    t: np.ndarray
    """[times] after `epoch` [s]."""
    epoch: Epoch | None = None
    """That of the session where it is none."""
    attitude_sigma: np.ndarray | None = None
    """[times] 1-sigma about each axis [rad]."""
    rate_sigma: np.ndarray | None = None
    """[times] [rad/s]"""
    values: Mapping[str, float] = field(default_factory=dict)
    """Numbers of the satellite by their names, in the units of results; those that are free begin there."""
    name: str = "a guess"
    """What messages call it."""

    def __post_init__(self):
        count = len(self.t)
        shapes = [(self.quaternion, (count, 4)), (self.rate, (count, 3))]
        shapes += [(each, (count,)) for each in (self.attitude_sigma, self.rate_sigma) if each is not None]
        wrong = any(np.shape(array) != shape or not np.isfinite(array).all() for array, shape in shapes)
        if wrong or count == 0 or not np.linalg.norm(self.quaternion, axis=1).all():
            raise ValueError("a guess is finite quaternions [times 4] and rates [times 3], at one time at least")

    @property
    def remark(self) -> str:
        """What a result says of it."""
        found = f"started from {self.name}, and nothing else was searched"
        return f"{found}: a fit without it tells whether another motion explains the data, or does so better"


@dataclass(frozen=True)
class Placed:
    """A guess at a sample of the session."""

    sample: int
    attitude: Rotation
    rate: np.ndarray
    """[3] body axes [rad/s]."""
    attitude_sigma: float
    rate_sigma: float
    values: Mapping[str, float]

    def starts(self, parameters: FreeParameters, rng: np.random.Generator) -> Starts:
        """The guess, and `STARTS` - 1 motions about it."""
        off, faster = rng.normal(size=(2, STARTS, 3))
        off[0] = faster[0] = 0.0
        attitude = self.attitude * Rotation.from_rotvec(self.attitude_sigma * off)
        x = np.tile(self._unknowns(parameters), (STARTS, 1))
        x[:, 3 : len(STATE)] = (self.rate + self.rate_sigma * faster) / RATE_UNIT
        return Starts(x, attitude.as_quat(scalar_first=True), np.zeros(STARTS))

    def _unknowns(self, parameters: FreeParameters) -> np.ndarray:
        """[unknowns] of a solver at the numbers of the guess, within their bounds."""
        values = np.array(parameters.tree.nominal, float)
        for number in {int(k) for k in parameters.columns if k >= 0} | _restated(parameters):
            leaf = parameters.leaves[number]
            if leaf.name in self.values:
                values[number] = self.values[leaf.name] / leaf.to_unit
        lower, upper = parameters.bounds()
        return np.clip(np.concatenate([np.zeros(len(STATE)), parameters.shifts(values)]), lower, upper)


def place(guess: Guess, samples: Samples, near: int, fitted: int, telling: np.ndarray) -> Placed:
    """The guess at the sample next to it, of several instants at that nearest to sample number `near`.

    `fitted` is how many samples are fitted, `telling` the numbers of those that tell a direction. Raises `InputError`
    where it lies outside of the session or too few samples follow it.
    """
    ahead = 0.0 if guess.epoch is None else guess.epoch.seconds_since(samples.epoch)
    t = np.asarray(guess.t, float) + ahead
    row = int(np.argmin(np.abs(t - samples.t[near])))
    number = int(np.argmin(np.abs(samples.t[:fitted] - t[row])))
    gap, spacing = float(samples.t[number] - t[row]), float(np.median(np.diff(samples.t)))
    if abs(gap) > spacing:
        reason = f"is at t = {t[row]:g} s, where no sample is fitted within {spacing:g} s; they run from "
        raise InputError(f"{guess.name} {reason}{samples.t[0]:g} to {samples.t[fitted - 1]:g} s", field="guess")
    left = int((telling >= number).sum())
    if left < FIRST_ARC:
        reason = f"only {left} samples that tell a direction follow it, expected at least {FIRST_ARC}"
        raise InputError(f"{guess.name} is at t = {t[row]:g} s: {reason}", field="guess")
    rate = np.asarray(guess.rate, float)[row]
    # Rates change little from one sample to the next.
    attitude = Rotation.from_quat(guess.quaternion[row], scalar_first=True) * Rotation.from_rotvec(rate * gap)
    turn = ATTITUDE_SIGMA if guess.attitude_sigma is None else float(guess.attitude_sigma[row])
    spread = RATE_SIGMA + RATE_SHARE * float(np.linalg.norm(rate))
    speed = spread if guess.rate_sigma is None else float(guess.rate_sigma[row])
    return Placed(number, attitude, rate, max(turn, LEAST_ATTITUDE), max(speed, LEAST_RATE), guess.values)


def check_names(guess: Guess, leaves: tuple[Leaf, ...]) -> None:
    """Raises `InputError` for a number that the satellite does not have."""
    known = {leaf.name for leaf in leaves}
    for name in guess.values:
        if name not in known:
            raise InputError(f"{guess.name} has {name}, which is no number of this satellite", field="guess")


def _restated(parameters: FreeParameters) -> set[int]:
    """Numbers of the components of a dipole that moves by its angles."""
    return {k for k, leaf in enumerate(parameters.leaves) if leaf.name in parameters.restated}
