"""Physical constants in SI units, each with its source."""

import math

EARTH_MU = 3.986004415e14
"""Gravitational parameter of the Earth [m^3/s^2] (EGM2008: Pavlis et al. 2012)."""

EARTH_RADIUS_MEAN = 6371.2e3
"""Mean radius of the Earth [m]: reference radius of the IGRF (Alken et al. 2021); also used for shadow and albedo."""

EARTH_EQUATORIAL_RADIUS = 6378136.3
"""Equatorial radius that scales the EGM2008 gravity coefficients [m] (Pavlis et al. 2012)."""

EARTH_ROTATION_RATE = 2.0 * math.pi * 1.002737909350795 / 86400.0
"""Rate of Greenwich mean sidereal time with UT1 [rad/s], 7.292115855e-5 (Aoki et al. 1982, eq. 14).

Measured from the moving equinox, as the true-of-date axes of this package are: it exceeds the rate of rotation in
inertial space, 7.292115147e-5 rad/s, by the precession in right ascension.
"""

SUN_RADIUS = 6.957e8
"""Nominal solar radius [m] (IAU 2015 resolution B3: Prsa et al. 2016)."""

AU = 149597870700.0
"""Astronomical unit [m] (IAU 2012 resolution B2)."""

SOLAR_PRESSURE = 4.56e-6
"""Pressure of sunlight at 1 AU on an absorbing surface that faces it [Pa] (Montenbruck & Gill 2000, section 3.4)."""

VACUUM_PERMEABILITY = 1.25663706127e-6
"""Magnetic constant mu0 [N/A^2] (CODATA 2022: Mohr et al. 2025)."""
