"""Horizon sensor with an oscillating scan: harmonics of its signal, normalised output, presence (Melnikov et al. 2022).

The line of sight swings along a great circle through the scan's centre, at the angle s = theta sin(a) with a = 2 pi f t
and f of 20 to 40 Hz. Electronics take from the signal U the first harmonic A1 = 2/T int U sin a dt and the second one
A2 = 2/T int U cos 2a dt, and put out A2 / A1. A place on the scan is given by v = s / theta in [-1, 1]. The scan goes
there and back over the same places, so that the harmonics do not depend on f, and their quadratures are zero.
"""

import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxsat.math import float_array
from jaxsat.sensors.sun_sensor import safe_sqrt

SCAN_AMPLITUDE = math.radians(12.0)
"""theta_max as Melnikov et al. round it [rad]; `experiments/earth_search/chain.py` has the whole chain."""
PRESENCE_RATIO = 0.374319
"""Threshold of presence over the first harmonic of the dimmest Earth, three times the full Moon (theirs, corrected)."""


class HorizonSensor(eqx.Module):
    """Numbers of one sensor; four of them look in four directions at the same angle from the body axis."""

    cone_angle: Float[Array, ""] = eqx.field(converter=float_array)
    """From the body axis that shall point to the nadir to the centre of the scan [rad]."""
    amplitude: Float[Array, ""] = eqx.field(converter=float_array, default=SCAN_AMPLITUDE)
    """Largest angle of the scan from its centre, theta_max [rad]."""
    threshold: Float[Array, ""] = eqx.field(converter=float_array, default=PRESENCE_RATIO * 25.0 * 2.0 / math.pi)
    """Size of the first harmonic from which presence is signalled [W/(m^2 sr)]."""


def _cosine(v: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """sqrt(1 - v^2), zero outside [-1, 1]; with derivative zero at the ends, where there is none."""
    return safe_sqrt(1.0 - v * v)


def band_harmonics(
    begin: Float[Array, "*n"], end: Float[Array, "*n"], signal: float | Float[Array, ""] | Float[Array, "*n"] = 1.0
) -> tuple[Float[Array, "*n"], Float[Array, "*n"]]:
    """First and second harmonic of a signal on the band from v = `begin` to `end` within [-1, 1], zero elsewhere.

    With v = sin a, A1 = 2/pi U int v da and A2 = 2/pi U int (1 - 2 v^2) da over the half swing: 2/pi U times the
    differences of -c and v c, c = sqrt(1 - v^2).
    """
    c1, c2 = _cosine(begin), _cosine(end)
    return 2.0 / math.pi * signal * (c1 - c2), 2.0 / math.pi * signal * (end * c2 - begin * c1)


def halved_harmonics(
    begin: Float[Array, "*n"],
    middle: Float[Array, "*n"],
    end: Float[Array, "*n"],
    outer: Float[Array, "*n"],
    inner: Float[Array, "*n"],
) -> tuple[Float[Array, "*n"], Float[Array, "*n"]]:
    """Harmonics of a band of two signals, `outer` to `middle` and `inner` from there: the sum of `band_harmonics`."""
    c1, c2, c3 = _cosine(begin), _cosine(middle), _cosine(end)
    first = outer * (c1 - c2) + inner * (c2 - c3)
    second = outer * (middle * c2 - begin * c1) + inner * (end * c3 - middle * c2)
    return 2.0 / math.pi * first, 2.0 / math.pi * second


def _angle(v, c):
    # Not arcsin, whose derivative at the ends is infinite.
    return jnp.arctan2(v, jnp.where((v == 0.0) & (c == 0.0), 1.0, c))


def step_harmonics(
    offset: Float[Array, "*n"], amplitude: float | Float[Array, ""], signal: float | Float[Array, "*n"] = 1.0
) -> tuple[Float[Array, "*n"], Float[Array, "*n"]]:
    """Harmonics of a straight sharp horizon at `offset` x from the scan's centre [rad], the Earth at larger angles.

    A1 = 2/pi U sqrt(1 - x^2/theta^2) and A2 = -x/theta A1, whatever the brightness; none where |x| > theta.
    """
    begin = jnp.clip(offset / amplitude, -1.0, 1.0)
    return band_harmonics(begin, jnp.ones_like(begin), signal)


def ramp_harmonics(
    outer: Float[Array, "*n"], inner: Float[Array, "*n"], amplitude: float | Float[Array, ""]
) -> tuple[Float[Array, "*n"], Float[Array, "*n"]]:
    """Harmonics of a limb whose signal rises from 0 at the offset `outer` to 1 at `inner` > `outer` [rad], linearly.

    The mean over the limb of those of a step: differences of their integrals over the offset,
    (v c + a) / pi and 2 c^3 / (3 pi) with c = sqrt(1 - v^2), a = arcsin v.
    """
    v1, v2 = outer / amplitude, inner / amplitude
    width = v2 - v1
    first, second = [], []
    for v in (v1, v2):
        inside = jnp.clip(v, -1.0, 1.0)
        c = _cosine(inside)
        first.append((inside * c + _angle(inside, c)) / math.pi)
        second.append(2.0 * c**3 / (3.0 * math.pi))
    return (first[1] - first[0]) / width, (second[1] - second[0]) / width


def scan_harmonics(signal: Float[Array, "*n samples"]) -> tuple[Float[Array, "*n"], Float[Array, "*n"]]:
    """Harmonics of a sampled signal: one period from a = 0 in equal steps of the phase, by direct summation."""
    count = signal.shape[-1]
    phase = 2.0 * math.pi / count * jnp.arange(count, dtype=signal.dtype)
    basis = jnp.stack([jnp.sin(phase), jnp.cos(2.0 * phase)], axis=-1)
    found = 2.0 / count * jnp.matmul(signal, basis, precision="highest")
    return found[..., 0], found[..., 1]


def normalised_output(first: Float[Array, "*n"], second: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """A2 / A1, minus the horizon's offset over theta; zero where there is no first harmonic."""
    some = first != 0.0
    return jnp.where(some, second / jnp.where(some, first, 1.0), 0.0)


def present(sensor: HorizonSensor, first: Float[Array, "*n"]) -> Bool[Array, "*n"]:
    """Whether presence of the Earth is signalled: by the size of the first harmonic, whatever its phase."""
    return jnp.abs(first) >= jnp.asarray(sensor.threshold)


def chord_of_disk(
    along_centre: Float[Array, "*n"], along_scan: Float[Array, "*n"], cosine_of_disk: float | Float[Array, ""]
) -> tuple[Float[Array, "*n"], Float[Array, "*n"]]:
    """Angles [rad] of the scan at which its great circle enters and leaves a disk of the sky.

    `along_centre` and `along_scan` are the components of the unit vector to the disk's middle along the scan's centre
    and along its direction there; the disk's radius is below 90 deg. The line of sight at s is in the disk where
    m cos(s - s0) > cos rho, m and s0 length and angle of these components: exact for any curvature. A circle that
    misses the disk gives two equal angles.
    """
    square = along_centre**2 + along_scan**2
    outside = square > cosine_of_disk**2
    half = jnp.where(outside, jnp.arctan2(safe_sqrt(square - cosine_of_disk**2), cosine_of_disk), 0.0)
    middle = jnp.arctan2(along_scan, jnp.where(square > 0.0, along_centre, 1.0))
    return middle - half, middle + half


def chord_on_scan(
    along_centre: Float[Array, "*n"],
    along_scan: Float[Array, "*n"],
    cosine_of_disk: float | Float[Array, ""],
    amplitude: float | Float[Array, ""],
) -> tuple[Float[Array, "*n"], Float[Array, "*n"]]:
    """Places v in [-1, 1] at which the scan enters and leaves a disk: `chord_of_disk` over the amplitude, clipped.

    Both are the same where they do not meet. Without a trigonometric function, for loops over many cases: to 1e-9 for
    amplitudes to 15 deg, and disks below 90 deg by more than an amplitude.
    """
    half = safe_sqrt(along_centre**2 + along_scan**2 - cosine_of_disk**2)
    met = half > 0.0
    # Cosine and sine of the two edges, m cos rho times too large.
    place = []
    for side in (-1.0, 1.0):
        cosine = along_centre * cosine_of_disk - side * along_scan * half
        sine = along_scan * cosine_of_disk + side * along_centre * half
        within = jnp.abs(sine) < jnp.tan(amplitude) * cosine
        v = small_arctan(sine / jnp.where(within, cosine, 1.0)) / amplitude
        place.append(jnp.where(within, v, jnp.where(sine < 0.0, -1.0, 1.0)))
    # A disk about the opposite direction begins behind where it ends.
    return place[0], jnp.where(met, jnp.maximum(place[0], place[1]), place[0])


def small_arctan(ratio: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """The arctangent by its series, to 1e-9 below 16 deg: a tenth of the time of the general one."""
    square, found = ratio * ratio, jnp.zeros_like(ratio)
    for order in range(13, -1, -2):
        found = 1.0 / order - square * found
    return ratio * found
