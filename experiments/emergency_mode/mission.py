"""The emergency mode from its command to a year later (Somov 2018, section 5, figures 4 to 9).

Four orbits of transition from inertial rest, 11 deg off, with the corrected laws and with the printed ones; then
gravity alone to orbit 145, a month without and with the pressure of sunlight, and with --days 365 a year under the
supervisor that switches the actuator on at 1.5 deg. Prints numbers beside the paper's, writes JSON and pictures.

    .venv/bin/python experiments/emergency_mode/mission.py --days 31 --out out/emergency-mission
"""

import argparse
import json
import time
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

OFF_DEG, AXIS = 11.0, (1.0, 1.0, 1.0)
"""The paper gives the angle of the start and that the inertial rate is small; the axis is ours."""
ORBITS, LAST_ORBIT = 4, 145
PAPER = {"transition_orbits": 4, "growth_deg_day": 0.015, "month_deg": 0.85, "month_with_pressure_deg": 1.27}


def as_printed(torque_body, b_field_body, max_dipole):
    """What the printed forms do: the torque's opposite, and a duty test that never holds."""
    from jaxsat.control.magnetic_actuator import actuator_dipole

    return -actuator_dipole(torque_body, b_field_body, max_dipole, duty_cosine=1.0)


def angle_deg(samples) -> np.ndarray:
    """Size of the attitude error."""
    return np.degrees(np.linalg.norm(np.asarray(samples.error), axis=-1))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--days", type=float, default=31.0, help="of the mission after the transition")
    parser.add_argument("--out", type=Path, default=Path("out/emergency-mission"), help="directory for results")
    arguments = parser.parse_args()
    folder = arguments.out
    folder.mkdir(parents=True, exist_ok=True)

    from jaxsat.cli.numerics import set_up_jax

    set_up_jax()
    from jaxsat.control.emergency_law import EmergencyLaw
    from jaxsat.control.emergency_loop import ALWAYS_OFF, ALWAYS_ON, Supervisor, first_state
    from jaxsat.control.emergency_orbit import fly, leg, orbital_period
    from jaxsat.control.emergency_runs import QUIET, run_leg, run_years
    from jaxsat.control.emergency_vehicle import nominal_vehicle
    from jaxsat.control.magnetic_actuator import actuator_dipole
    from jaxsat.math import quaternion

    report: dict = {"paper": PAPER, "seconds": {}}

    def timed(name, run):
        began = time.perf_counter()
        found = jax.block_until_ready(run())
        report["seconds"][name] = time.perf_counter() - began
        return found

    flight = timed("orbit", lambda: fly(arguments.days + 1.0))
    orbit = round(orbital_period(flight) / 16.0)
    first = ORBITS * orbit // QUIET * QUIET
    around = leg(flight, 0, first)
    law, key = EmergencyLaw(), jax.random.key(0)
    axis = np.array(AXIS) / np.linalg.norm(AXIS)

    def transition(actuator):
        vehicle = nominal_vehicle()
        off = quaternion.from_rotation_vector(jnp.asarray(np.radians(OFF_DEG) * axis))
        start = first_state(around, off, jnp.zeros(3), vehicle)
        return eqx.filter_jit(run_leg)(law, ALWAYS_ON, vehicle, around, start, key, actuator=actuator)

    settled, samples = timed("transition", lambda: transition(actuator_dipole))
    _, wrong = transition(as_printed)
    error, printed = angle_deg(samples), angle_deg(wrong)
    below = np.flatnonzero(error > 1.0)[-1] / orbit
    report["transition"] = {
        "below_1_deg_after_orbits": float(below),
        "largest_in_last_orbit_deg": float(error[-orbit:].max()),
        "impulse_A_m2_s": float(settled.impulse),
        "as_printed_last_orbit_deg": float(printed[-orbit:].max()),
    }
    print(
        f"transition: below 1 deg for good after {below:.2f} orbits (paper 4), largest angle of the fourth "
        f"{error[-orbit:].max():.3f} deg; as printed {printed[-orbit:].max():.0f} deg"
    )
    transition_pictures(np.arange(1, first + 1) / orbit, samples, printed, folder)

    periods = int(arguments.days * 5400)
    runs = {}
    for name, surface, supervisor in (
        ("gravity alone", False, ALWAYS_OFF),
        ("with pressure", True, ALWAYS_OFF),
        ("with pressure, supervised", True, Supervisor()),
    ):
        vehicle = nominal_vehicle(surface=surface)
        began = time.perf_counter()
        tally = (jnp.asarray(False), jnp.asarray(0.0), jnp.asarray(0.0))
        begin = eqx.tree_at(lambda s: (s.active, s.activations, s.impulse), settled, tally)
        parts, state = [], begin
        for after, part in run_years(law, supervisor, vehicle, flight, begin, periods, first=first, key=key):
            state = after
            parts.append((angle_deg(part), np.degrees(part.error), np.degrees(part.tilt), part.active))
        angle, error, tilt, active = (np.concatenate(x) for x in zip(*parts, strict=True))
        days = 64.0 * np.arange(1, len(angle) + 1) / 86400.0
        daily = np.array([chunk.max() for chunk in np.array_split(angle, max(1, round(days[-1])))])
        month = daily[:30]
        growth = float(np.polyfit(np.arange(len(month)), month, 1)[0])
        episodes = lengths(active, 64.0 / (16.0 * orbit))
        runs[name] = {
            "days": float(days[-1]),
            "month_deg": float(month.max()),
            "growth_deg_day": growth,
            "largest_deg": float(angle.max()),
            "activations": int(state.activations),
            "longest_activation_orbits": float(max(episodes, default=0.0)),
            "impulse_A_m2_s": float(state.impulse),
            "seconds": time.perf_counter() - began,
        }
        found = runs[name]
        print(
            f"{name:26s} {found['days']:.0f} days: {found['month_deg']:.2f} deg in a month, growing by {growth:.4f} "
            f"deg/day, largest {found['largest_deg']:.2f} deg; {found['activations']} activations, the longest of "
            f"{found['longest_activation_orbits']:.1f} orbits, {found['impulse_A_m2_s']:.3g} A m2 s; "
            f"{found['seconds']:.1f} s",
            flush=True,
        )
        if name == "gravity alone":
            passive_pictures(days * 86400.0 / (16.0 * orbit) + ORBITS, error, tilt, folder)
        runs_picture(name, days, daily, folder)
    report["runs"] = runs
    (folder / "mission.json").write_text(json.dumps(report, indent=1))
    print("seconds:", ", ".join(f"{name} {value:.1f}" for name, value in report["seconds"].items()))


def lengths(active: np.ndarray, step: float) -> list[float]:
    """Lengths of the runs of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], active.astype(int), [0]])))
    return ((edges[1::2] - edges[::2]) * step).tolist()


def transition_pictures(orbits: np.ndarray, samples, printed: np.ndarray, folder: Path) -> None:
    from jaxsat.plotting import png_bytes
    from jaxsat.plotting.history import draw_history

    error, rate = np.degrees(samples.error), np.degrees(samples.rate_error)
    panels = {
        "angular errors, deg (figure 4)": dict(zip("xyz", error.T, strict=True)),
        "rates against the orbital axes, deg/s (figure 5)": dict(zip("xyz", rate.T, strict=True)),
        "angle of body y from the vertical, deg (figure 6)": {"": np.degrees(samples.tilt)},
        "dipoles, A m2": dict(zip("xyz", np.asarray(samples.dipole).T, strict=True)),
        "size of the error, deg, with the laws as printed": {"": printed},
    }
    figure = draw_history(orbits, panels, title="Transition into the orbital attitude", subtitle="against orbits")
    figure.axes[-1].set_xlabel("orbits")
    (folder / "figures_04_06.png").write_bytes(png_bytes(figure))


def passive_pictures(orbits: np.ndarray, error: np.ndarray, tilt: np.ndarray, folder: Path) -> None:
    from jaxsat.plotting import png_bytes
    from jaxsat.plotting.history import draw_history

    shown, last = orbits <= LAST_ORBIT, (orbits > LAST_ORBIT - 10) & (orbits <= LAST_ORBIT)
    panels = {
        "angular errors, deg (figure 7)": dict(zip("xyz", error[shown].T, strict=True)),
        "angle of body y from the vertical, deg (figure 8)": {"": tilt[shown]},
    }
    figure = draw_history(orbits[shown], panels, title="Gravity alone, to orbit 145", subtitle="against orbits")
    figure.axes[-1].set_xlabel("orbits")
    (folder / "figures_07_08.png").write_bytes(png_bytes(figure))
    panels = {"angle of body y from the vertical, deg (figure 9)": {"": tilt[last]}}
    figure = draw_history(orbits[last], panels, title="The last ten orbits", subtitle="against orbits")
    figure.axes[-1].set_xlabel("orbits")
    (folder / "figure_09.png").write_bytes(png_bytes(figure))


def runs_picture(name: str, days: np.ndarray, daily: np.ndarray, folder: Path) -> None:
    from jaxsat.plotting.style import dress, new_figure, png_bytes

    figure = new_figure(8.0, 3.6, f"Largest angle of each day: {name}", "size of the attitude error")
    axes = figure.add_axes((0.09, 0.15, 0.88, 0.64))
    axes.step(np.linspace(0.0, days[-1], len(daily)), daily, color="#2340a8", lw=1.2)
    axes.set(xlim=(0, days[-1]), ylim=(0, 1.1 * daily.max()))
    dress(axes, y_label="deg", x_label="days")
    (folder / f"days_{name.replace(', ', '_').replace(' ', '_')}.png").write_bytes(png_bytes(figure))


if __name__ == "__main__":
    main()
