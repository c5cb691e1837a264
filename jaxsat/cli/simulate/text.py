"""What the terminal shows of a simulated session."""

from typing import TYPE_CHECKING

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from jaxsat.cli.shared.terminal import plain_table

if TYPE_CHECKING:
    from jaxsat.synthetic.session import SimulatedSession


def simulation_summary(session: "SimulatedSession", name: str) -> RenderableType:
    """Returns what was simulated, in a few lines."""
    truth = session.truth
    lit = np.asarray(truth.illumination) > 0.5
    header = Text.assemble(
        (name, "bold"),
        f": {len(truth.t)} samples, {int(lit.sum())} lit, t = 0 to {truth.t[-1]:g} s, epoch {session.epoch.iso(3)} UTC",
    )
    table = plain_table("over the session", "least", "median", "most", right=(1, 2, 3))
    rows = {
        "body x from the field, deg": np.degrees(truth.sun_magnetic[:, 0]),
        "body x from the limb, deg": np.degrees(truth.limb[:, 0]),
        "angular rate, deg/s": np.degrees(np.linalg.norm(truth.angular_velocity, axis=1)),
        "sum of currents, mA": session.telemetered_mA.sum(axis=1),
    }
    for name, values in rows.items():
        table.add_row(name, *(f"{x:.2f}" for x in np.percentile(values, [0, 50, 100])))
    return Group(header, table, Text(f"attitude integrated to {truth.error:.1e} rad"))
