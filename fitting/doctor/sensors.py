"""Which channels of a fit are of what kind."""

from fitting.doctor.bench import Bench
from jaxsat.sensors import Panels, Photodiodes


def sunlit(bench: Bench) -> list[str]:
    """Channels of flat faces that see light, and are fitted."""
    sensors, channels = bench.problem.model.sensors, bench.samples.channels
    return [name for name in channels if isinstance(sensors[name], Panels | Photodiodes) and not channels[name].witness]
