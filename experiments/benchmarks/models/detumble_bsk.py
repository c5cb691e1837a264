"""A CubeSat that is detumbled by magnetorquers, built of Basilisk's own modules, run by its Monte Carlo controller.

Run by `detumble_basilisk.py` in an interpreter that has Basilisk: reads cases from one .npz file and writes how they
end, and the times, to another. Gravity gradient on an orbit of point-mass gravity, a centred dipole that does not turn,
perfect readings; the torque -k w by `mrpPD`, dipoles by `torque2Dipole` and `dipoleMapping`.
"""

import functools
import multiprocessing
import sys

import numpy as np
from Basilisk.architecture import bskLogging, messaging  # pyright: ignore[reportMissingImports]
from Basilisk.fswAlgorithms import (  # pyright: ignore[reportMissingImports]
    attTrackingError,
    dipoleMapping,
    inertial3D,
    mrpPD,
    tamComm,
    torque2Dipole,
)
from Basilisk.simulation import (  # pyright: ignore[reportMissingImports]
    GravityGradientEffector,
    MtbEffector,
    magneticFieldCenteredDipole,
    magnetometer,
    simpleNav,
    spacecraft,
)
from Basilisk.utilities import (  # pyright: ignore[reportMissingImports]
    SimulationBaseClass,
    macros,
    simIncludeGravBody,
)

from bsk_monte_carlo import begin, monte_carlo, number_of  # isort: skip

MASS_KG = 4.0


def create(case):
    """A simulation of one case."""
    bskLogging.setDefaultLogLevel(bskLogging.BSK_ERROR)
    sim = SimulationBaseClass.SimBaseClass()
    process = sim.CreateNewProcess("process")
    process.addTask(sim.CreateNewTask("dynamics", macros.sec2nano(float(case["step_s"]))), 2)
    process.addTask(sim.CreateNewTask("control", macros.sec2nano(float(case["period_s"]))), 1)

    sim.craft = spacecraft.Spacecraft()
    hub = sim.craft.hub
    hub.mHub, hub.IHubPntBc_B = MASS_KG, case["inertia"].tolist()
    gravity = simIncludeGravBody.gravBodyFactory()
    earth = gravity.createEarth()
    earth.isCentralBody, earth.mu = True, float(case["mu"])
    gravity.addBodiesTo(sim.craft)
    hub.r_CN_NInit, hub.v_CN_NInit = case["position"].tolist(), case["velocity"].tolist()
    gradient = GravityGradientEffector.GravityGradientEffector()
    gradient.addPlanetName(earth.planetName)
    sim.craft.addDynamicEffector(gradient)

    field = magneticFieldCenteredDipole.MagneticFieldCenteredDipole()
    field.planetRadius = float(case["radius"])
    field.g10, field.g11, field.h11 = case["dipole"].tolist()
    field.addSpacecraftToModel(sim.craft.scStateOutMsg)
    sensor, torquers = magnetometer.Magnetometer(), MtbEffector.MtbEffector()
    sensor.stateInMsg.subscribeTo(sim.craft.scStateOutMsg)
    sensor.magInMsg.subscribeTo(field.envOutMsgs[0])
    sim.craft.addDynamicEffector(torquers)

    axes, most = case["axes"], case["max_dipole"].tolist()
    layout = messaging.MTBArrayConfigMsgPayload()
    layout.numMTB, layout.maxMtbDipoles, layout.GtMatrix_B = len(most), most, axes.T.ravel().tolist()
    layout = messaging.MTBArrayConfigMsg().write(layout)
    law, commands, kept = _law(sim.craft, sensor, layout, case)
    for port, message in (
        ("mtbCmdInMsg", commands.dipoleRequestMtbOutMsg),
        ("magInMsg", field.envOutMsgs[0]),
        ("mtbParamsInMsg", layout),
    ):
        getattr(torquers, port).subscribeTo(message)

    # Effectors read what was told before the spacecraft moves; the field is that of where it has come to.
    for model, priority in ((gradient, 4), (torquers, 4), (sim.craft, 3), (field, 2)):
        sim.AddModelToTask("dynamics", model, priority)
    for place, model in enumerate(law):
        sim.AddModelToTask("control", model, 100 - place)
    # Basilisk points to what Python owns: it must outlive this function.
    sim.kept = (gravity, gradient, layout, kept)
    return sim


def _law(craft, sensor, layout, case):
    """The modules of the law in their order, the one with the commands, and what must be kept."""
    nav, still, error = simpleNav.SimpleNav(), inertial3D.inertial3D(), attTrackingError.attTrackingError()
    nav.scStateInMsg.subscribeTo(craft.scStateOutMsg)
    still.sigma_R0N = [0.0, 0.0, 0.0]
    error.attNavInMsg.subscribeTo(nav.attOutMsg)
    error.attRefInMsg.subscribeTo(still.attRefOutMsg)
    damping = mrpPD.mrpPD()
    damping.K, damping.P = 0.0, float(case["gain"])
    vehicle = messaging.VehicleConfigMsgPayload(ISCPntB_B=case["inertia"].ravel().tolist())
    vehicle = messaging.VehicleConfigMsg().write(vehicle)
    damping.guidInMsg.subscribeTo(error.attGuidOutMsg)
    damping.vehConfigInMsg.subscribeTo(vehicle)
    reading = tamComm.tamComm()
    reading.dcm_BS = np.eye(3).ravel().tolist()
    reading.tamInMsg.subscribeTo(sensor.tamDataOutMsg)
    dipole = torque2Dipole.torque2Dipole()
    dipole.tauRequestInMsg.subscribeTo(damping.cmdTorqueOutMsg)
    dipole.tamSensorBodyInMsg.subscribeTo(reading.tamOutMsg)
    mapping = dipoleMapping.dipoleMapping()
    mapping.steeringMatrix = case["axes"].ravel().tolist()
    mapping.dipoleRequestBodyInMsg.subscribeTo(dipole.dipoleRequestOutMsg)
    mapping.mtbArrayConfigParamsInMsg.subscribeTo(layout)
    return [sensor, nav, still, error, damping, reading, dipole, mapping], mapping, vehicle


def execute(case, sim, filename):
    """Run the case whose number the controller has put at the end of `filename`; write its rate beside it."""
    number = number_of(filename)
    begin(sim.craft.hub, case["quaternions"][number], case["rates"][number])
    sim.InitializeSimulation()
    sim.ConfigureStopTime(macros.sec2nano(float(case["duration_s"])))
    sim.ExecuteSimulation()
    np.save(filename, np.array(sim.craft.scStateOutMsg.read().omega_BN_B))


def main() -> None:
    with np.load(sys.argv[1]) as stored:
        case = dict(stored)
    multiprocessing.set_start_method("fork", force=True)
    making, running = functools.partial(create, case), functools.partial(execute, case)
    count = len(case["rates"])
    monte_carlo(making, running, 2, int(case["workers"]))
    found = [monte_carlo(making, running, count, int(case["workers"])) for _ in range(int(case["repeats"]))]
    wall, used, rates = min(found, key=lambda each: each[0])
    np.savez(sys.argv[2], rates=rates, wall=wall, used=used)


if __name__ == "__main__":
    main()
