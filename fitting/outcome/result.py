"""What a fit returns: plain NumPy, ready for JSON, CSV, tables and pictures. A failure is a value."""

from dataclasses import dataclass, field

import numpy as np

from fitting.parameters.null_space import Direction

CONVERGED, NOT_CONVERGED, AMBIGUOUS = "converged", "not_converged", "ambiguous"


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
class FitResult:
    """Outcome of one fit; arrays run over the samples of the fitted arc."""

    status: str
    """`converged`, `not_converged` or `ambiguous`."""
    message: str
    chi2: float
    dof: int
    residual_rms_mA: float
    parameters: tuple[FittedParameter, ...]
    gauge: str | None
    """Which combinations were fixed because the data cannot see them; None where nothing was."""
    correlations: dict[str, dict[str, float]]
    """Between free parameters, state included (`attitude.x` ... `rate.z`), each pair once."""
    t_s: np.ndarray
    """[time] seconds since the session's epoch."""
    quaternion_inertial_from_body: np.ndarray
    """[time 4] scalar first."""
    angular_velocity_rad_s: np.ndarray
    """[time 3] body axes."""
    attitude_sigma_deg: np.ndarray
    """[time 3] 1-sigma of a small rotation about body x, y, z."""
    field_angle_deg: np.ndarray
    """[time] between body x and the magnetic field."""
    field_angle_sigma_deg: np.ndarray
    measured_mA: np.ndarray
    """[time 6] panel currents +X -X +Y -Y +Z -Z."""
    modelled_mA: np.ndarray
    """[time 6] direct + albedo."""
    modelled_direct_mA: np.ndarray
    """[time 6] the direct part of it."""
    weight: np.ndarray
    """[time 6] final weight of each current, 0 where it was left out."""
    limited: np.ndarray
    """[time] samples that the fit found to be current-limited or otherwise outlying and left out."""
    lit: np.ndarray
    """[time] outside the Earth's shadow."""
    limb_samples: int = 0
    """Samples whose limb angles were fitted."""
    limb_rms_deg: float | None = None
    """Of their residuals, as angles on the sphere; None where there are none."""
    alternatives: tuple[dict, ...] = ()
    """Other minima found: chi2 and attitude distance to the best one."""
    unseen: tuple[Direction, ...] = ()
    """Combinations of which the data say nothing, or less than the priors."""
    timing_s: dict[str, float] = field(default_factory=dict)
    field_body_uT: np.ndarray | None = None
    """[time 3] magnetic field in body axes, and its 1-sigma by that of the attitude."""
    field_body_sigma_uT: np.ndarray | None = None
