"""Scenarios of `jaxsat sweep` that fit: one file each, found by the command as those of `jaxsat.sweep.scenarios`."""
