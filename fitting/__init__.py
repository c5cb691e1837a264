"""Identification: attitude and satellite parameters by `fitting.estimate`, orbits by `fitting.orbit`."""
