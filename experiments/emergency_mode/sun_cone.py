"""The Sun in orbital axes through a year (Somov 2018, section 3, figures 2 and 3), and how fast the node moves.

The orbit of 720 km is integrated with gravity to degree 8, Sun and Moon. In orbital axes (x along the flight, y up, z
against the orbit's normal) the Sun goes round a cone about z once a turn; its half-angle changes over the year. Prints
the angles and the mean energy factor beside the paper's, the node's rate by several models of gravity, what simpler
Suns over a plane that turns steadily give, and writes JSON and two pictures.

    .venv/bin/python experiments/emergency_mode/sun_cone.py --out out/sun-cone
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np

DAYS, EVERY_S = 365.25, 6 * 3600.0
NODE_DAYS = 20.0
SHOWN_DAYS = (0, 91, 183, 274)
"""Days whose turns are drawn in figure 2."""
PAPER = {
    "node_rate_deg_day": 0.9889,
    "cone_deg": {"February to September": 60.0, "October to January": 65.0},
    "factor": 0.4695,
}
SUNS = {  # equation of the centre, obliquity
    "true Sun": (True, True),
    "mean Sun of the ecliptic": (False, True),
    "true longitude on the equator": (True, False),
    "mean Sun on the equator": (False, False),
}
NODES_DEG_DAY = (0.985647, 0.9889)
"""Of a Sun-synchronous orbit, and the paper's."""
STARTS_UTC = ((2018, 10, 14), (2018, 6, 13))
MODELS = {  # degree of the field, Sun and Moon, argument of latitude at the start [deg]
    "J2 alone": (2, False, 0.0),
    "degree 8": (8, False, 0.0),
    "degree 8, Sun, Moon": (8, True, 0.0),
    "the same from u = 90 deg": (8, True, 90.0),
}


def node_rate_deg_day(flight, days: float) -> float:
    """Mean rate of the ascending node, by a line through its longitude every six hours."""
    position, velocity = (np.asarray(x) for x in (flight.orbit.position_eci, flight.orbit.velocity_eci))
    momentum = np.cross(position, velocity)
    node = np.unwrap(np.arctan2(momentum[:, 0], -momentum[:, 1]))
    t = np.linspace(0.0, days, len(node))
    return float(np.degrees(np.polyfit(t, node, 1)[0]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/sun-cone"), help="directory for results")
    folder = parser.parse_args().out
    folder.mkdir(parents=True, exist_ok=True)

    from jaxsat.numerics import set_up_jax

    set_up_jax()
    import jax

    from jaxsat.control.emergency_mode.orbit import fly
    from jaxsat.control.emergency_mode.vehicle import START_UTC
    from jaxsat.time import Epoch

    rates = {}
    for name, (degree, bodies, latitude) in MODELS.items():
        flight = fly(NODE_DAYS, degree=degree, bodies=bodies, argument_of_latitude_deg=latitude)
        rates[name] = node_rate_deg_day(flight, NODE_DAYS)
        print(
            f"node, {name:26s} {rates[name]:.5f} deg/day over {NODE_DAYS:g} days (paper {PAPER['node_rate_deg_day']})"
        )

    began = time.perf_counter()
    flight = fly(DAYS)
    jax.block_until_ready(flight.orbit.position_eci)
    seconds = time.perf_counter() - began
    t = np.arange(0.0, DAYS * 86400.0, EVERY_S)
    sun = sun_orbital(flight, t)
    cone = np.degrees(np.arccos(sun[:, 2]))
    steady = steady_cone_deg(flight.sun, t)
    rates["a year"] = node_rate_deg_day(flight, DAYS)
    print(
        f"node over the whole year: {rates['a year']:.5f} deg/day; a node that moves by the paper's steady "
        f"0.9889 on a fixed inclination gives {steady.min():.2f} to {steady.max():.2f} deg, mean {steady.mean():.2f}, "
        f"factor {np.cos(np.radians(steady)).mean():.5f}"
    )
    epoch = Epoch.from_utc(*START_UTC)
    months = np.array([int(epoch.shifted(float(x)).iso(0)[5:7]) for x in t])
    summer = (months >= 2) & (months <= 9)
    means = {"February to September": float(cone[summer].mean()), "October to January": float(cone[~summer].mean())}
    factor = float(np.cos(np.radians(cone)).mean())
    for name, value in means.items():
        print(f"cone's half-angle, {name:22s} mean {value:.2f} deg (paper {PAPER['cone_deg'][name]:g})")
    print(
        f"over the year {cone.min():.2f} to {cone.max():.2f} deg, mean {cone.mean():.2f}, energy factor {factor:.5f} "
        f"(paper {PAPER['factor']}); orbit of a year in {seconds:.0f} s"
    )

    suns = simple_suns()
    for row in suns:
        print(
            f"{row['start']}, {row['sun']:30s} node {row['node_deg_day']:.6f} deg/day: {row['range_deg'][0]:.2f} to "
            f"{row['range_deg'][1]:.2f} deg, mean {row['mean_deg']:.2f}, factor {row['factor']:.5f}"
        )

    turns = {f"day {day}": sun_orbital(flight, day * 86400.0 + np.linspace(0.0, 5950.0, 200)) for day in SHOWN_DAYS}
    figures(t / 86400.0, cone, steady, turns, folder)
    within = {name: float(np.degrees(np.ptp(np.arccos(path[:, 2])))) for name, path in turns.items()}
    report = {"node_deg_day": rates, "cone_deg": means, "range_deg": [cone.min(), cone.max()], "mean_deg": cone.mean()}
    report |= {"factor": factor, "within_a_turn_deg": within, "paper": PAPER, "orbit_s": seconds}
    report |= {"schema": "jaxsat.emergency-sun-cone/1", "simple_suns": suns}
    (folder / "sun_cone.json").write_text(json.dumps(report, indent=1))


def sun_orbital(flight, t_s: np.ndarray) -> np.ndarray:
    """Unit vectors to the Sun in orbital axes at some times [s]."""
    import jax

    position, velocity = (np.asarray(x) for x in jax.jit(jax.vmap(flight.orbit))(t_s))
    to_sun = np.asarray(jax.jit(jax.vmap(lambda t: flight.sun(t)[0]))(t_s))
    up = position / np.linalg.norm(position, axis=1)[:, None]
    normal = np.cross(position, velocity)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    sun = to_sun / np.linalg.norm(to_sun, axis=1)[:, None]
    axes = np.stack([np.cross(normal, up), up, -normal], axis=1)
    return np.einsum("tij,tj->ti", axes, sun)


def steady_cone_deg(sun, t_s: np.ndarray) -> np.ndarray:
    """Half-angle of the cone for a plane that keeps its inclination and turns at the paper's rate."""
    import jax

    to_sun = np.asarray(jax.jit(jax.vmap(lambda t: sun(t)[0]))(t_s))
    return cone_deg(to_sun / np.linalg.norm(to_sun, axis=1)[:, None], t_s, PAPER["node_rate_deg_day"])


def cone_deg(sun: np.ndarray, t_s: np.ndarray, node_deg_day: float) -> np.ndarray:
    """Angle of unit vectors [time, 3] from the antinormal of a plane that turns steadily."""
    from jaxsat.control.emergency_mode.vehicle import INCLINATION_DEG, NODE_DEG

    node = np.radians(NODE_DEG + node_deg_day * t_s / 86400.0)
    i = np.radians(INCLINATION_DEG)
    normal = np.stack([np.sin(i) * np.sin(node), -np.sin(i) * np.cos(node), np.full_like(node, np.cos(i))], axis=1)
    return np.degrees(np.arccos(-np.sum(normal * sun, axis=1)))


def simple_suns() -> list[dict]:
    """The year by simpler Suns (Meeus 1998, chapter 25, lower accuracy: 0.01 deg), from two dates, at two rates."""
    from jaxsat.time import Epoch

    t = np.arange(0.0, DAYS * 86400.0, EVERY_S)
    rows = []
    for start in STARTS_UTC:
        centuries = Epoch.from_utc(*start).tt_centuries() + t / (86400.0 * 36525.0)
        mean, anomaly = np.radians([[280.46646], [357.52911]] + np.array([[36000.76983], [35999.05029]]) * centuries)
        for name, (centre, oblique) in SUNS.items():
            equation = np.radians(1.914602 * np.sin(anomaly) + 0.019993 * np.sin(2.0 * anomaly))
            longitude = mean + (equation if centre else 0.0)
            tilt = np.radians(23.4393) if oblique else 0.0
            sun = [np.cos(longitude), np.cos(tilt) * np.sin(longitude), np.sin(tilt) * np.sin(longitude)]
            for rate in NODES_DEG_DAY:
                cone = cone_deg(np.stack(sun, axis=1), t, rate)
                row = {"start": "{}-{:02d}-{:02d}".format(*start), "sun": name, "node_deg_day": rate}
                row |= {"range_deg": [cone.min(), cone.max()], "mean_deg": cone.mean()}
                rows.append(row | {"factor": np.cos(np.radians(cone)).mean()})
    return rows


def figures(days: np.ndarray, cone: np.ndarray, steady: np.ndarray, turns: dict[str, np.ndarray], folder: Path) -> None:
    from jaxsat.plotting.style import dress, new_figure, png_bytes

    figure = new_figure(6.4, 6.2, "Figure 2: the Sun in orbital axes", "over one turn, on four days of the year")
    axes = figure.add_axes((0.08, 0.06, 0.86, 0.8), projection="3d")
    for (name, path), colour in zip(turns.items(), ("#2340a8", "#8a4b20", "#2e8b3d", "#b0413e"), strict=True):
        axes.plot(*path.T, color=colour, lw=1.4, label=name)
        axes.plot(*np.stack([np.zeros(3), path[0]]).T, color=colour, lw=0.8)
    axes.plot([0, 0], [0, 0], [0, 1], color="k", lw=1.0)
    axes.set(xlabel="x, flight", ylabel="y, up", zlabel="z, against the normal")
    axes.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(0, 1), xticks=(-1, 0, 1), yticks=(-1, 0, 1), zticks=(0, 0.5, 1))
    axes.legend(frameon=False, fontsize=9)
    (folder / "figure_02.png").write_bytes(png_bytes(figure))

    figure = new_figure(8.0, 4.0, "Figure 3: half-angle of the Sun's cone over a year", "from 14 October 2018")
    axes = figure.add_axes((0.09, 0.14, 0.88, 0.68))
    axes.plot(days, cone, color="#2340a8", lw=1.5, label="integrated")
    axes.plot(days, steady, color="#8a8f98", lw=1.2, label="node at 0.9889 deg/day, inclination fixed")
    axes.set(xlim=(0, days[-1]), ylim=(55, 70))
    dress(axes, y_label="deg", x_label="days")
    axes.legend(frameon=False, fontsize=9)
    (folder / "figure_03.png").write_bytes(png_bytes(figure))


if __name__ == "__main__":
    main()
