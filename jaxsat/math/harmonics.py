"""Sums of solid spherical harmonics outside a sphere, and their gradient; regular everywhere but at the centre.

Coefficients are Schmidt semi-normalised (those of geomagnetism), without the Condon-Shortley sign; a fully normalised
coefficient (those of gravity) of degree n times sqrt(2 n + 1) is a Schmidt one.
"""

import functools
import math

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Inexact


def harmonic_sums(
    position: Inexact[Array, "3"], coefficients: Inexact[Array, "k 2 n n"], radius: float | Inexact[Array, ""]
) -> Inexact[Array, "k"]:
    """Return U_k = sum over n, m of (R/r)^(n+1) P_nm(sin latitude) (c_knm cos m lambda + s_knm sin m lambda).

    `coefficients` are indexed [sum, cosine or sine, degree n, order m]. With (x, y, z) the position times R/r^2 and
    q = R/r, it is q sum_m Re (x + i y)^m sum_kb w_mkb q^(2b) tau_k, tau_k = q^k T_k(sin latitude): P_nm / cos^m is a
    Gegenbauer polynomial, a sum of Chebyshev ones with positive factors (NIST DLMF, eqs. 18.9.19 and 18.5.11). Nothing
    is singular at the poles; the weights w do not depend on position, so that under vmap the inner sum is one matrix
    product. Positions and coefficients may be complex, for derivatives by complex step.
    """
    degree = coefficients.shape[-1] - 1
    scale = radius / jnp.sum(position * position)
    x, y, z = position * scale
    q2 = radius * scale
    chebyshev, cosine, sine, even = _powers(x, y, z, q2, degree)
    basis = jnp.concatenate([chebyshev[: degree + 1 - 2 * b] * even[b] for b in range(degree // 2 + 1)])
    weights = _basis_weights(coefficients)
    # The matrix first: for a single position the other order takes five times as long on a CPU.
    by_order = jnp.matmul(weights.reshape(-1, basis.size), basis, precision="highest")
    terms = by_order.reshape(weights.shape[0], -1) * jnp.concatenate([cosine, sine])[None]
    return jnp.sqrt(q2) * jnp.sum(terms, axis=1)


def gradient_coefficients(coefficients: Inexact[Array, "2 n n"]) -> Inexact[Array, "3 2 n+1 n+1"]:
    """Return coefficients of R dU/dx, R dU/dy and R dU/dz, one degree higher, from (cosine, sine) ones of U.

    The gradient of an internal potential is a linear map on the harmonics of the next degree (Cunningham 1970;
    Montenbruck & Gill 2000, eq. 3.33).
    """
    lower, equal, higher = (jnp.asarray(t, coefficients.dtype) for t in _gradient_factors(coefficients.shape[-1]))
    size = coefficients.shape[-1] + 1
    padded = jnp.pad(coefficients, ((0, 0), (1, 0), (1, 2)))
    lower, equal, higher = lower * padded[..., :size], equal * padded[..., 1:-1], higher * padded[..., 2:]
    both = lower + higher
    return jnp.stack([higher - lower, jnp.stack([both[1], -both[0]]), -equal])


def _powers(
    x: Inexact[Array, ""], y: Inexact[Array, ""], z: Inexact[Array, ""], q2: Inexact[Array, ""], degree: int
) -> tuple[Inexact[Array, "n"], ...]:
    """q^k T_k(z/q), real and imaginary part of (x + i y)^k and q^(2k), for k up to `degree`."""

    def next_power(carry, _):
        tau, next_tau, cosine, sine, even = carry
        powers = jnp.stack([tau, cosine, sine, even])
        cosine, sine = x * cosine - y * sine, y * cosine + x * sine
        return (next_tau, 2.0 * z * next_tau - q2 * tau, cosine, sine, q2 * even), powers

    one, zero = jnp.ones_like(z), jnp.zeros_like(z)
    _, powers = jax.lax.scan(next_power, (one, z, one, zero, one), None, length=degree + 1)
    return powers[:, 0], powers[:, 1], powers[:, 2], powers[:, 3]


def _basis_weights(coefficients: Inexact[Array, "k 2 n n"]) -> Inexact[Array, "k 2 n basis"]:
    """Weights of q^(2b) tau_k by order m: each comes from one coefficient, that of degree m + k + 2 b."""
    size = coefficients.shape[-1]
    degrees, factors = _basis_factors(size)
    orders = np.arange(size)[:, None]
    return jnp.asarray(factors[None, None], coefficients.dtype) * coefficients[:, :, degrees, orders]


@functools.cache
def _schmidt_factors(size: int) -> Float[np.ndarray, "n n"]:
    """Factor from unnormalised to Schmidt semi-normalised P_nm, without the Condon-Shortley sign; zero above n."""
    factors = np.zeros((size, size))
    for n in range(size):
        for m in range(n + 1):
            factors[n, m] = math.sqrt((1 if m == 0 else 2) * math.factorial(n - m) / math.factorial(n + m))
    return factors


@functools.cache
def _basis_factors(size: int) -> tuple[np.ndarray, np.ndarray]:
    """Degree n and Chebyshev coefficient of the normalised P_nm / cos^m, n = m + k + 2 b, at [m, (b, k)].

    P_nm = (2m - 1)!! cos^m C(t), C the Gegenbauer polynomial of degree d = n - m and parameter m + 1/2, which is
    sum_j r_j r_(d-j) cos((d - 2 j) arccos t), r_j = (m + 1/2)_j / j!. Beyond the last degree the factor is zero.
    """
    normal = _schmidt_factors(size)
    basis = [(k, b) for b in range((size + 1) // 2) for k in range(size - 2 * b)]
    degrees, factors = np.zeros((size, len(basis)), int), np.zeros((size, len(basis)))
    for m in range(size):
        sectoral = math.prod(range(1, 2 * m, 2))
        r = [math.prod(m + 0.5 + i for i in range(j)) / math.factorial(j) for j in range(size)]
        for i, (k, b) in enumerate(basis):
            n = m + k + 2 * b
            if n < size:
                degrees[m, i] = n
                factors[m, i] = (1.0 if k == 0 else 2.0) * sectoral * normal[n, m] * r[b] * r[b + k]
    return degrees, factors


@functools.cache
def _gradient_factors(size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Factors on harmonic (n, m) of the coefficients (n - 1, m - 1), (n - 1, m) and (n - 1, m + 1), all normalised.

    Indexed [cosine or sine, n, m]; a sine coefficient of order zero stands for nothing and reaches nothing.
    """
    f = _schmidt_factors(size + 1)
    lower, equal, higher = np.zeros((3, 2, size + 1, size + 1))
    for n in range(1, size + 1):
        for m in range(n + 1):
            if m > 0:
                lower[:, n, m] = (1.0 if m == 1 else 0.5) * f[n - 1, m - 1] / f[n, m]
            if m < n:
                equal[:, n, m] = (n - m) * f[n - 1, m] / f[n, m]
                higher[:, n, m] = 0.5 * (n - m) * (n - m - 1) * (f[n - 1, m + 1] if m + 1 < n else 0.0) / f[n, m]
    lower[1, :, 1] = 0.0
    return lower, equal, higher
