"""Least squares on Jacobians by the variational equations, and the growing arcs that lead there."""
