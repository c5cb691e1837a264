"""Detumbling from a satellite file: its motion against SciPy, cases alike in every chunk, files that may not change."""

import jax
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from jaxsat.bundled import CUBESAT
from jaxsat.cli.main import run as command
from jaxsat.constants import EARTH_MU
from jaxsat.errors import InputError
from jaxsat.sweep import (
    Source,
    SweepPlan,
    chunk_path,
    claim,
    drawn_inputs,
    find_missing,
    merge_cases,
    run_cases,
    run_dask,
    run_local,
)
from jaxsat.sweep.scenarios import detumble
from jaxsat.sweep.scenarios.detumble import make

OPTIONS = {"orbits": "0.01", "pressure": "off", "tipoff_deg_s": "20"}
SCENARIO = make(OPTIONS)
CASES = np.arange(SCENARIO.chunk, dtype=np.int64)


@pytest.fixture(scope="module")
def whole():
    return run_cases(SCENARIO, 2, CASES)


def test_a_motion_is_that_of_scipy_with_the_same_dipoles():
    """The fastest of some cases, to 1e-6 rad: field and place from the loop's table, the equations once more."""
    loops, _ = detumble._program(tuple(detumble.make.filled(OPTIONS).items()))
    drawn = jax.device_get(loops.draw(1, CASES))
    case = int(np.argmax(np.linalg.norm(drawn.motion.angular_velocity, axis=1)))
    end, samples = jax.device_get(loops.history(loops.draw(1, CASES), case))
    stages, schedule = loops.timeline().stages, loops.schedule
    begins, edges = np.asarray(loops.timeline().instants.time), schedule.edges
    nodes = (begins[:, None] + edges[None, :-1]).reshape(-1)
    points = stages.points
    assert points is not None
    field, place = (
        CubicSpline(nodes, np.asarray(leaf)[:, :, 0].reshape(-1, 3))
        for leaf in (points.b_field_eci, points.position_eci)
    )
    craft = drawn.vehicle.spacecraft
    J, magnet = craft.inertia[case], craft.magnet[case]

    def slope(t, y, dipole):
        q, w = Rotation.from_quat(y[:4], scalar_first=True), y[4:]
        r = q.inv().apply(place(t))
        torque = 3.0 * EARTH_MU / np.linalg.norm(r) ** 5 * np.cross(r, J @ r)
        torque = torque + np.cross(magnet + dipole, q.inv().apply(field(t)))
        p, v = y[0], y[1:4]
        turn = [-0.5 * v @ w], 0.5 * (p * w + np.cross(v, w))
        return np.concatenate([*turn, np.linalg.solve(J, torque - np.cross(w, J @ w))])

    y = np.concatenate([drawn.motion.quaternion[case], drawn.motion.angular_velocity[case]])
    residual = np.array([0.005, 0.005, 0.0])
    for number, t in enumerate(begins):
        assert abs(
            Rotation.from_quat(y[:4], scalar_first=True).as_quat() @ np.roll(samples.motion.quaternion[number], -1)
        )
        for low, high, share in ((0.0, 1.6, 1.0), (1.6, 2.0, residual)):
            given = (share * samples.dipoles[number],)
            y = solve_ivp(slope, (t + low, t + high), y, "DOP853", args=given, rtol=1e-11, atol=1e-13).y[:, -1]
    apart = Rotation.from_quat(y[:4], scalar_first=True).inv() * Rotation.from_quat(
        end.motion.quaternion, scalar_first=True
    )
    assert apart.magnitude() < 1e-6
    np.testing.assert_allclose(end.motion.angular_velocity, y[4:], rtol=0, atol=1e-7)


def test_a_case_does_not_depend_on_the_others_of_its_chunk(whole):
    """The last bits too, where its place in the chunk is its own."""
    others = CASES + 7 * SCENARIO.chunk
    others[100] = 100
    mixed = run_cases(SCENARIO, 2, others)
    for name, values in whole.items():
        assert mixed[name][100].tobytes() == values[100].tobytes()
    assert mixed["final_rate_deg_s"][0] != whole["final_rate_deg_s"][0]


def test_shards_dask_and_a_resumed_sweep_are_the_whole(tmp_path):
    """Bit for bit: chunks in another order, in another directory, through a scheduler, and after one was lost."""
    distributed = pytest.importorskip("distributed")
    source = Source.of("jaxsat.sweep.scenarios.detumble:make", OPTIONS)
    plan = SweepPlan("detumble", 2, dict(source.options), SCENARIO.chunk, 2 * SCENARIO.chunk - 50)

    def run(directory, numbers):
        run_local(source, plan, directory, numbers, on_done=lambda done: None)

    for name, shards in (("whole", [(1, 1)]), ("shards", [(2, 2), (1, 2)])):
        for shard in shards:
            claim(tmp_path / name, plan, shard=shard)
            run(tmp_path / name, plan.shard(*shard))
    lost = chunk_path(tmp_path / "whole", 1)
    before = lost.read_bytes()
    lost.unlink()
    claim(tmp_path / "whole", plan, resume=True)
    missing, _ = find_missing(SCENARIO, plan, tmp_path / "whole", plan.shard())
    assert missing == [1]
    run(tmp_path / "whole", missing)
    assert lost.read_bytes() == before
    claim(tmp_path / "dask", plan)
    # A worker in this process has the program compiled; processes are tried by experiments/benchmarks/throughput.py.
    settings = {"n_workers": 1, "processes": False, "dashboard_address": None}
    with distributed.LocalCluster(**settings) as cluster:
        given = {"on_done": lambda done: None, "scheduler": cluster.scheduler_address}
        run_dask(source, plan, tmp_path / "dask", plan.shard(), **given)
    names = ("whole", "shards", "dask")
    for name in names:
        merge_cases(SCENARIO, plan, tmp_path / name)
    merged = [(tmp_path / name / "cases.parquet").read_bytes() for name in names]
    assert merged[0] == merged[1] == merged[2]


def test_cases_are_drawn_as_the_file_and_the_options_say(whole):
    drawn = drawn_inputs(SCENARIO, 2, CASES)
    rate = np.linalg.norm([drawn[f"in_rate_{c}_deg_s"] for c in "xyz"], axis=0)
    assert rate.max() <= 20.0 and abs(rate.mean() - 10.0) < 5.0 * 20.0 / np.sqrt(12.0 * len(CASES))
    assert np.all(whole["largest_rate_deg_s"] >= rate * (1.0 - 1e-12))
    for name, middle, sigma in (("in_inertia_xx_kg_m2", 0.035, 7e-4), ("in_mag_bias_x_uT", 0.0, 0.2)):
        values = drawn[name]
        assert abs(values.mean() - middle) < 5.0 * sigma / np.sqrt(len(CASES))
        np.testing.assert_allclose(values.std(), sigma, rtol=0.3)
    assert "in_gyro_bias_x_deg_s" not in drawn, "the law has no gyro"
    assert set(whole["status"]) <= {0, 1}
    np.testing.assert_array_equal(whole["status"] == 0, whole["final_rate_deg_s"] < 0.5)
    np.testing.assert_array_equal(whole["status"] == 0, np.isfinite(whole["detumbling_time_s"]))


def test_a_file_that_has_changed_is_another_sweep(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    satellite = tmp_path / "sat.toml"
    satellite.write_text(CUBESAT.read_text("utf-8"))
    options = make.filled({"satellite": "sat.toml"})
    plan = SweepPlan("detumble", 0, dict(options), SCENARIO.chunk, 10)
    claim(tmp_path / "out", plan)
    assert make.filled(options) == options
    satellite.write_text(CUBESAT.read_text("utf-8").replace("0.035", "0.036"))
    with pytest.raises(InputError, match="sat.toml: has changed since the sweep with this --satellite began"):
        make.filled(options)
    other = SweepPlan("detumble", 0, dict(make.filled({"satellite": "sat.toml"})), SCENARIO.chunk, 10)
    assert plan.difference(other).startswith("option satellite = sat.toml@")
    assert command(["sweep", "detumble", "--out", "out", "--resume"]) == 1
    told = capfd.readouterr().err
    assert "has changed since the sweep" in told and len(told.strip().splitlines()) == 1


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("max_dipole_A_m2 = 0.2", "area_turns_m2 = 1.0\ncolumn = 'i'"), r"has no \[\[coils\]\] with max_dipole_A_m2"),
        (('kind = "magnetometer"', 'kind = "magnetometer"\nunit_vector = true'), "channels.mag.unit"),
        (("[orbit]", "[orbit]\noem = 'x'"), "x: cannot be read"),
    ],
    ids=["no torquers", "directions", "orbit"],
)
def test_what_a_satellite_file_lacks_is_told_in_a_line(change, told, tmp_path):
    file = tmp_path / "sat.toml"
    text = CUBESAT.read_text("utf-8").replace(*change)
    file.write_text(text.replace("residual = 0.005\n", "") if "coils" in told else text)
    with pytest.raises(InputError, match=told):
        make({"satellite": str(file)})


def test_options_are_checked():
    for name, value, told in (
        ("law", "best", "law: expected one of difference, gyro"),
        ("gain", "much", "gain: expected auto or a number from 0 to 1000, found 'much'"),
        ("start_utc", "soon", "start_utc"),
        ("satellite", "nowhere.toml", "nowhere.toml: cannot be read"),
    ):
        with pytest.raises(InputError, match=told):
            make({name: value})
