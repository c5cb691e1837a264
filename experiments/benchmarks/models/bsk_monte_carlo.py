"""Cases of a simulation of Basilisk's by its own Monte Carlo controller, timed.

Its process must not have started JAX: the controller forks.
"""

import os
import tempfile
import time
from pathlib import Path

import numpy as np
from Basilisk.utilities.MonteCarlo.Controller import Controller  # pyright: ignore[reportMissingImports]


def monte_carlo(creating, executing, cases: int, workers: int):
    """Wall and processor time [s] of all cases, and what each has written, one after the other.

    `creating()` makes a simulation; `executing(simulation, filename)` runs the case of `number_of(filename)` and writes
    an array to `filename` and `.npy`. `workers` 0 runs the cases in this process without the controller.
    """
    with tempfile.TemporaryDirectory() as folder:
        archive = Path(folder) / "archive"
        if workers == 0:
            archive.mkdir()
            began, used = time.perf_counter(), _processor_s()
            for case in range(cases):
                executing(creating(), str(archive / f"run{case}"))
            wall, used = time.perf_counter() - began, _processor_s() - used
        else:
            controller = Controller()
            controller.setSimulationFunction(creating)
            controller.setExecutionFunction(executing)
            controller.setExecutionCount(cases)
            controller.setThreadCount(workers)
            controller.setArchiveDir(str(archive))
            began, used = time.perf_counter(), _processor_s()
            # No retention policy: with one, the controller sleeps for a second after each case.
            failed = controller.executeSimulations()
            wall, used = time.perf_counter() - began, _processor_s() - used
            if failed:
                raise RuntimeError(f"Basilisk: {len(failed)} of {cases} cases did not run")
        return wall, used, np.array([np.load(archive / f"run{case}.npy") for case in range(cases)])


def number_of(filename: str) -> int:
    """The case that the controller has put at the end of a file's name."""
    return int(Path(filename).name.removeprefix("run"))


def begin(hub, q, w) -> None:
    """Sets attitude (inertial from body, scalar first) and body rate [rad/s] of a hub's start."""
    # The rotation -q is q's, with the MRPs of the shorter turn.
    q = np.copysign(1.0, q[0]) * q
    hub.sigma_BNInit = (q[1:] / (1.0 + q[0]))[:, None].tolist()
    hub.omega_BN_BInit = w[:, None].tolist()


def _processor_s() -> float:
    """Of this process and of those that it has waited for."""
    return sum(os.times()[:4])
