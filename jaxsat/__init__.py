"""Differentiable simulator of satellite attitude and orbit in JAX.

Nothing is imported here before it is asked for, so that `jaxsat --help` costs no JAX. Start from

- `jaxsat.read_satellite`, `jaxsat.read_telemetry`, and `fitting.fit`: from telemetry to attitude and parameters,
- `jaxsat.environment`: orbit, magnetic field, Sun, shadow, albedo and their tables,
- `jaxsat.spacecraft`, `jaxsat.torques`, `jaxsat.simulate`: the satellite and its motion,
- `jaxsat.sensors`, `jaxsat.estimation`: what it measures, and what readings say by themselves,
- `jaxsat.control`, `jaxsat.sweep`: closed loops, and many cases of them,
- `jaxsat.telemetry`: files,
- `jaxsat.compiled`, `jaxsat.keep_programs`: fast programs about one trajectory, kept between runs,
- `fitting`: identification.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jaxsat.math.one_function import compiled as compiled
    from jaxsat.numerics import keep_programs as keep_programs
    from jaxsat.numerics import set_up_jax as set_up_jax
    from jaxsat.satellites import read_satellite as read_satellite
    from jaxsat.telemetry import read_telemetry as read_telemetry

_PLACES = {
    "compiled": "jaxsat.math.one_function",
    "keep_programs": "jaxsat.numerics",
    "set_up_jax": "jaxsat.numerics",
    "read_satellite": "jaxsat.satellites",
    "read_telemetry": "jaxsat.telemetry",
}


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("jaxsat")
    if name not in _PLACES:
        raise AttributeError(f"module 'jaxsat' has no attribute {name!r}")
    return getattr(import_module(_PLACES[name]), name)
