"""A small satellite in a file, and a sensor of five lines that its user wrote."""

import re
from pathlib import Path

SATELLITE = """
# What its builder knows.
[body]
inertia_kg_m2 = {value = [0.0020, 0.0017, 0.0014], sigma = 1e-4}

[magnet]
dipole_A_m2 = {value = [0.0, 0.0, 0.0], sigma = 0.01}

[orbit.elements]
a_km = 6900
e = 0.001
i_deg = 97
raan_deg = 20
argp_deg = 10
mean_anomaly_deg = 5
epoch = "2021-05-01T00:00:00Z"

[time]
column = "utc"

[sensors.mag]
kind = "magnetometer"
unit = "nT"
bias = {value = [0.0, 0.0, 0.0], sigma = 500.0}

[channels.mag]
columns = ["bx", "by", "bz"]
unit = "nT"
sigma = 100.0

[sensors.gyro]
kind = "gyro"
unit = "deg/s"
bias = {value = [0.0, 0.0, 0.0], sigma = 0.3}

[channels.gyro]
columns = ["gx", "gy", "gz"]
unit = "deg/s"
sigma = 0.02
quantum = 0.01
"""

PHOTODIODES = """
[sensors.sun]
kind = "photodiodes"
normals = ["+x", "-x", "+y", "-y", "+z", "-z"]
gain = {value = 1.0, sigma = 0.03}

[channels.sun]
columns = ["s1", "s2", "s3", "s4", "s5", "s6"]
unit = "1"
sigma = 0.01
"""

_PAGE = (Path(__file__).parents[2] / "docs" / "satellites" / "twins.md").read_text("utf-8")
_CODE = r"^<!-- file: mycells.py -->\n```python\n(.*?)^```\n\n```toml\n(.*?)^```"
((MODULE, OWN),) = re.findall(_CODE, _PAGE, re.DOTALL | re.MULTILINE)
"""The sensor of the documentation, `mycells.py`, and what stands of it in the satellite file."""
