"""Attitudes that explain each sample of a session, best first, and what is to be said about each sample."""

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from jaxsat.math.on_host import angle_between_attitudes

SOLVED, AMBIGUOUS, UNDETERMINED, UNSOLVED = "solved", "ambiguous", "undetermined", "unsolved"
DOES_NOT_FIT = "does not fit"
STATUSES = (SOLVED, AMBIGUOUS, UNDETERMINED, DOES_NOT_FIT, UNSOLVED)
DENIED = 1e-3
"""Chance of residuals as large by noise alone, below which they deny the model."""
CHI2_APART = 4.0
"""Attitudes whose sums of squares differ by less, in units of noise or of the misfit if larger, explain alike."""
APART = np.radians(3.0)
"""Attitudes nearer than this are one."""
SEEN = np.radians(30.0)
"""A 1-sigma beyond this is no knowledge of the attitude."""


@dataclass(frozen=True)
class LocalSolutions:
    """Solutions of samples, SI; NaN (rms: infinite) where a sample has fewer than `found`."""

    quaternion: np.ndarray
    """[samples found 4] inertial-from-body."""
    rms: np.ndarray
    """[samples found] measured - modelled currents [A]."""
    direct: np.ndarray
    """[samples found] factor of the direct current."""
    albedo: np.ndarray
    """[samples found] factor of the current of an Earth of reflectivity one."""
    sigma: np.ndarray
    """[samples found] 1-sigma about the least seen axis [rad]; infinite where nothing sees a turn about it."""
    field_angle: np.ndarray
    """[samples found] between the magnet's axis, body x if no other is said, and the field [rad]."""
    status: tuple[str, ...]
    """[samples] one of `STATUSES`."""
    reason: tuple[str, ...]
    """[samples] why it is not solved; empty where it is."""
    axis_off: float | None = None
    """How far the magnet's axis is off the field by the residuals, 1-sigma of each of two angles [rad]; None where
    the method does not take it to be on it."""

    @property
    def count(self) -> np.ndarray:
        """[samples] number of solutions."""
        return np.sum(np.isfinite(self.rms), axis=1)

    @property
    def fits(self) -> bool:
        """Whether there are attitudes, and the residuals deny the model in no more than half of them."""
        found = self.count > 0
        denied = np.array(self.status, dtype=object) == DOES_NOT_FIT
        return bool(found.any() and 2 * np.sum(denied & found) <= np.sum(found))


def ranked(
    quaternion: np.ndarray,
    rms: np.ndarray,
    factors: tuple[np.ndarray, np.ndarray],
    sigma: np.ndarray,
    *,
    b_field_eci: np.ndarray,
    axis_body: np.ndarray,
    noise: float,
    freedom: int | None,
    scatter: float = 0.0,
    unsolved: dict[int, str],
    keep: int = 4,
    panels: int = 6,
    field_first: bool = True,
) -> LocalSolutions:
    """Sorts candidates [samples candidates], merges equal ones and says what each sample came to.

    Candidates have an infinite rms where there are none. Of those that explain alike (`CHI2_APART`), the one with the
    magnet's axis nearest to the field's line comes first, as two of the local methods start from there; the others by
    their rms, and all of them without `field_first`.
    `noise` is that of a current [A], `freedom` how many currents are left over to tell of the model, None where the
    attitude does not come from them; `scatter` is by how much currents are off, where that is more; `unsolved` maps
    samples without solution to the reason.
    """
    rows = np.arange(len(rms))[:, None]
    field = b_field_eci / np.linalg.norm(b_field_eci, axis=1, keepdims=True)
    angle = np.arccos(np.clip(np.sum(_rotated(quaternion, axis_body) * field[:, None], axis=-1), -1.0, 1.0))
    least = np.min(rms, axis=1, keepdims=True)
    with np.errstate(invalid="ignore"):
        excess = panels * (rms**2 - least**2) / np.maximum(max(noise, scatter), least) ** 2
        alike = np.isfinite(rms) & (excess < CHI2_APART)
        key = np.where(alike & field_first, np.minimum(angle, np.pi - angle), 10.0 + rms)
    key[~np.isfinite(rms)] = np.inf
    order = np.argsort(key, axis=1, kind="stable")
    quaternion, rms, angle, sigma, alike = (a[rows, order] for a in (quaternion, rms, angle, sigma, alike))
    direct, albedo = (a[rows, order] for a in factors)
    for k in range(1, rms.shape[1]):
        near = angle_between_attitudes(quaternion[:, :k], quaternion[:, k : k + 1]) < APART
        rms[np.any(near & np.isfinite(rms[:, :k]), axis=1), k] = np.inf
    order = np.argsort(~np.isfinite(rms), axis=1, kind="stable")[:, :keep]
    quaternion, rms, angle, sigma, alike = (a[rows, order] for a in (quaternion, rms, angle, sigma, alike))
    direct, albedo = direct[rows, order], albedo[rows, order]
    none = ~np.isfinite(rms)
    for array in (angle, sigma, direct, albedo):
        array[none] = np.nan
    quaternion = np.where(none[..., None], np.nan, quaternion)
    allowed = np.inf if freedom is None else noise * np.sqrt(chdtri(freedom, DENIED) / panels)
    verdicts = [_verdict(k, rms[k], sigma[k], alike[k], allowed, unsolved) for k in range(len(rms))]
    status, reason = zip(*verdicts, strict=True) if verdicts else ((), ())
    return LocalSolutions(quaternion, rms, direct, albedo, sigma, angle, status, reason)


def _rotated(q, vector):
    """[... 3] inertial components of a body vector, by attitudes [... 4]."""
    w, v = q[..., :1], q[..., 1:]
    turned = 2.0 * np.cross(v, vector)
    return vector + w * turned + np.cross(v, turned)


def _verdict(sample, rms, sigma, alike, allowed, unsolved) -> tuple[str, str]:
    if sample in unsolved:
        return UNSOLVED, unsolved[sample]
    if not np.isfinite(rms[0]):
        return UNSOLVED, "no attitude found"
    if np.min(rms) > allowed:
        return DOES_NOT_FIT, "the currents are further off than noise can be"
    if not sigma[0] < SEEN:
        return UNDETERMINED, "the currents do not see a turn about one axis"
    others = int(np.sum(alike[1:] & np.isfinite(rms[1:])))
    if others:
        return AMBIGUOUS, f"{others + 1} attitudes explain the currents alike"
    return SOLVED, ""
