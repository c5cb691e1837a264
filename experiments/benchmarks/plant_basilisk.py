"""The plant of closed loops beside Basilisk and SciPy at equal commands: one detumbling case and one of wheels.

Our loops decide, from noisy readings; the dipoles and the torques of the wheels' motors that they command are then
given to Basilisk and to SciPy's DOP853, which start from the same state. Field of one inertial direction, orbit of
point-mass gravity, gravity gradient; of wheels no friction. Then the fastest of 200 cases of `jaxsat sweep detumble`
with its own steps and with short ones. Prints the largest angles between the motions and the times, writes JSON; half a
minute.

    .venv/bin/pip install -e '.[basilisk]'
    .venv/bin/python experiments/benchmarks/plant_basilisk.py --out plant-basilisk.json

With `--python` Basilisk runs in another interpreter, as one of an environment of its own.
"""

import argparse
import dataclasses
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from jaxsat.bundled import CUBESAT
from jaxsat.constants import EARTH_MU
from jaxsat.control.actuators import ReactionWheels
from jaxsat.control.closed_loop import run_one
from jaxsat.control.laws import target_along
from jaxsat.control.loops import (
    AsRead,
    FieldDifference,
    Motion,
    Plant,
    Pointing,
    Schedule,
    channel,
    first_state,
    loop,
    timeline,
    vehicle,
)
from jaxsat.environment import KeplerOrbit, Sun, Surroundings, igrf_field
from jaxsat.numerics import set_up_jax
from jaxsat.satellites import read_satellite
from jaxsat.satellites.actuators import torquers_of, wheels_of
from jaxsat.sensors import Gyroscope, Magnetometer, StarTracker
from jaxsat.sweep import drawn_inputs
from jaxsat.sweep.scenarios import detumble

PERIODS, SEED, BASILISK_STEP_S = 600, 3, 0.05
FIELD = np.array([1.2e-5, -2.0e-5, 3.1e-5])
RADIUS, INCLINATION = 6.878137e6, np.radians(97.4)
TIP_OFF = np.radians([5.0, -6.0, 4.0])
SCRIPT = Path(__file__).parent / "models" / "plant_bsk.py"


def cases():
    """Plant, estimator, controller, schedule and start of both cases, by name."""
    satellite = read_satellite(CUBESAT)
    orbit = KeplerOrbit(RADIUS, 0.0, INCLINATION, 0.3, 0.0, 0.0)
    around = Surroundings(orbit, igrf_field(2026.0), 0.0, sun=Sun(0.26))
    craft = dataclasses.replace(satellite.model.spacecraft, facets=None, magnet=None)
    torquers, wheels = torquers_of(satellite), wheels_of(satellite)
    wheels = ReactionWheels.along(
        np.array(wheels.axes), np.array(wheels.inertia), np.array(wheels.max_torque), np.array(wheels.max_speed)
    )
    q = jnp.asarray(Rotation.from_rotvec([0.4, -1.1, 0.7]).as_quat(scalar_first=True))

    detumble = Schedule(2.0, 0.1, 0.8)
    field = {"field": channel(Magnetometer(), sigma=1e-7)}
    plant = Plant(vehicle(craft, torquers), field, still(timeline(around, detumble, PERIODS)))
    yield "detumbling", plant, AsRead(), FieldDifference(6e-5), detumble, Motion(q, jnp.asarray(TIP_OFF)), orbit

    point = Schedule(1.0, 0.1, 0.8)
    table = still(timeline(around, point, PERIODS))
    rows = table.instants
    given = (np.asarray(x) for x in (rows.time, rows.position_eci, rows.velocity_eci, rows.sun_eci))
    target = target_along("nadir", *given, axis=np.array([0, 0, 1.0]), second=np.array([0, 1.0, 0]))
    rows = dataclasses.replace(rows, target_quaternion=target.quaternion, target_rate_eci=target.rate_eci)
    seen = field | {"rate": channel(Gyroscope(), sigma=3e-4), "attitude": channel(StarTracker(), sigma=3e-3)}
    plant = Plant(vehicle(craft, torquers, wheels), seen, dataclasses.replace(table, instants=rows))
    law = Pointing(craft.inertia, 0.1, 0.8, 0.01, 0.002, 0.2, 0.0, wheels)
    yield "wheels", plant, AsRead(), law, point, Motion(q, jnp.asarray(0.05 * TIP_OFF), jnp.zeros(3)), orbit


def still(table):
    """The same surroundings with one field."""
    points = dataclasses.replace(
        table.stages.points, b_field_eci=jnp.broadcast_to(FIELD, table.stages.points.b_field_eci.shape)
    )
    rows = dataclasses.replace(table.instants, b_field_eci=jnp.broadcast_to(FIELD, table.instants.b_field_eci.shape))
    return dataclasses.replace(table, instants=rows, stages=dataclasses.replace(table.stages, points=points))


def ours(plant, estimator, controller, schedule, motion):
    """Motion at the beginnings of the periods and at the end, commands, and the time of a second run [s]."""
    state = first_state(plant, estimator, controller, motion)
    fixed = (plant.vehicle, plant.channels, estimator, controller)

    @jax.jit
    def run(state, key):
        return run_one(loop(plant, estimator, controller, schedule), fixed, state, key, PERIODS)

    jax.block_until_ready(run(state, jax.random.key(SEED)))
    begin = time.perf_counter()
    end, samples = jax.block_until_ready(run(state, jax.random.key(SEED)))
    seconds = time.perf_counter() - begin
    q = np.concatenate([np.array(samples.motion.quaternion)[1:], np.array(end.motion.quaternion)[None]])
    motors = np.zeros((0, 3)) if samples.motors is None else np.array(samples.motors)
    return q, np.array(samples.dipoles), motors, seconds


def by_scipy(case):
    """Quaternions at the ends of the periods by DOP853, platform and wheels by their momenta."""
    J, axes, inertia = case["inertia"], case["axes"], float(case["wheel_inertia"])
    spins = bool(case["motors"].size)
    platform = J - inertia * axes.T @ axes if spins else J
    n = np.sqrt(EARTH_MU / RADIUS**3)
    start, across = case["position"], case["velocity"] / n

    def slope(t, y, dipole, motors):
        q, total, axial = Rotation.from_quat(y[:4], scalar_first=True).inv(), y[4:7], y[7:]
        w = np.linalg.solve(platform, total - axial @ axes) if spins else np.linalg.solve(J, total)
        r = q.apply(start * np.cos(n * t) + across * np.sin(n * t))
        torque = 3.0 * EARTH_MU / RADIUS**5 * np.cross(r, J @ r) + np.cross(dipole, q.apply(case["field"]))
        turn = [-0.5 * y[1:4] @ w], 0.5 * (y[0] * w + np.cross(y[1:4], w))
        return np.concatenate([*turn, torque - np.cross(w, total), motors if spins else np.zeros(0)])

    axial = inertia * axes @ case["rate"] if spins else np.zeros(0)
    y, now, found = np.concatenate([case["quaternion"], J @ case["rate"], axial]), 0.0, []
    for number, dipoles in enumerate(case["dipoles"]):
        motors = case["motors"][number] if spins else np.zeros(3)
        for span, share in zip(case["spans"], case["shares"], strict=True):
            given = (np.asarray(share) * dipoles, motors)
            y = solve_ivp(slope, (now, now + span), y, "DOP853", args=given, rtol=1e-11, atol=1e-13).y[:, -1]
            y[:4] /= np.linalg.norm(y[:4])
            now += float(span)
        found.append(y[:4])
    return np.array(found)


def by_basilisk(case, python):
    """The same, and the time [s]; None where Basilisk is not installed."""
    with tempfile.TemporaryDirectory() as folder:
        given, found = Path(folder) / "case.npz", Path(folder) / "motion.npz"
        np.savez(given, **case)
        done = subprocess.run([python, str(SCRIPT), str(given), str(found)], capture_output=True, text=True)
        if done.returncode:
            print(done.stderr.strip().splitlines()[-1] if done.stderr else "Basilisk failed", file=sys.stderr)
            return None
        with np.load(found) as motion:
            return motion["states"][:, :4], float(motion["seconds"])


def apart(p, q) -> float:
    """Largest angle between attitudes [rad]."""
    turns = (Rotation.from_quat(each / np.linalg.norm(each, axis=1)[:, None], scalar_first=True) for each in (p, q))
    first, second = turns
    return float((first.inv() * second).magnitude().max())


def by_steps(options) -> float:
    """Largest angle over two orbits between a sweep's case, the fastest of 200, and itself in steps of 0.05 s [rad]."""
    scenario = detumble.make(options)
    drawn = drawn_inputs(scenario, SEED, np.arange(200))
    case = int(np.argmax(sum(drawn[f"in_rate_{c}_deg_s"] ** 2 for c in "xyz")))
    motions = []
    for step in ("auto", "0.05"):
        history = detumble.make({**options, "step_s": step}).history
        assert history is not None
        columns = history(SEED, case).columns
        motions.append(np.stack([columns[f"quaternion_{c}"] for c in "wxyz"], axis=1))
    return apart(*motions)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("plant-basilisk.json"))
    parser.add_argument("--python", default=sys.executable, help="interpreter that has Basilisk")
    arguments = parser.parse_args()
    set_up_jax()
    rows = {}
    print(f"{'':14}{'DOP853, rad':>14}{'Basilisk, rad':>16}{'Basilisk - DOP853':>20}{'ours, s':>10}{'Basilisk, s':>13}")
    for name, plant, estimator, controller, schedule, motion, orbit in cases():
        q, dipoles, motors, seconds = ours(plant, estimator, controller, schedule, motion)
        position, velocity = (np.array(x) for x in orbit(jnp.zeros(())))
        wheels = plant.vehicle.wheels
        on, torquers = schedule.duty * schedule.period_s, plant.vehicle.torquers
        assert torquers is not None
        case = {
            "inertia": np.array(plant.vehicle.spacecraft.inertia),
            "axes": np.eye(3) if wheels is None else np.array(wheels.axes),
            "wheel_inertia": 0.0 if wheels is None else float(wheels.inertia[0]),
            "mu": EARTH_MU,
            "position": position,
            "velocity": velocity,
            "quaternion": np.array(motion.quaternion),
            "rate": np.array(motion.angular_velocity),
            "field": FIELD,
            "dipoles": dipoles,
            "motors": motors,
            "spans": np.array([on, schedule.period_s - on]),
            "shares": np.stack([np.ones(3), np.array(torquers.residual)]),
            "step_s": BASILISK_STEP_S,
        }
        exact, theirs = by_scipy(case), by_basilisk(case, arguments.python)
        rows[name] = {
            "periods": PERIODS,
            "ours_and_dop853_rad": apart(q, exact),
            "ours_and_basilisk_rad": None if theirs is None else apart(q, theirs[0]),
            "basilisk_and_dop853_rad": None if theirs is None else apart(theirs[0], exact),
            "ours_s": seconds,
            "basilisk_s": None if theirs is None else theirs[1],
        }
        row = [f"{x:.2e}" if x is not None else "none" for x in list(rows[name].values())[1:]]
        print(f"{name:14}{row[0]:>14}{row[1]:>16}{row[2]:>20}{row[3]:>10}{row[4]:>13}", flush=True)
    smooth = {"pressure": "off", "sensors": "perfect", "law": "gyro"}
    for name, options in (("steps, smooth", smooth), ("steps, digits", {"pressure": "off"})):
        rows[name] = {"steps_rad": by_steps(options)}
        print(f"{name:14}{rows[name]['steps_rad']:>14.2e}", flush=True)
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    arguments.out.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
