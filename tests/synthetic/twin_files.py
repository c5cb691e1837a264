"""A small satellite in a file, and a sensor of five lines that its user wrote."""

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

OWN = """
[sensors.cells]
kind = "mycells:MyCells"
peak = {value = 1.0, sigma = 0.05}

[channels.cells]
columns = ["c1", "c2", "c3", "c4", "c5", "c6"]
unit = "V"
sigma = 0.01
"""

MODULE = """
from jaxsat.sensors import AbstractSensor
from jaxsat.spacecraft import box_normals
from jaxtyping import Array, Float


class MyCells(AbstractSensor):
    peak: Float[Array, ""]
    needs = frozenset({"light"})

    def __call__(self, view):
        return self.peak * view.sunlight(box_normals())
"""
