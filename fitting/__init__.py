"""Identification: attitude and satellite parameters by `fitting.fit.fit`, orbits by `fitting.orbit_fit.fit_orbit`."""
