"""Orbital elements from positions."""
