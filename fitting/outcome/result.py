"""What a fit of any satellite returns: plain NumPy, ready for JSON, CSV, tables and pictures. A failure is a value."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.special import chdtri

from fitting.outcome.series import PanelResiduals
from fitting.parameters.null_space import Direction

CONVERGED, NOT_CONVERGED, AMBIGUOUS = "converged", "not_converged", "ambiguous"
PREDICTS, FITS_ONLY, FITS = "predicts", "fits, does not predict", "fits"
AMBIGUOUS_VERDICT, UNDETERMINED, WRONG_MODEL = "ambiguous", "undetermined", "not this model"
"""The words of a verdict; `fits` is that of a fit of which nothing was held out."""
MILLIAMPERES = {"A": 1e3, "mA": 1.0, "uA": 1e-3}
WILD = 4.0
"""A reading that was not fitted and lies beyond so many times the limit of an outlier is that of no motion near."""

TOO_FAR, BY_CHANCE = 2.0, 1e-3
"""Held-out error over the promised one beyond which a fit does not predict, and the probability of as much or more up
to which it is taken for chance."""
DENIED_P = 1e-9
"""Probability below which chance is no explanation."""


@dataclass(frozen=True)
class FittedParameter:
    """One scalar of the model in the unit of its name, with its 1-sigma where it was free."""

    name: str
    value: float
    sigma: float | None
    unit: str
    free: bool
    note: str = ""
    """Such as `held by its prior`, empty where there is nothing to say."""


@dataclass(frozen=True)
class Holdout:
    """How well a channel's held-out readings were predicted."""

    count: int
    """Readings, but for outliers."""
    outliers: int
    rms: float
    """Of measured less predicted, in the channel's unit."""
    promised_rms: float
    """What noise and the covariance of the fit promise for it."""
    angle_deg: float | None
    """Median angle between measured and predicted directions; None for what is no direction."""
    directions: float = 1e6
    """As how many independent errors of one size what is promised scatters: few where one drift makes most of it."""

    @property
    def sigma_ratio(self) -> float:
        """Found over promised."""
        return self.rms / self.promised_rms

    @property
    def too_far(self) -> bool:
        """Whether the model is wrong where it was not fitted: beyond `TOO_FAR`, and beyond what chance makes of it."""
        return bool(self.sigma_ratio > max(TOO_FAR, (chdtri(self.directions, BY_CHANCE) / self.directions) ** 0.5))


@dataclass(frozen=True)
class Wish:
    """How a witness would move the unknowns of a fit: see `fitting.outcome.witness`."""

    directions: int
    """Combinations of unknowns that it sees."""
    strength: float
    """Chi-square of the move by what covariance and noise allow."""
    p: float
    """Probability of as much or more where the fit is right."""
    explained: float
    """Share of the squares of its residuals that the move explains."""
    believed: bool
    """Whether that is enough, or the fit's own chi2 is doubtful too."""

    @property
    def sigmas(self) -> float:
        """RMS of the move over what is allowed."""
        return (self.strength / self.directions) ** 0.5

    @property
    def denies(self) -> bool:
        """Whether no right fit is moved so far."""
        return self.believed and self.p < DENIED_P


@dataclass(frozen=True)
class Break:
    """From a time on one constant change of a sensor explains what is left."""

    t_s: float
    turn_deg: float
    bias: float
    """Length of the change of bias, in the channel's unit."""
    saving: float
    """Of chi2."""
    left: tuple[float, ...] = ()
    """RMS of each column behind it with the change, in the channel's unit."""


@dataclass(frozen=True)
class ChannelFit:
    """One sensor's readings beside what the fit makes of them; arrays run over its own samples."""

    name: str
    kind: str
    """Class of the sensor."""
    unit: str
    columns: tuple[str, ...]
    t_s: np.ndarray
    """[time] at which it measured."""
    measured: np.ndarray
    """[time readings] in the unit; NaN where a reading is missing."""
    modelled: np.ndarray
    sigma: float
    """1-sigma of a reading, in the unit."""
    residual: np.ndarray
    """[time differences] (measured - modelled) / sigma: of a quaternion three of the small turn."""
    promised: np.ndarray
    """[time differences] 1-sigma of the same by noise and covariance."""
    fitted: np.ndarray
    """[time] bool: False where it was held out."""
    used: np.ndarray
    """[time] bool: False where it was left out as an outlier, or where light and shadow contradict each other."""
    rms: float | None
    """Of the residuals that were fitted, in the unit; None where there are none."""
    chi2_per_reading: float | None
    angle_deg: float | None
    """Median angle between measured and modelled directions of what was fitted."""
    holdout: Holdout | None
    delay_s: float | None
    """Of its stamps by the residuals, where the fit has none of its own."""
    delay_sigma_s: float | None
    delay_name: str | None = None
    """Of the parameter that is its delay, where the satellite file has another name for it."""
    breaks: tuple[Break, ...] = ()
    residuals: tuple[PanelResiduals, ...] = ()
    """Size, mean and memory of the residuals of each of its columns, of what was fitted."""
    misfits: float = 0.0
    """Of panels: see `misfit_share`."""
    bright: int = 0
    """Samples that were fitted of a sensor of light which sees some."""
    contradicted: int = 0
    """Those left out because the computed shadow contradicts them."""
    witness: bool = False
    """Not fitted, but asked whether it agrees: all its readings count as held out."""
    wish: Wish | None = None
    """Of a witness: where it would move the fit."""
    direct: np.ndarray | None = None
    """[time readings] of solar panels: the part of direct sunlight in `modelled`."""
    weight: np.ndarray | None = None
    """[time differences] with which each residual was fitted: 0 where it was not, or where it says nothing."""

    @property
    def memory_p(self) -> float:
        """Least probability among its columns that white noise has such a memory; 1 where none tells."""
        return min((each.ljung_box_p for each in self.residuals if each.ljung_box_p is not None), default=1.0)


def misfit_share(left_out: np.ndarray, measured: np.ndarray, modelled: np.ndarray, sigma: float) -> float:
    """Samples [time] left out though their currents [time panels] are as bright as modelled, over the bright ones.

    A limited charge current only takes away; what is left out with all its light fits no attitude.
    """
    measured, modelled = np.nan_to_num(measured), np.where(np.isfinite(measured), modelled, 0.0)
    whole = measured.sum(axis=1) > modelled.sum(axis=1) - 3.0 * sigma
    bright = measured.max(axis=1) > 3.0 * sigma
    return float((left_out & whole).sum() / max(int(bright.sum()), 1))


@dataclass(frozen=True)
class Between:
    """Motion and readings at the samples and between them, so that lines through them are smooth; noise-free."""

    t_s: np.ndarray
    """[points] every sample is one."""
    quaternion_inertial_from_body: np.ndarray
    angular_velocity_rad_s: np.ndarray
    readings: Mapping[str, np.ndarray]
    """[points readings] of each channel, in its unit."""
    direct: Mapping[str, np.ndarray]
    """[points readings] of solar panels: the part of direct sunlight in the same."""


@dataclass(frozen=True)
class Cause:
    """Something that may be wrong with data or satellite file: what it would explain."""

    kind: str
    cause: str
    meaning: str
    chi2_before: float
    chi2_after: float
    added: int
    """Numbers that were found with it."""
    explains: bool
    """Whether little more than noise is left."""
    option: str = ""
    """How a fit would be told so; empty where there is no such option."""


@dataclass(frozen=True)
class FitResult:
    """Outcome of one fit; arrays of the motion run over the union of all channels' times, held-out ones included."""

    status: str
    """`converged`, `not_converged` or `ambiguous`."""
    message: str
    verdict: str
    """One of `PREDICTS` ... `WRONG_MODEL`."""
    remarks: tuple[str, ...]
    """Sentences: what would explain the data, what nothing sees, what is odd."""
    chi2: float
    dof: int
    parameters: tuple[FittedParameter, ...]
    buys: Mapping[str, float]
    """Rise of chi2 where a free part or group of numbers is put back to its nominal values and the rest fitted anew."""
    correlations: Mapping[str, Mapping[str, float]]
    t_s: np.ndarray
    quaternion_inertial_from_body: np.ndarray
    angular_velocity_rad_s: np.ndarray
    attitude_sigma_deg: np.ndarray
    """[time 3] about body x, y, z."""
    illumination: np.ndarray | None
    """[time] visible share of the Sun."""
    fitted: np.ndarray
    """[time] bool."""
    channels: Mapping[str, ChannelFit]
    axes: Mapping[str, list[str]]
    """Conventions that were found for sensors whose axes were unknown."""
    alternatives: tuple[dict, ...] = ()
    """Other motions or conventions: `chi2_above_best`, `attitude_distance_deg`, `axes`."""
    limited: np.ndarray | None = None
    """[time] bool: every sensor of light with a reading there was left out as current-limited or otherwise outlying."""
    gauge: str | None = None
    """What no channel tells and what holds it in its place: a definition, or the priors."""
    unseen: tuple[Direction, ...] = ()
    """Combinations of parameters on which the priors say more than the data."""
    timing_s: Mapping[str, float] = field(default_factory=dict)
    field_angle_deg: np.ndarray | None = None
    """[time] between body x and the magnetic field."""
    field_angle_sigma_deg: np.ndarray | None = None
    causes: tuple[Cause, ...] = ()
    """What would explain the data that the fit does not, the best first; looked for where it is denied."""
    between: Between | None = None
    """For pages and pictures; None where the samples lie as close, and before they are made."""

    @property
    def residual_rms_mA(self) -> float | None:
        """Of panel currents; None where there is no such channel, or several."""
        panels = [c for c in self.channels.values() if c.kind == "Panels" and c.unit in MILLIAMPERES]
        if len(panels) != 1 or panels[0].rms is None:
            return None
        return panels[0].rms * MILLIAMPERES[panels[0].unit]
