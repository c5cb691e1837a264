"""Attitudes that explain each sample of a session, best first, and what is to be said about each sample."""

from dataclasses import dataclass

import numpy as np

from jaxsat.math.on_host import angle_between_attitudes

SOLVED, AMBIGUOUS, UNDETERMINED, UNSOLVED = "solved", "ambiguous", "undetermined", "unsolved"
STATUSES = (SOLVED, AMBIGUOUS, UNDETERMINED, UNSOLVED)
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
    """[samples found] between body x and the field [rad]."""
    status: tuple[str, ...]
    """[samples] one of `STATUSES`."""
    reason: tuple[str, ...]
    """[samples] why it is not solved; empty where it is."""

    @property
    def count(self) -> np.ndarray:
        """[samples] number of solutions."""
        return np.sum(np.isfinite(self.rms), axis=1)


def body_x(quaternion: np.ndarray) -> np.ndarray:
    """[... 3] inertial components of body x."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    return np.stack([1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)], axis=-1)


def ranked(
    quaternion: np.ndarray,
    rms: np.ndarray,
    factors: tuple[np.ndarray, np.ndarray],
    sigma: np.ndarray,
    *,
    b_field_eci: np.ndarray,
    noise: float,
    unsolved: dict[int, str],
    keep: int = 4,
    panels: int = 6,
    field_first: bool = True,
) -> LocalSolutions:
    """Sorts candidates [samples candidates], merges equal ones and says what each sample came to.

    Candidates have an infinite rms where there are none. Of those that explain alike (`CHI2_APART`), the one with x
    nearest to the field's line comes first, as two of the local methods start from there; the others by their rms, and
    all of them without `field_first`.
    `noise` is that of a current [A]; `unsolved` maps samples without solution to the reason.
    """
    rows = np.arange(len(rms))[:, None]
    field = b_field_eci / np.linalg.norm(b_field_eci, axis=1, keepdims=True)
    angle = np.arccos(np.clip(np.sum(body_x(quaternion) * field[:, None], axis=-1), -1.0, 1.0))
    least = np.min(rms, axis=1, keepdims=True)
    with np.errstate(invalid="ignore"):
        excess = panels * (rms**2 - least**2) / np.maximum(noise, least) ** 2
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
    verdicts = [_verdict(k, rms[k], sigma[k], alike[k], unsolved) for k in range(len(rms))]
    status, reason = zip(*verdicts, strict=True) if verdicts else ((), ())
    return LocalSolutions(quaternion, rms, direct, albedo, sigma, angle, status, reason)


def _verdict(sample, rms, sigma, alike, unsolved) -> tuple[str, str]:
    if sample in unsolved:
        return UNSOLVED, unsolved[sample]
    if not np.isfinite(rms[0]):
        return UNSOLVED, "no attitude found"
    if not sigma[0] < SEEN:
        return UNDETERMINED, "the currents do not see a turn about one axis"
    others = int(np.sum(alike[1:] & np.isfinite(rms[1:])))
    if others:
        return AMBIGUOUS, f"{others + 1} attitudes explain the currents alike"
    return SOLVED, ""
