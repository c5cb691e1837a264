"""Options that all scenarios of any satellite have."""

from jaxsat.sweep.scenario import Option

COMMON = (
    Option("satellite", "", "satellite file; without it a bundled CubeSat of three units", file=True),
    Option("orbit", "", "TLE, OMM or OEM in place of the orbit of the satellite file", file=True),
    Option("start_utc", "", "first instant, as 2026-03-20T12:00:00Z; without it that of the orbit's elements"),
    Option("spread", "1", "of the numbers of the satellite file, in the sigmas that stand there; 0: as they stand"),
    Option("pressure", "on", "air and sunlight on the surface of the satellite file, where it has one: on or off"),
)
"""Options of every scenario of any satellite."""
