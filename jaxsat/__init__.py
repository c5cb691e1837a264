"""Differentiable simulator of satellite attitude and orbit in JAX.

Nothing is imported here, so that `jaxsat --help` costs no JAX. Start from

- `jaxsat.environment`: orbit, magnetic field, Sun, shadow, albedo and their tables,
- `jaxsat.spacecraft`, `jaxsat.torques`, `jaxsat.simulate`: the satellite and its motion,
- `jaxsat.sensors`: what it measures,
- `jaxsat.telemetry`: files,
- `fitting`: identification.
"""
