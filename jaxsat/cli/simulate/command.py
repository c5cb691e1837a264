"""`jaxsat simulate`: a session of telemetry with its truth, made from a configuration (the program `Orfs`)."""

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter, validators

from jaxsat.cli.shared.folders import default_folder
from jaxsat.cli.shared.options import ConfigFile, whole_number


def simulate(
    config: ConfigFile = None,
    /,
    *,
    seed: Annotated[
        int | None,
        Parameter(
            help="Seed of all noise. [default: that of the configuration]",
            converter=whole_number,
            validator=validators.Number(gte=0, lt=2**32),
        ),
    ] = None,
    out: Annotated[Path, Parameter(help="Directory for the results.")] = default_folder("simulate"),
    plots: Annotated[bool, Parameter(help="Draw pictures.")] = True,
) -> int:
    """Simulate a session: attitude motion, panel currents, telemetry with its noise, and the truth.

    The configuration is that of a fit, with a section [simulate] of its own;
    without it the nominal Munin of 2001-01-18 is simulated. Writes
    session.RAW_SUN and session.truth.json, angles.csv, currents.csv and
    limb.csv, currents.png and angles.png; where simulate.panel_corners_m
    describes panels of other outlines, also panels.csv.

    Exit status: 0 done, 1 bad input, 2 wrong usage.

    Example: jaxsat config > munin.toml && jaxsat simulate munin.toml --out sim
    && jaxsat fit sim/session.RAW_SUN --config munin.toml --limb sim/limb.csv
    """
    from jaxsat.cli.settings.files import load_config

    settings = load_config(config, {} if seed is None else {"simulate.seed": seed})
    if config is None:
        print("jaxsat: no configuration given: simulating the nominal Munin of 2001-01-18", file=sys.stderr)

    from jaxsat.cli.shared.terminal import show
    from jaxsat.files.staging import staged_directory
    from jaxsat.numerics import set_up_jax

    set_up_jax()
    from jaxsat.cli.simulate.text import simulation_summary
    from jaxsat.synthetic.files import FILES, write_simulation
    from jaxsat.synthetic.session import SessionPlan, make_session

    plan = SessionPlan(settings.simulate, settings.satellite, settings.given, settings.cleaning, file=config)

    with staged_directory(out, FILES) as stage:
        session = make_session(plan)
        write_simulation(stage, session, plan, plots=plots)
    show(simulation_summary(session, settings.simulate.satellite), f"\nresults in {out}")
    return 0
