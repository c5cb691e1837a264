"""What the terminal shows of simulated sessions."""

from typing import TYPE_CHECKING

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from jaxsat.cli.shared.terminal import plain_table

if TYPE_CHECKING:
    from jaxsat.synthetic.session import SimulatedSession
    from jaxsat.synthetic.twins import Twin


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


def twin_summary(twin: "Twin") -> RenderableType:
    """Returns what was simulated of a satellite with sensors of its own: its channels, and how well it was done."""
    rate = np.degrees(np.linalg.norm(twin.motion.angular_velocity, axis=1))
    header = Text.assemble(
        (twin.satellite.name, "bold"),
        f": t = 0 to {twin.settings.duration_s:g} s, epoch {twin.epoch.iso(3)} UTC, "
        f"{rate.min():.2f} to {rate.max():.2f} deg/s",
    )
    table = plain_table("channel", "readings", "least", "median", "most", "unit", right=(1, 2, 3, 4))
    for name, each in twin.channels.items():
        shown = (f"{x:.5g}" for x in np.percentile(each.values, [0, 50, 100])) if each.values.size else ("", "", "")
        table.add_row(name, str(len(each.values)), *shown, twin.satellite.channels[name].unit)
    drawn = 0 if twin.settings.nominal else sum(leaf.sigma is not None for leaf in twin.satellite.leaves)
    return Group(
        header, table, Text(f"{drawn} numbers drawn from their priors; attitude to {twin.motion.error:.1e} rad")
    )
