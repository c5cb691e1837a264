"""Sun pointing built of Basilisk's own modules, run by its Monte Carlo controller.

Four coarse Sun sensors see about the hemisphere that our sensor sees; least squares, a search rotation while none is
lit, MRP feedback. The control period is 1 s. Its process must not have started JAX: the controller forks.
"""

import functools

import numpy as np
from Basilisk.architecture import bskLogging, messaging  # pyright: ignore[reportMissingImports]
from Basilisk.fswAlgorithms import (  # pyright: ignore[reportMissingImports]
    cssWlsEst,
    mrpFeedback,
    sunSafePoint,
    thrFiringSchmitt,
    thrForceMapping,
)
from Basilisk.simulation import (  # pyright: ignore[reportMissingImports]
    coarseSunSensor,
    extForceTorque,
    simpleNav,
    spacecraft,
    thrusterDynamicEffector,
)
from Basilisk.utilities import (  # pyright: ignore[reportMissingImports]
    RigidBodyKinematics,
    SimulationBaseClass,
    macros,
    simIncludeThruster,
)
from models.bsk_monte_carlo import begin, monte_carlo, number_of

MASS_KG, AU_M = 1000.0, 149_597_870_693.0
PERIOD_S, THRUSTER_STEP_S = 1.0, 0.1
"""Dynamics run at the control period, or at the shorter step where thrusters are switched within it."""
ELEVATION_RAD, HALF_VIEW_RAD = np.pi / 4.0, np.pi / 3.0
"""Basilisk's own defaults for a pyramid of coarse Sun sensors: lit by the Sun within some 90 deg of its axis."""
SEARCH_RATE_RAD_S = np.radians(0.5)
ATTITUDE_GAIN_N_M, RATE_GAIN_N_M_S = 20.0, 160.0
"""Near critical damping at 0.08 rad/s; the thrusters of the vehicle saturate in large turns and can still brake."""


def create(inertia, mounting, thruster: tuple[float, float, float] | None):
    """A simulation of one case; `thruster`: thrust [N], lever [m], shortest firing [s], or None for ideal torques.

    `inertia` [kg m^2] and `mounting` (body from instrument) are matrices, 3 by 3.
    """
    bskLogging.setDefaultLogLevel(bskLogging.BSK_ERROR)
    sim = SimulationBaseClass.SimBaseClass()
    process = sim.CreateNewProcess("process")
    process.addTask(sim.CreateNewTask("dynamics", macros.sec2nano(THRUSTER_STEP_S if thruster else PERIOD_S)), 2)
    process.addTask(sim.CreateNewTask("control", macros.sec2nano(PERIOD_S)), 1)

    sim.craft = spacecraft.Spacecraft()
    sim.craft.hub.mHub = MASS_KG
    sim.craft.hub.IHubPntBc_B = inertia.tolist()
    sun = messaging.SpicePlanetStateMsg().write(messaging.SpicePlanetStateMsgPayload(PositionVector=[AU_M, 0.0, 0.0]))
    vehicle = messaging.VehicleConfigMsg().write(messaging.VehicleConfigMsgPayload(ISCPntB_B=inertia.ravel().tolist()))

    gyro = simpleNav.SimpleNav()
    gyro.scStateInMsg.subscribeTo(sim.craft.scStateOutMsg)
    cells, sensors, layout = _sun_sensors(sim.craft, sun, mounting)

    estimate = cssWlsEst.cssWlsEst()
    estimate.sensorUseThresh = 0.01
    estimate.cssDataInMsg.subscribeTo(cells.constellationOutMsg)
    estimate.cssConfigInMsg.subscribeTo(layout)

    guidance = sunSafePoint.sunSafePoint()
    guidance.sHatBdyCmd = mounting[:, 0].tolist()
    guidance.omega_RN_B = (SEARCH_RATE_RAD_S * mounting[:, 1]).tolist()
    guidance.minUnitMag, guidance.smallAngle = 0.1, 1e-3
    guidance.sunDirectionInMsg.subscribeTo(estimate.navStateOutMsg)
    guidance.imuInMsg.subscribeTo(gyro.attOutMsg)

    feedback = mrpFeedback.mrpFeedback()
    feedback.K, feedback.P, feedback.Ki = ATTITUDE_GAIN_N_M, RATE_GAIN_N_M_S, -1.0
    feedback.guidInMsg.subscribeTo(guidance.attGuidanceOutMsg)
    feedback.vehConfigInMsg.subscribeTo(vehicle)

    control = [cells, estimate, guidance, feedback]
    if thruster is None:
        actuator = extForceTorque.ExtForceTorque()
        actuator.cmdTorqueInMsg.subscribeTo(feedback.cmdTorqueOutMsg)
        sim.craft.addDynamicEffector(actuator)
        kept = ()
    else:
        actuator, firing, kept = _thrusters(sim.craft, feedback, vehicle, *thruster)
        control += firing
    # The actuator reads its command before the spacecraft moves.
    for model in (actuator, sim.craft, gyro):
        sim.AddModelToTask("dynamics", model)
    for model in control:
        sim.AddModelToTask("control", model)
    # Basilisk points to what Python owns: it must outlive this function.
    sim.kept = (sun, vehicle, layout, sensors, kept)
    return sim


def _sun_sensors(craft, sun, mounting):
    """The constellation, its cells, and the message of where they look."""
    s, c = np.sin(ELEVATION_RAD), np.cos(ELEVATION_RAD)
    normals = np.array([[s, 0.0, c], [s, 0.0, -c], [s, c, 0.0], [s, -c, 0.0]]) @ mounting.T
    cells, layout = coarseSunSensor.CSSConstellation(), messaging.CSSConfigMsgPayload()
    sensors, units = [], []
    for normal in normals:
        cell = coarseSunSensor.CoarseSunSensor()
        cell.nHat_B, cell.fov = normal.tolist(), HALF_VIEW_RAD
        cell.sunInMsg.subscribeTo(sun)
        cell.stateInMsg.subscribeTo(craft.scStateOutMsg)
        sensors.append(cell)
        units.append(messaging.CSSUnitConfigMsgPayload(nHat_B=normal.tolist(), CBias=1.0))
    cells.sensorList = coarseSunSensor.CSSVector(sensors)
    layout.nCSS, layout.cssVals = len(units), units
    return cells, sensors, messaging.CSSConfigMsg().write(layout)


def _thrusters(craft, feedback, vehicle, thrust: float, lever: float, min_pulse: float):
    """Pairs for both senses about each axis: the effector, what commands it, what must be kept."""
    factory = simIncludeThruster.thrusterFactory()
    axes = np.eye(3)
    for k in range(3):
        arm, push = axes[(k + 1) % 3], axes[(k + 2) % 3]
        for sense in (1.0, -1.0):
            for side in (1.0, -1.0):
                factory.create("Blank_Thruster", lever * side * arm, sense * side * push, MaxThrust=thrust)
    effector = thrusterDynamicEffector.ThrusterDynamicEffector()
    factory.addToSpacecraft("thrusters", effector, craft)
    layout = factory.getConfigMessage()

    mapping = thrForceMapping.thrForceMapping()
    mapping.controlAxes_B, mapping.thrForceSign = np.eye(3).ravel().tolist(), 1
    mapping.cmdTorqueInMsg.subscribeTo(feedback.cmdTorqueOutMsg)
    mapping.thrConfigInMsg.subscribeTo(layout)
    mapping.vehConfigInMsg.subscribeTo(vehicle)

    firing = thrFiringSchmitt.thrFiringSchmitt()
    firing.thrMinFireTime, firing.level_on, firing.level_off = min_pulse, 0.75, 0.25
    firing.thrConfInMsg.subscribeTo(layout)
    firing.thrForceInMsg.subscribeTo(mapping.thrForceCmdOutMsg)
    effector.cmdsInMsg.subscribeTo(firing.onTimeOutMsg)
    return effector, [mapping, firing], (layout, factory)


def execute(quaternions, rates, seconds, sim, filename):
    """Run the case whose number the controller has put at the end of `filename`; write where it ends beside it."""
    case = number_of(filename)
    begin(sim.craft.hub, quaternions[case], rates[case])
    sim.InitializeSimulation()
    sim.ConfigureStopTime(macros.sec2nano(seconds))
    sim.ExecuteSimulation()
    np.save(filename, np.array(sim.craft.scStateOutMsg.read().sigma_BN))


def run(quaternions, rates, inertia, mounting, thruster, *, periods: int, workers: int):
    """Wall and processor time [s] of all cases, and the angle between Sun and sensor axis at the end of each [deg].

    `quaternions` (inertial from body, scalar first) and body `rates` [rad/s] have one row a case; `workers` 0 runs the
    cases in this process without the controller.
    """
    executing = functools.partial(execute, quaternions, rates, periods * PERIOD_S)
    creating = functools.partial(create, inertia, mounting, thruster)
    wall, used, ends = monte_carlo(creating, executing, len(rates), workers)
    sun_body = np.array([RigidBodyKinematics.MRP2C(sigma)[:, 0] for sigma in ends])
    return wall, used, np.degrees(np.arccos(np.clip(sun_body @ mounting[:, 0], -1.0, 1.0)))
