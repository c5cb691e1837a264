"""What each assumption about the emergency mode does to its results (Somov 2018 leaves them open).

The list of assumptions stands in `jaxsat.control.emergency_mode.vehicle`. One at a time is changed: the transition of
four orbits, then a month of gravity alone and one with the pressure of sunlight. Before it, the sizes of the torques,
of those left out too, by orders of magnitude. Prints both tables and writes them as JSON.

    .venv/bin/python experiments/emergency_mode/assumptions.py --days 28 --out out/emergency-assumptions
"""

import argparse
import dataclasses
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

if TYPE_CHECKING:
    from jaxsat.control.emergency_mode.law import EmergencyLaw
    from jaxsat.control.emergency_mode.orbit import Flight
    from jaxsat.control.emergency_mode.rotating_panels import PanelAngle
    from jaxsat.control.emergency_mode.vehicle import EmergencyVehicle

OFF_DEG, ORBITS = 11.0, 4
OTHER_START = (2018, 6, 13)
FIRST_GUESS = (1e-6, 2e-3, 1e-6, 2e-3, 0.8)
"""Gains from which `gains.py` begins."""
AIR_KG_M3, DRAG = 2e-14, 2.2
"""At 720 km while the Sun is quiet; ten times that when it is not."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--days", type=float, default=28.0, help="of gravity alone, and with pressure")
    parser.add_argument("--out", type=Path, default=Path("out/emergency-assumptions"), help="directory for results")
    arguments = parser.parse_args()
    if not 2.0 <= arguments.days <= 366.0:
        parser.error(f"--days must be from 2 to 366, got {arguments.days:g}")
    arguments.out.mkdir(parents=True, exist_ok=True)

    from jaxsat.numerics import set_up_jax

    set_up_jax()
    from jaxsat.control.emergency_mode.law import EmergencyLaw
    from jaxsat.control.emergency_mode.orbit import SunFollowing, fly
    from jaxsat.control.emergency_mode.vehicle import BUS_MIRROR, PRESSURE_CENTRE_M, nominal_vehicle, outer_surface

    sizes = torques()
    for name, (value, modelled) in sizes.items():
        print(f"{value:9.2e} N m  {'':8s}" if modelled else f"{value:9.2e} N m  left out", name)
    print(
        f"\n{'changed':58s}{'below 1 deg':>13s}{'4th orbit':>11s}{'gravity':>10s}{'pressure':>10s}{'growth':>9s}"
        f"\n{'':58s}{'orbits':>13s}{'deg':>11s}{'deg':>10s}{'deg':>10s}{'deg/day':>9s}"
    )
    flight = fly(arguments.days + 1.0)
    base = Case(flight, EmergencyLaw(), nominal_vehicle(surface=True))
    change = dataclasses.replace

    def surface(**given):
        return change(base, vehicle=change(base.vehicle, facets=outer_surface(**given)), same_until_pressure=True)

    def noise(factor):
        return change(base, vehicle=change(base.vehicle, sigmas=factor * base.vehicle.sigmas))

    cases = {
        "nothing: 14 October 2018": base,
        "bus's middle at the centre of mass": surface(pressure_centre_m=0.0),
        f"{2 * PRESSURE_CENTRE_M:g} m over it instead of {PRESSURE_CENTRE_M:g}": surface(
            pressure_centre_m=2 * PRESSURE_CENTRE_M
        ),
        f"{4 * PRESSURE_CENTRE_M:g} m over it": surface(pressure_centre_m=4 * PRESSURE_CENTRE_M),
        "panels twice as large": surface(panel_share=2.0),
        f"bus reflects {2 * BUS_MIRROR:g} as a mirror instead of {BUS_MIRROR:g}": surface(mirror=2 * BUS_MIRROR),
        "13 June 2018": change(base, flight=fly(arguments.days + 1.0, start_utc=OTHER_START)),
        "orbit without Sun and Moon": change(base, flight=fly(arguments.days + 1.0, bodies=False)),
        "orbit with J2 alone": change(base, flight=fly(arguments.days + 1.0, degree=2, bodies=False)),
        "begun where the orbital attitude goes away": change(base, side="going"),
        "gains of the first guess": change(base, law=EmergencyLaw(*FIRST_GUESS)),
        "no noise": noise(0.0),
        "noise of one measurement, not of the mean of 16": noise(4.0),
        "panels after the Sun, once an orbit": change(base, panels=SunFollowing(flight)),
    }
    rows, study = {}, Study(arguments.days)
    for name, case in cases.items():
        rows[name] = row = study.results(case)
        print(
            f"{name:58s}{row['below_1_deg_orbits']:13.2f}{row['fourth_orbit_deg']:11.3f}{row['gravity_deg']:10.2f}"
            f"{row['pressure_deg']:10.2f}{row['growth_deg_day']:9.4f}",
            flush=True,
        )
    torque_rows = {name: {"N_m": value, "modelled": modelled} for name, (value, modelled) in sizes.items()}
    report = {
        "schema": "jaxsat.emergency-assumptions/1",
        "days": arguments.days,
        "torques": torque_rows,
        "results": rows,
    }
    (arguments.out / "assumptions.json").write_text(json.dumps(report, indent=1))


@dataclasses.dataclass(frozen=True)
class Case:
    """What is flown."""

    flight: "Flight"
    law: "EmergencyLaw"
    vehicle: "EmergencyVehicle"
    side: Literal["coming", "going"] = "coming"
    panels: "PanelAngle | None" = None
    same_until_pressure: bool = False
    """Whether the transition and the month of gravity alone are those of the case before."""


class Study:
    """Runs cases one after another."""

    def __init__(self, days: float):
        self.days = days
        self.simulate = None
        self.settled: tuple = ()
        self.known: dict[str, float] = {}

    def results(self, case: Case) -> dict[str, float]:
        """Transition, and largest angles of both months."""
        bare = dataclasses.replace(case.vehicle, facets=None)
        if not case.same_until_pressure:
            self.known = self._transition(case, bare)
            self.known["gravity_deg"] = float(self._daily(case, bare).max())
        daily = self._daily(case, case.vehicle)
        growth = float(np.polyfit(np.arange(len(daily)), daily, 1)[0])
        return self.known | {"pressure_deg": float(daily.max()), "growth_deg_day": growth}

    def _transition(self, case: Case, vehicle: "EmergencyVehicle") -> dict[str, float]:
        from jaxsat.control.emergency_mode.cases import run_leg
        from jaxsat.control.emergency_mode.loop import ALWAYS_ON, first_state
        from jaxsat.control.emergency_mode.orbit import leg, orbital_period
        from jaxsat.control.emergency_mode.start import transition_start
        from jaxsat.control.emergency_mode.vehicle import CONTROL_PERIOD_S

        self.simulate = self.simulate or eqx.filter_jit(run_leg)
        orbit = round(orbital_period(case.flight) / CONTROL_PERIOD_S)
        begin, off, rate = transition_start(case.flight, OFF_DEG, case.side)
        around = leg(case.flight, begin, ORBITS * orbit, panels=case.panels)
        start = first_state(around, off, rate, vehicle)
        state, samples = self.simulate(ALWAYS_ON, case.law, vehicle, around, start, jax.random.key(0))
        self.settled = eqx.tree_at(lambda s: s.active, state, jnp.asarray(False)), begin + ORBITS * orbit
        error = angle_deg(samples)
        return {
            "below_1_deg_orbits": float((np.flatnonzero(error > 1.0)[-1] + 1) / orbit),
            "fourth_orbit_deg": float(error[-orbit:].max()),
            "impulse_A_m2_s": float(state.impulse),
        }

    def _daily(self, case: Case, vehicle: "EmergencyVehicle") -> np.ndarray:
        """Largest angle of each day without control [deg]."""
        from jaxsat.control.emergency_mode.loop import ALWAYS_OFF
        from jaxsat.control.emergency_mode.years import run_years

        state, first = self.settled
        periods = int(self.days * 5400)
        run = run_years(ALWAYS_OFF, case.law, vehicle, case.flight, state, periods, first=first, panels=case.panels)
        return np.array([angle_deg(samples).max() for _, samples in run])


def angle_deg(samples) -> np.ndarray:
    """Size of the attitude error."""
    return np.degrees(np.linalg.norm(np.asarray(samples.error), axis=-1))


def torques() -> dict[str, tuple[float, bool]]:
    """Sizes [N m], and whether they are modelled."""
    from jaxsat.constants import AU, EARTH_EQUATORIAL_RADIUS, EARTH_MU
    from jaxsat.control.emergency_mode.vehicle import BODY_M, HEIGHT_KM, INERTIA_KG_M2, PRESSURE_CENTRE_M, outer_surface
    from jaxsat.environment import MOON_MU, SUN_MU
    from jaxsat.torques import solar_pressure_torque

    moments = np.diag(INERTIA_KG_M2)
    most, r = float(np.ptp(moments)), EARTH_EQUATORIAL_RADIUS + 1e3 * HEIGHT_KM
    n2 = EARTH_MU / r**3
    cone, turn = math.radians(62.0), np.linspace(0.0, 2.0 * np.pi, 200)
    suns = np.stack([np.full(200, np.cos(cone)), np.sin(cone) * np.cos(turn), np.sin(cone) * np.sin(turn)], axis=1)
    pressure = jax.vmap(lambda s: solar_pressure_torque(outer_surface(), s, jnp.asarray(4.56e-6)))(jnp.asarray(suns))
    air = AIR_KG_M3 * EARTH_MU / r / 2.0 * DRAG * BODY_M[0] * BODY_M[1] * PRESSURE_CENTRE_M
    return {
        "gravity gradient, pitch, 1 deg off": (
            3.0 * n2 * (moments[2] - moments[1]) * math.sin(math.radians(1.0)),
            True,
        ),
        "eccentricity of 0.001, pitch": (2e-3 * n2 * moments[0], True),
        "pressure of sunlight, surface as assumed": (float(np.linalg.norm(pressure, axis=1).max()), True),
        "coils at 300 A m2 in 30 uT": (300.0 * 3e-5, True),
        "gravity gradient of the Earth's oblateness": (
            3.0 * n2 * most * 2.0 * 1.0826e-3 * (6378.137e3 / r) ** 2,
            False,
        ),
        "gravity gradient of the Sun, at most": (1.5 * SUN_MU / AU**3 * most, False),
        "gravity gradient of the Moon at 356 500 km, at most": (1.5 * MOON_MU / 3.565e8**3 * most, False),
        f"air of {AIR_KG_M3:g} kg/m3, on the arm of the pressure": (air, False),
        "each A m2 of residual dipole, in 40 uT": (4e-5, False),
    }


if __name__ == "__main__":
    main()
