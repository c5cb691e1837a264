"""A CubeSat under given dipoles and wheel torques, built of Basilisk's own modules.

Run by `plant_basilisk.py` in an interpreter that has Basilisk: reads a case from one .npz file and writes the motion to
another. Gravity gradient on an orbit of point-mass gravity, one inertial field, balanced wheels without friction.
"""

import sys
import time

import numpy as np
from Basilisk.architecture import bskLogging, messaging  # pyright: ignore[reportMissingImports]
from Basilisk.simulation import (  # pyright: ignore[reportMissingImports]
    GravityGradientEffector,
    MtbEffector,
    reactionWheelStateEffector,
    spacecraft,
)
from Basilisk.utilities import (  # pyright: ignore[reportMissingImports]
    RigidBodyKinematics,
    SimulationBaseClass,
    macros,
    simIncludeGravBody,
    simIncludeRW,
)

MASS_KG = 4.0
MOST = 36
"""Entries of messages of torquers and wheels."""


def simulation(case):
    """The simulation, and the messages of its commands."""
    bskLogging.setDefaultLogLevel(bskLogging.BSK_ERROR)
    sim = SimulationBaseClass.SimBaseClass()
    process = sim.CreateNewProcess("process")
    process.addTask(sim.CreateNewTask("dynamics", macros.sec2nano(float(case["step_s"]))))

    sim.craft = spacecraft.Spacecraft()
    hub = sim.craft.hub
    hub.mHub, hub.IHubPntBc_B = MASS_KG, case["inertia"].tolist()
    sim.gravity = simIncludeGravBody.gravBodyFactory()
    earth = sim.gravity.createEarth()
    earth.isCentralBody, earth.mu = True, float(case["mu"])
    sim.gravity.addBodiesTo(sim.craft)
    hub.r_CN_NInit, hub.v_CN_NInit = case["position"].tolist(), case["velocity"].tolist()
    q = case["quaternion"]
    hub.sigma_BNInit = np.reshape(RigidBodyKinematics.EP2MRP(q), (3, 1)).tolist()
    hub.omega_BN_BInit = np.reshape(case["rate"], (3, 1)).tolist()
    sim.gradient = GravityGradientEffector.GravityGradientEffector()
    sim.gradient.addPlanetName(earth.planetName)
    sim.craft.addDynamicEffector(sim.gradient)

    sim.field = messaging.MagneticFieldMsg().write(messaging.MagneticFieldMsgPayload(magField_N=case["field"].tolist()))
    layout = messaging.MTBArrayConfigMsgPayload()
    layout.numMTB, layout.maxMtbDipoles = 3, [1.0] * 3
    layout.GtMatrix_B = np.eye(3).ravel().tolist()
    sim.layout = messaging.MTBArrayConfigMsg().write(layout)
    sim.dipoles = messaging.MTBCmdMsg().write(messaging.MTBCmdMsgPayload(mtbDipoleCmds=[0.0] * 3))
    sim.torquers = MtbEffector.MtbEffector()
    for port, message in (("mtbCmdInMsg", sim.dipoles), ("magInMsg", sim.field), ("mtbParamsInMsg", sim.layout)):
        getattr(sim.torquers, port).subscribeTo(message)
    sim.craft.addDynamicEffector(sim.torquers)

    sim.motors = messaging.ArrayMotorTorqueMsg().write(messaging.ArrayMotorTorqueMsgPayload())
    if case["motors"].size:
        sim.factory = simIncludeRW.rwFactory()
        for axis in case["axes"]:
            sim.factory.create(
                "custom", axis.tolist(), Js=float(case["wheel_inertia"]), Omega=0.0, u_max=1.0, Omega_max=1e6
            )
        sim.wheels = reactionWheelStateEffector.ReactionWheelStateEffector()
        sim.factory.addToSpacecraft("wheels", sim.wheels, sim.craft)
        sim.wheels.rwMotorCmdInMsg.subscribeTo(sim.motors)
        sim.AddModelToTask("dynamics", sim.wheels, 2)
    sim.AddModelToTask("dynamics", sim.gradient, 3)
    sim.AddModelToTask("dynamics", sim.torquers, 3)
    sim.AddModelToTask("dynamics", sim.craft, 1)
    return sim


def filled(numbers):
    """A list as long as messages have them."""
    return [*numbers.tolist(), *[0.0] * (MOST - len(numbers))]


def run(case):
    """Quaternions and rates at the ends of the control periods, and the seconds that it took."""
    sim = simulation(case)
    sim.InitializeSimulation()
    begin, now, found = time.perf_counter(), 0.0, []
    for number, dipoles in enumerate(case["dipoles"]):
        if case["motors"].size:
            torques = messaging.ArrayMotorTorqueMsgPayload(motorTorque=filled(case["motors"][number]))
            sim.motors.write(torques, macros.sec2nano(now))
        for span, share in zip(case["spans"], case["shares"], strict=True):
            given = messaging.MTBCmdMsgPayload(mtbDipoleCmds=filled(share * dipoles))
            sim.dipoles.write(given, macros.sec2nano(now))
            now += float(span)
            sim.ConfigureStopTime(macros.sec2nano(now))
            sim.ExecuteSimulation()
        state = sim.craft.scStateOutMsg.read()
        found.append([*RigidBodyKinematics.MRP2EP(np.array(state.sigma_BN)).ravel(), *state.omega_BN_B])
    return np.array(found), time.perf_counter() - begin


if __name__ == "__main__":
    with np.load(sys.argv[1]) as stored:
        given = dict(stored)
    states, seconds = run(given)
    np.savez(sys.argv[2], states=states, seconds=seconds)
