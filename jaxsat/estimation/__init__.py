"""Estimation: attitude and the direction of the Sun from readings, without a model of the motion."""

from jaxsat.estimation.magnetometer import MagnetometerCalibration as MagnetometerCalibration
from jaxsat.estimation.magnetometer import calibrate_magnetometer as calibrate_magnetometer
from jaxsat.estimation.sun.candidates import Candidates as Candidates
from jaxsat.estimation.sun.candidates import sun_candidates as sun_candidates
from jaxsat.estimation.sun.filter import SunFilter as SunFilter
from jaxsat.estimation.sun.filter import blank_filter as blank_filter
from jaxsat.estimation.sun.filter import corrected as corrected
from jaxsat.estimation.sun.filter import predicted as predicted
from jaxsat.estimation.sun.published import SunReading as SunReading
from jaxsat.estimation.sun.published import published_direction as published_direction
from jaxsat.estimation.sun.published import two_current_limit as two_current_limit
from jaxsat.estimation.sun.tracker import SunTrack as SunTrack
from jaxsat.estimation.sun.tracker import blank_track as blank_track
from jaxsat.estimation.sun.tracker import carried as carried
from jaxsat.estimation.sun.tracker import followed as followed
from jaxsat.estimation.sun_magnetic import attitude_from_sun_magnetic as attitude_from_sun_magnetic
from jaxsat.estimation.sun_magnetic import sun_magnetic_angles as sun_magnetic_angles
from jaxsat.estimation.sun_magnetic import sun_magnetic_axes as sun_magnetic_axes
from jaxsat.estimation.vectors import davenport_matrix as davenport_matrix
from jaxsat.estimation.vectors import rotation_covariance as rotation_covariance
from jaxsat.estimation.vectors import triad as triad
from jaxsat.estimation.vectors import two_vector_attitude as two_vector_attitude
from jaxsat.estimation.vectors import weighted_attitude as weighted_attitude
from jaxsat.estimation.wahba import quest as quest
from jaxsat.estimation.wahba import wahba as wahba
