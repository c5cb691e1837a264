"""Torques that the satellite file leaves out: one part with all the usual ones at zero, freed a kind at a time.

A model with that part is another program, which compiles once for a size of session; its kinds share it.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.doctor.bench import Bench
from fitting.doctor.causes.freeing import chi2_in_room, widened
from fitting.doctor.trial import Trial
from fitting.identify import Minimum
from jaxsat.constants import VACUUM_PERMEABILITY
from jaxsat.errors import InputError
from jaxsat.math import cross
from jaxsat.satellites.model import Leaf
from jaxsat.spacecraft import HysteresisRods, Spacecraft
from jaxsat.torques.abstract import AbstractTorque, BodyEnvironment, required
from jaxsat.torques.eddy_damping import eddy_damping_torque

COERCIVE_FIELDS, REMANENCE, SATURATION = (8.0, 2.0), 0.02, 0.04
"""Of the soft magnetic rods that are tried along each body axis [A/m, T, T]; their volumes are free."""
WIDE = 5.0
"""Prior sigma over what would stop the satellite's spin within the session."""
ALIKE = 1.25
"""Of the chi2 of the best kind, up to which another one is named beside it."""
KINDS = {
    "constant": ("a constant torque", "a leak, or a coil that is driven in step: [residual] in the satellite file"),
    "eddy": ("eddy currents", "currents in the shell damp the motion: [eddy] in the satellite file"),
    "lag": ("hysteresis", "soft magnetic rods or steel on board: [[rods]] with Hc, Br, Bs and volume"),
    "air": ("air drag", "the centre of pressure is not that of mass: [surface] in the satellite file"),
}
"""Fields of `MissingTorque` in words, and what to do."""


class MissingTorque(AbstractTorque):
    """What a satellite file may have forgotten, each zero where it is not there."""

    smooth: ClassVar[bool] = True

    constant: Float[Array, "3"]
    """Body axes [N m]."""
    eddy: Float[Array, ""]
    """Coefficient of `EddyDamping` [A m^2 s / T]."""
    air: Float[Array, "3"]
    """Half of drag coefficient and area, times the centre of pressure, body axes [m^3]."""

    def __call__(self, spacecraft: Spacecraft, around: BodyEnvironment) -> Float[Array, "3"]:
        field, rate = around.b_field_body, around.angular_velocity
        wind = required(around.air_velocity_body, "MissingTorque", "air_velocity_body", "the air in the table")
        density = required(around.air_density, "MissingTorque", "air_density", "the air in the table")
        speed = jnp.sqrt(jnp.sum(wind**2))
        return self.constant + eddy_damping_torque(self.eddy, rate, field) - density * speed * cross(self.air, wind)


def missing_torques(bench: Bench) -> Iterator[Trial]:
    """Each kind of torque that no part of the satellite has, the best of them told, and how the others do."""
    found: dict[str, float] = {}
    counts: dict[str, int] = {}
    for field in COERCIVE_FIELDS:
        # The others are the same whatever the rods are, and a satellite with rods of its own gets no more of them.
        kinds = [key for key in KINDS if key not in counts or (key == "lag" and counts[key])]
        if not kinds:
            break
        wider = _with_part(bench, field)
        for key in kinds:
            numbers = [k for k, leaf in enumerate(wider.parameters.leaves) if leaf.part == _part(key)]
            counts[key] = len(numbers)
            chi2 = chi2_in_room(wider, numbers) if numbers else None
            if chi2 is not None:
                found[key] = min(chi2, found.get(key, np.inf))
    # By the price of their numbers: rods of three axes imitate currents in the shell.
    price = float(np.log(max(bench.readings, 2)))
    ranks = sorted(found, key=lambda key: found[key] + price * counts[key])
    if not ranks:
        return
    best = ranks[0]
    # What fits as well cannot be told apart by these data.
    alike = [key for key in ranks if found[key] < ALIKE * found[best]]
    words = " or ".join(KINDS[key][0] for key in alike)
    others = "; ".join(f"{KINDS[key][0]}: chi2 {found[key]:.0f}" for key in ranks)
    meaning = "; ".join(KINDS[key][1] for key in alike)
    yield Trial("torque", f"a torque is missing: {words}", f"{meaning} ({others})", found[best], counts[best])


def _part(key: str) -> str:
    return f"missing.{key}"


def _with_part(bench: Bench, coercive_field: float) -> Bench:
    """The bench of a satellite with that part, and nothing of it free."""
    craft = bench.problem.model.spacecraft
    part = MissingTorque(jnp.zeros(3), jnp.zeros(()), jnp.zeros(3))
    around, has_rods = replace(bench.around, pushed=True, field_rate=True), craft.hysteresis_rods is not None
    three = jnp.ones(3)
    rods = HysteresisRods(
        jnp.eye(3), 0.0 * three, coercive_field * three, REMANENCE * three, SATURATION * three, induction=0.0 * three
    )
    made = eqx.tree_at(
        lambda c: (c.parts, c.hysteresis_rods),
        craft,
        ((*craft.parts, part), craft.hysteresis_rods if has_rods else rods),
        is_leaf=lambda each: each is None,
    )

    def changed(problem):
        return eqx.tree_at(lambda p: p.model.spacecraft, problem, made)

    problem = changed(replace(bench, around=around).rebuilt(bench.samples))
    place = f"spacecraft.parts.{len(craft.parts)}"
    places = {key: f"{place}.{key}" for key in ("constant", "eddy", "air")}
    places |= {} if has_rods else {"lag": "spacecraft.hysteresis_rods.volumes"}
    leaves = (*bench.parameters.leaves, *_leaves(bench, problem, places))
    parameters, starts = widened(bench, problem.model, leaves)
    own = replace(bench, around=around)
    refined = own.refitted(problem, starts, parameters=parameters)
    if not len(refined.score):
        raise InputError("no motion under these torques that the steps of the fit can follow")
    minimum = Minimum(bench.found.minima[0].convention, problem, refined)
    return replace(own, found=replace(bench.found, minima=(minimum,), parameters=parameters))


def _leaves(bench: Bench, problem, places: dict[str, str]) -> list[Leaf]:
    """Its numbers, with priors that stop the spin within the session several times over."""
    field = float(np.median(np.linalg.norm(np.asarray(problem.orbit.b_field_eci), axis=-1)))
    prediction = bench.found.minima[0].refined.points.prediction
    spin = float(np.median(np.linalg.norm(np.asarray(prediction.angular_velocity)[0], axis=-1))) + 1e-3
    inertia = float(np.trace(np.asarray(problem.model.spacecraft.inertia))) / 3.0
    torque = WIDE * inertia * spin / max(float(np.ptp(bench.samples.t)), 1.0)
    density = np.asarray(problem.orbit.air_density)
    speed = np.linalg.norm(np.asarray(problem.orbit.air_velocity_eci), axis=-1)
    pressure = float(np.median(density * speed**2)) + 1e-30
    sizes = {
        "constant": torque,
        "eddy": torque / (spin * field**2),
        "lag": torque / field * VACUUM_PERMEABILITY / REMANENCE,
        "air": torque / pressure,
    }
    units = {"constant": "N m", "eddy": "S m4", "lag": "m3", "air": "m3"}
    found = []
    for key, place in places.items():
        size = sizes[key]
        for k, letter in enumerate("xyz" if key != "eddy" else "x"):
            found.append(
                Leaf(
                    f"{_part(key)}.{letter}",
                    place,
                    (k,),
                    units[key],
                    # With a sigma there is room for as many numbers as the largest kind has.
                    sigma=size if key == "constant" else None,
                    loose=size,
                    lower=0.0 if key in ("eddy", "lag") else -np.inf,
                    part=_part(key),
                )
            )
    return found
