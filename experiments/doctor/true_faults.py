"""Faults of the satellite itself: settings of the independent program changed; each answers what its name is like."""

import re

import numpy as np

from experiments.doctor.data_faults import FACES


def dead_face(cfg, draw):
    k = int(draw.integers(6))
    cfg["panel_ratio"][k] = 0.0
    return rf"^column: column {re.escape(FACES[k])} "


def weak_face(cfg, draw):
    k = int(draw.integers(6))
    cfg["panel_ratio"][k] = 0.5
    # One gain that is off is named as such, or by its column.
    return rf"^column: column {re.escape(FACES[k])} |^gains not free"


def gains(cfg, draw):
    cfg["panel_ratio"] = draw.uniform(0.8, 1.2, 6).tolist()
    return r"^gains not free|^parts not free: gains"


def tilts(cfg, draw):
    normals = np.repeat(np.eye(3), 2, axis=0) * np.tile([1.0, -1.0], 3)[:, None]
    normals = normals + np.radians(3.0) * draw.standard_normal((6, 3))
    cfg["normals"] = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).tolist()
    return r"^tilts not free|^parts not free: tilts"


def noisy(cfg, draw):
    cfg["noise"] = float(draw.uniform(5.0, 8.0))
    return r"^noise: the noise of cells"


def other_pole(cfg, draw):
    cfg["magnet"] = (-np.array(cfg["magnet"])).tolist()
    return r"^magnet: .*-x|^magnet"


def other_axis(cfg, draw):
    axis = int(draw.integers(1, 3))
    cfg["magnet"] = np.roll(cfg["magnet"], axis).tolist()
    return rf"^magnet: .*{'xyz'[axis]}|^magnet"


def hysteresis(cfg, draw):
    cfg["parts"]["rods"] = [
        {"axis": axis, "Hc": 6.0, "Br": 0.05, "Bs": 0.1, "volume": float(draw.uniform(1.0, 3.0)) * 1e-7}
        for axis in ([0, 1, 0], [0, 0, 1])
    ]
    return r"^torque: .*hysteresis"


def eddy(cfg, draw):
    cfg["parts"]["eddy"] = float(draw.uniform(0.5, 2.0)) * 1e3
    return r"^torque: .*eddy"


def residual(cfg, draw):
    size, direction = 2e-8 * draw.uniform(1.0, 3.0), draw.standard_normal(3)
    cfg["parts"]["residual"] = (size * direction / np.linalg.norm(direction)).tolist()
    return r"^torque: .*constant"


def drag(cfg, draw):
    direction = draw.standard_normal(3)
    # Half of 3e-12 kg/m3 and of a drag coefficient of 2.2, a face of 0.01 m2, 1 to 3 cm.
    cfg["drag"] = (1.1e-14 * draw.uniform(0.01, 0.03) * 3.0 * direction / np.linalg.norm(direction)).tolist()
    return r"^torque: .*(air|drag)"


def kick(cfg, draw):
    at = float(draw.uniform(0.3, 0.7) * cfg["duration"])
    direction = draw.standard_normal(3)
    rate = np.radians(draw.uniform(0.2, 0.5)) * direction / np.linalg.norm(direction)
    cfg["parts"]["kick"] = {"t": at, "rate": rate.tolist()}
    return r"^motion: the motion changes"


def coil(cfg, draw):
    at = float(draw.uniform(0.3, 0.7) * cfg["duration"])
    direction = draw.standard_normal(3)
    moment = 0.1 * direction / np.linalg.norm(direction)
    cfg["parts"] |= {"coils": [{"axis": moment.tolist(), "area_turns_m2": 0.1}]}
    cfg["parts"]["commands"] = {"t": [at], "current": [[1.0]]}
    return r"^motion: the motion changes|^parts: the torque is not that of the model"


def no_albedo(cfg, draw):
    cfg["albedo_diffuse"], cfg["albedo_specular"] = float(draw.uniform(0.2, 0.4)), float(draw.uniform(0.2, 0.6))
    return r"^albedo not free|^parts not free: albedo"


def fast(cfg, draw):
    # Beyond half a turn between readings, and beyond what the Sun's turns show.
    turns = draw.uniform(0.6, 0.8)
    rate, direction = 2.0 * np.pi * turns / cfg["cadence"], draw.standard_normal(3)
    cfg["w0"] = (rate * direction / np.linalg.norm(direction)).tolist()
    return r"^rate: "
