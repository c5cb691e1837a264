"""Least squares on exact Jacobians for many starts at once, and the growing arcs that lead there."""
