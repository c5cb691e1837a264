"""A satellite file in a few lines, to be changed by the tests."""

BODY = """
[body]
mass_kg = 1.2
size_m = [0.1, 0.1, 0.2]
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
"""
MAG = """
[sensors.mag]
kind = "magnetometer"
unit = "uT"
bias = {value = [1.0, 2.0, 3.0], sigma = 0.5}
[channels.mag]
columns = ["bx", "by", "bz"]
unit = "nT"
sigma = 100.0
"""
