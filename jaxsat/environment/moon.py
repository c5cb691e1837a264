"""The Moon from a series of trigonometric terms, within a trace."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsat.environment.orbit.abstract import AbstractOrbit
from jaxsat.frames import dcm_eci_from_ecliptic
from jaxsat.math import float_array
from jaxsat.time import DAYS_PER_CENTURY, SECONDS_PER_DAY

# Degrees by powers of TT Julian centuries since J2000 (Meeus 1998, eqs. 47.1-47.5): elongation D of the Moon, mean
# anomalies M of the Sun and M' of the Moon, argument of latitude F, mean longitude L' with light time; then A1, A2, A3.
_ARGUMENTS_DEG = np.array(
    [
        [297.8501921, 445267.1114034, -0.0018819, 1 / 545868, -1 / 113065000],
        [357.5291092, 35999.0502909, -0.0001536, 1 / 24490000, 0],
        [134.9633964, 477198.8675055, 0.0087414, 1 / 69699, -1 / 14712000],
        [93.2720950, 483202.0175233, -0.0036539, -1 / 3526000, 1 / 863310000],
        [218.3164477, 481267.88123421, -0.0015786, 1 / 538841, -1 / 65194000],
        [119.75, 131.849, 0, 0, 0],
        [53.09, 479264.290, 0, 0, 0],
        [313.45, 481266.484, 0, 0, 0],
    ]
)
_MEAN_LONGITUDE = 4
_SUN_ANOMALY = 1

# Multiples of D, M, M', F, then the coefficients of sine in longitude [1e-6 deg] and cosine in distance [m]
# (Meeus 1998, table 47.A; ELP-2000/82 of Chapront-Touze & Chapront 1983).
_LONGITUDE_AND_DISTANCE = np.array(
    """
    0  0  1  0 6288774 -20905355   2  0 -1  0 1274027 -3699111   2  0  0  0  658314 -2955968
    0  0  2  0  213618   -569925   0  1  0  0 -185116    48888   0  0  0  2 -114332    -3149
    2  0 -2  0   58793    246158   2 -1 -1  0   57066  -152138   2  0  1  0   53322  -170733
    2 -1  0  0   45758   -204586   0  1 -1  0  -40923  -129620   1  0  0  0  -34720   108743
    0  1  1  0  -30383    104755   2  0  0 -2   15327    10321   0  0  1  2  -12528        0
    0  0  1 -2   10980     79661   4  0 -1  0   10675   -34782   0  0  3  0   10034   -23210
    4  0 -2  0    8548    -21636   2  1 -1  0   -7888    24208   2  1  0  0   -6766    30824
    1  0 -1  0   -5163     -8379   1  1  0  0    4987   -16675   2 -1  1  0    4036   -12831
    2  0  2  0    3994    -10445   4  0  0  0    3861   -11650   2  0 -3  0    3665    14403
    0  1 -2  0   -2689     -7003   2  0 -1  2   -2602        0   2 -1 -2  0    2390    10056
    1  0  1  0   -2348      6322   2 -2  0  0    2236    -9884   0  1  2  0   -2120     5751
    0  2  0  0   -2069         0   2 -2 -1  0    2048    -4950   2  0  1 -2   -1773     4130
    2  0  0  2   -1595         0   4 -1 -1  0    1215    -3958   0  0  2  2   -1110        0
    3  0 -1  0    -892      3258   2  1  1  0    -810     2616   4 -1 -2  0     759    -1897
    0  2 -1  0    -713     -2117   2  2 -1  0    -700     2354   2  1 -2  0     691        0
    2 -1  0 -2     596         0   4  0  1  0     549    -1423   0  0  4  0     537    -1117
    4 -1  0  0     520     -1571   1  0 -2  0    -487    -1739   2  1  0 -2    -399        0
    0  0  2 -2    -381     -4421   1  1  1  0     351         0   3  0 -2  0    -340        0
    4  0 -3  0     330         0   2 -1  2  0     327         0   0  2  1  0    -323     1165
    1  1 -1  0     299         0   2  0  3  0     294         0   2  0 -1 -2       0     8752
    """.split(),
    float,
).reshape(-1, 6)
# The same in latitude (table 47.B).
_LATITUDE = np.array(
    """
    0  0  0  1 5128122   0  0  1  1  280602   0  0  1 -1  277693   2  0  0 -1  173237   2  0 -1  1   55413
    2  0 -1 -1   46271   2  0  0  1   32573   0  0  2  1   17198   2  0  1 -1    9266   0  0  2 -1    8822
    2 -1  0 -1    8216   2  0 -2 -1    4324   2  0  1  1    4200   2  1  0 -1   -3359   2 -1 -1  1    2463
    2 -1  0  1    2211   2 -1 -1 -1    2065   0  1 -1 -1   -1870   4  0 -1 -1    1828   0  1  0  1   -1794
    0  0  0  3   -1749   0  1 -1  1   -1565   1  0  0  1   -1491   0  1  1  1   -1475   0  1  1 -1   -1410
    0  1  0 -1   -1344   1  0  0 -1   -1335   0  0  3  1    1107   4  0  0 -1    1021   4  0 -1  1     833
    0  0  1 -3     777   4  0 -2  1     671   2  0  0 -3     607   2  0  2 -1     596   2 -1  1 -1     491
    2  0 -2  1    -451   0  0  3 -1     439   2  0  2  1     422   2  0 -3 -1     421   2  1 -1  1    -366
    2  1  0  1    -351   4  0  0  1     331   2 -1  1  1     315   2 -2  0 -1     302   0  0  1  3    -283
    2  1  1 -1    -229   1  1  0 -1     223   1  1  0  1     223   0  1 -2 -1    -220   2  1 -1 -1    -220
    1  0  1  1    -185   2 -1 -2 -1     181   0  1  2  1    -177   4  0 -2 -1     176   4 -1 -1 -1     166
    1  0  1 -1    -164   4  0  1 -1     132   1  0 -1 -1    -119   4 -1  0 -1     115   2 -2  0  1     107
    """.split(),
    float,
).reshape(-1, 5)
# Venus, Jupiter and the flattening of the Earth: multiples of M', F, L', A1, A2, A3 and the same coefficients
# (Meeus 1998, page 338).
_LONGITUDE_AND_DISTANCE_MORE = np.array(
    [[0, 0, 0, 1, 0, 0, 3958, 0], [0, -1, 1, 0, 0, 0, 1962, 0], [0, 0, 0, 0, 1, 0, 318, 0]], float
)
_LATITUDE_MORE = np.array(
    [
        [0, 0, 1, 0, 0, 0, -2235],
        [0, 0, 0, 0, 0, 1, 382],
        [0, -1, 0, 1, 0, 0, 175],
        [0, 1, 0, 1, 0, 0, 175],
        [-1, 0, 1, 0, 0, 0, 127],
        [1, 0, 1, 0, 0, 0, -115],
    ],
    float,
)
_MEAN_DISTANCE = 385000560.0
_UNIT = np.pi / 180e6


def moon_position(t_centuries: Float[Array, ""]) -> Float[Array, "3"]:
    """Return the place of the Moon [m], true equator and equinox of date, by TT Julian centuries since J2000.

    All terms of Meeus 1998, chapter 47 (10" in longitude, 4" in latitude against ELP-2000/82), with light time, and
    nutation. Within 0.0003 deg of ERFA moon98, the same theory. Float32 rounds the time argument to minutes and the
    phases with it: within 0.03 deg.
    """
    t, dtype = t_centuries, t_centuries.dtype
    powers = jnp.stack([jnp.ones_like(t), t, t**2, t**3, t**4])
    arguments = jnp.matmul(jnp.asarray(np.radians(_ARGUMENTS_DEG), dtype), powers, precision="highest")
    # Terms with the Sun's anomaly shrink with the eccentricity of the Earth's orbit, once for each multiple (eq. 47.6).
    e = 1.0 - t * (0.002516 + 0.0000074 * t)
    shrinking = jnp.stack([jnp.ones_like(e), e, e**2])

    def phases_and_sizes(multiples, coefficients):
        phase = jnp.matmul(jnp.asarray(multiples, dtype), arguments, precision="highest")
        shrunk = shrinking[np.abs(multiples[:, _SUN_ANOMALY]).astype(int)]
        return phase, jnp.asarray(coefficients.T, dtype) * shrunk[None]

    phase, (in_longitude, in_distance) = phases_and_sizes(*_LONGITUDE_TERMS)
    longitude = arguments[_MEAN_LONGITUDE] + _UNIT * jnp.sum(in_longitude * jnp.sin(phase))
    distance = _MEAN_DISTANCE + jnp.sum(in_distance * jnp.cos(phase))
    phase, (in_latitude,) = phases_and_sizes(*_LATITUDE_TERMS)
    latitude = _UNIT * jnp.sum(in_latitude * jnp.sin(phase))
    across = jnp.cos(latitude)
    direction = jnp.stack([across * jnp.cos(longitude), across * jnp.sin(longitude), jnp.sin(latitude)])
    return distance * jnp.matmul(dcm_eci_from_ecliptic(t), direction, precision="highest")


class Moon(AbstractOrbit):
    """The Moon about the Earth from the series of `moon_position`, traced: `Moon(epoch.tt_centuries())`."""

    centuries: Float[Array, ""] = eqx.field(converter=float_array)
    """TT at t = 0, Julian centuries since J2000."""

    def __call__(self, t: Float[Array, ""]) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
        """Return position [m] and velocity [m/s], true equator and equinox of date, `t` seconds after the epoch."""

        def position(t):
            return moon_position(self.centuries + t / (SECONDS_PER_DAY * DAYS_PER_CENTURY))

        return jax.jvp(position, (t,), (jnp.ones_like(t),))

    def check_span(self, times: np.ndarray) -> None:
        """Accept any times: the series are as good over 1900-2100."""


def _joined(main: np.ndarray, more: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Multiples of all eight arguments, and coefficients."""
    multiples = np.concatenate([np.pad(main[:, :4], ((0, 0), (0, 4))), np.pad(more[:, :6], ((0, 0), (2, 0)))])
    return multiples, np.concatenate([main[:, 4:], more[:, 6:]])


_LONGITUDE_TERMS = _joined(_LONGITUDE_AND_DISTANCE, _LONGITUDE_AND_DISTANCE_MORE)
_LATITUDE_TERMS = _joined(_LATITUDE, _LATITUDE_MORE)
