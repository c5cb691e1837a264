"""Tables and satellite files of a few lines, written by the tests."""

from collections.abc import Callable
from pathlib import Path

import pytest

from jaxsat.satellites import Satellite, read_satellite

HEAD = """
[body]
inertia_kg_m2 = [1e-3, 1e-3, 1e-3]
[sensors.mag]
kind = "magnetometer"
[channels.mag]
columns = ["bx", "by", "bz"]
unit = "nT"
sigma = 100.0
"""
ORBIT = """
[orbit.elements]
a_km = 6900
e = 0.001
i_deg = 97
raan_deg = 20
argp_deg = 10
mean_anomaly_deg = 5
epoch = "2021-05-01T00:00:00Z"
"""
GYRO = """
[sensors.gyro]
kind = "gyro"
[channels.gyro]
columns = ["gx", "gy", "gz"]
unit = "deg/s"
sigma = 0.1
quantum = 0.2
"""
TIME = '[time]\ncolumn = "utc"\n'


@pytest.fixture
def table(tmp_path) -> Callable[..., Path]:
    """Writes a table and gives its path."""

    def write(text: str, name: str = "pass.csv") -> Path:
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


@pytest.fixture
def satellite(tmp_path) -> Callable[..., Satellite]:
    """A satellite with a magnetometer, and what else is given."""

    def read(*, time: str = TIME, orbit: str = ORBIT, more: str = "") -> Satellite:
        path = tmp_path / "sat.toml"
        path.write_text(HEAD + time + orbit + more)
        found = read_satellite(path)
        assert isinstance(found, Satellite)
        return found

    return read
