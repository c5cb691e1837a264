"""Identification of attitude and satellite parameters: start from `fitting.fit.fit` and `fitting.orbit_fit.fit_orbit`."""
