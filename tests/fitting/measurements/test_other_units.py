"""Stamps and commands of coils in a unit that cannot be: refused before a search."""

import numpy as np
import pytest

from fitting.run import fit
from jaxsat.errors import InputError
from jaxsat.satellites import read_satellite
from jaxsat.telemetry import read_telemetry

SATELLITE = """
[body]
inertia_kg_m2 = [2e-3, 2e-3, 2e-3]
[orbit.elements]
a_km = 6900
e = 0.001
i_deg = 97
raan_deg = 20
argp_deg = 10
mean_anomaly_deg = 5
epoch = "2021-05-01T00:00:00Z"
[[coils]]
axis = "+x"
area_turns_m2 = 2.0
column = "cx"
[time]
column = "t"
form = "seconds"
epoch = "2021-05-01T00:00:00Z"
[sensors.mag]
kind = "magnetometer"
[channels.mag]
columns = ["bx", "by", "bz"]
unit = "uT"
sigma = 0.3
"""
GYRO = """
[sensors.gyro]
kind = "gyro"
[channels.gyro]
columns = ["gx", "gy", "gz"]
unit = "deg/s"
sigma = 0.1
"""


def refused(tmp_path, every, *, current=0.02, more="") -> str:
    """What a fit says of 40 readings that turn at 2.3 deg/s."""
    lines = ["t,bx,by,bz,gx,gy,gz,cx"]
    for k in range(40):
        b = 30.0 * np.array([np.sin(0.2 * k), np.cos(0.2 * k), 0.3 + 0.01 * k])
        cells = [every * k, *b, 1.3 + 1e-4 * k, -1.4 + 1e-4 * k, 1.2 - 1e-4 * k, current if k > 20 else 0.0]
        lines.append(",".join(f"{each:.6g}" for each in cells))
    (tmp_path / "pass.csv").write_text("\n".join(lines) + "\n")
    (tmp_path / "sat.toml").write_text(SATELLITE + more)
    satellite = read_satellite(tmp_path / "sat.toml")
    with pytest.raises(InputError) as caught:
        fit(satellite, read_telemetry(tmp_path / "pass.csv", satellite), causes=False)
    return str(caught.value)


def test_milliseconds_for_seconds(tmp_path):
    # 5 s apart: by the gyroscope 2.25 deg/s times 5000 s are 31 turns; a period of 2 pi sqrt(a^3 / mu) is 5704 s.
    by_gyro = refused(tmp_path, 5000.0, more=GYRO)
    assert "by gyro the satellite turns 31 times between readings, which are 5000 s apart" in by_gyro
    assert "readings are 5000 s apart, in an orbit of 570" in refused(tmp_path, 5000.0)


def test_milliamperes_for_amperes(tmp_path):
    # 40 A m2 in some 30 uT on 2 g m2 are 0.6 rad/s2.
    assert "cx: the largest command, 20 A, is a dipole of 40 A m2" in refused(tmp_path, 5.0, current=20.0)
