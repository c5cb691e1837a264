"""The bundled session of Munin refined from its true motion and numbers, as a fit of its satellite file would."""

import dataclasses
import json
from typing import Any

import jax.numpy as jnp
import numpy as np

from fitting.measurements.abstract import RATE_UNIT
from fitting.measurements.assembly import Samples, build_problem, channels_within, usable
from fitting.parameters.chosen import chosen_leaves
from fitting.parameters.free import free_parameters
from fitting.solvers.refine import refine
from fitting.starts.multi_start import Starts
from fitting.surroundings import surroundings
from jaxsat.bundled import BUNDLED
from jaxsat.satellites import read_satellite
from jaxsat.satellites.model import with_values
from jaxsat.telemetry import read_telemetry

ROOM_S = 6.0


def true_values(leaves, cfg: dict[str, Any], *, modulus: float | None) -> np.ndarray:
    """[leaves] SI, at the scale of a |magnet| if one is given; what the truth has no word for is nominal: 0 or 1."""
    scale = 1.0 if modulus is None else modulus / float(np.linalg.norm(cfg["magnet"]))
    values = {f"magnet.{axis}": scale * m for axis, m in zip("xyz", cfg["magnet"], strict=True)}
    values |= {f"rods.{axis}": scale * m for axis, m in zip("yz", cfg["rods"], strict=True)}
    J = scale * np.array(cfg["inertia"])
    values |= {f"inertia.{a}{b}": J["xyz".index(a), "xyz".index(b)] for a, b in ("xx", "yy", "zz", "xy", "xz", "yz")}
    values |= {"imax": 1e-3 * cfg["imax"], "albedo.specular": cfg["albedo_specular"]}
    values["albedo.diffuse"] = cfg["albedo_diffuse"]
    return np.array(
        [
            values.get(leaf.name, 1.0 if leaf.name.startswith("gains.") or ".scale." in leaf.name else 0.0)
            for leaf in leaves
        ]
    )


class TrueMinimum:
    """Problem, parameters and minimum; `free` as for a fit, `samples` of the session from its first on."""

    def __init__(self, *free: str, samples: int | None = None, at_truth: bool = False, step_s: float = 32.0):
        """`at_truth` makes the true numbers the nominal ones, so that what is not free is right."""
        satellite = read_satellite()
        session = read_telemetry(BUNDLED, satellite)
        truth = json.loads(BUNDLED.with_suffix(".truth.json").read_text())
        model, leaves = satellite.model, satellite.leaves
        if at_truth:
            spots = [leaf.spot for leaf in leaves]
            model = with_values(model, spots, jnp.asarray(true_values(leaves, truth["cfg"], modulus=None)))
        # Without a floor of the telemetry the cost is a sum of squares, which another solver can lower too.
        channels = {
            name: dataclasses.replace(channel, quantum=None) for name, channel in channels_within(session, None).items()
        }
        whole = Samples.of(channels, session.epoch, dict(session.columns))
        data = whole
        if samples is not None:
            cut = {name: rows[:samples] for name, rows in whole.values.items()}
            data = dataclasses.replace(whole, t=whole.t[:samples], values=cut)
        self.samples = data
        around, _ = surroundings(satellite, session)
        self.problem = build_problem(data, model, around, delayed=(), max_step=step_s, room_for=ROOM_S, whole=whole)
        names = chosen_leaves(leaves, free, satellite.aliases)
        self.parameters = free_parameters(model, leaves, names, held=satellite.held)
        self.weight = usable(self.problem, data)
        x = np.zeros((1, len(self.parameters.names)))
        x[0, 3:6] = np.array(truth["w"][0]) / RATE_UNIT
        if not at_truth:
            x[0, 6:] = self.parameters.shifts(true_values(leaves, truth["cfg"], modulus=0.3))
        starts = Starts(x, np.array(truth["q"][:1]), np.zeros(1))
        self.refined = refine(
            self.problem, self.parameters, starts, self.weight, likelihood="normal", progress=lambda *_: None
        )
