"""Sigmas and biases of a plan against closed forms, a linear problem by Monte Carlo, and refits of the whole model."""

import json
import shutil
from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.spatial.transform import Rotation

from fitting.parameters.free import free_parameters
from fitting.parameters.names import STATE
from fitting.sensitivity.analysis import analysed
from fitting.sensitivity.choice import choose, slopes_at_nominal, slopes_of
from fitting.sensitivity.information import known, quoted
from fitting.sensitivity.plan import vantage_of_plan
from fitting.sensitivity.scenarios.draws import Draws, drawn
from fitting.sensitivity.scenarios.maps import column_of
from fitting.sensitivity.scenarios.source import ADDRESS
from fitting.sensitivity.sums import sigmas_of
from jaxsat.cli.main import run
from jaxsat.errors import InputError
from jaxsat.satellites.reading import read_satellite
from jaxsat.synthetic.twins import TwinSettings
from jaxsat.synthetic.twins.source import epoch_of

SATELLITE = """
[body]
inertia_kg_m2 = {value = [0.0020, 0.0017, 0.0014], sigma = 1e-4}
[magnet]
dipole_A_m2 = {value = [0.02, -0.01, 0.03], sigma = 0.01}
[albedo]
diffuse = 0.0
[gauge]
hold = ["magnet"]
[orbit.elements]
a_km = 6900
e = 0.001
i_deg = 97
raan_deg = 20
argp_deg = 10
mean_anomaly_deg = 5
epoch = "2021-05-01T00:00:00Z"
[time]
column = "utc"
[sensors.mag]
kind = "magnetometer"
unit = "nT"
bias = {value = [0.0, 0.0, 0.0], sigma = 500.0}
[channels.mag]
columns = ["bx", "by", "bz"]
unit = "nT"
sigma = 100.0
[sensors.gyro]
kind = "gyro"
unit = "deg/s"
bias = {value = [0.0, 0.0, 0.0], sigma = 0.3}
[channels.gyro]
columns = ["gx", "gy", "gz"]
unit = "deg/s"
sigma = 0.02
[sensors.sun]
kind = "photodiodes"
normals = ["+x", "-x", "+y", "-y", "+z", "-z"]
gain = {value = 1.0, sigma = 0.03}
[channels.sun]
columns = ["s1", "s2", "s3", "s4", "s5", "s6"]
unit = "1"
sigma = 0.01
"""
PLAN = TwinSettings(duration_s=300.0, every_s=10.0, rate_deg_s=(1.0, 0.3, -2.0), quaternion=(0.8, 0.36, -0.48, 0.0))


@pytest.fixture(scope="module")
def satellite(tmp_path_factory):
    path = tmp_path_factory.mktemp("craft") / "small.sat.toml"
    path.write_text(SATELLITE)
    return read_satellite(path)


@pytest.fixture(scope="module")
def vantage(satellite):
    return vantage_of_plan(satellite, PLAN)


def test_two_vectors_have_the_covariance_of_shuster_and_oh(vantage):
    """Information of field and Sun about the attitude of one sample: sum of (1 - b b^T) / sigma^2 (1981, eq. 97)."""
    slopes, readings = vantage.slopes, vantage.readings(vantage.slopes)
    J = slopes.jacobian[0][:, :3]
    b, faces = readings["mag"][0], readings["sun"][0]
    sun = faces[0::2] - faces[1::2]
    assert np.linalg.norm(sun) == pytest.approx(1.0, abs=1e-12)
    expected = (b @ b * np.eye(3) - np.outer(b, b)) / 1e-7**2 + (np.eye(3) - np.outer(sun, sun)) / 0.01**2
    np.testing.assert_allclose(J.T @ J, expected, rtol=1e-9, atol=1e-6 * np.abs(expected).max())


def test_bias_of_a_gyroscope_is_known_to_sigma_over_root_n(vantage):
    """Alone and along a known motion: the columns of the state are dropped."""
    choice = choose(vantage, ["gyro.bias"])
    still = replace(choice, kept=choice.kept & (np.arange(len(choice.kept)) >= 6), free=choice.free[:, 6:])
    sigma = [row.sigma_noise for row in quoted(vantage, known(vantage, still)).rows]
    information = 31 / 0.02**2 + 1 / 0.3**2
    np.testing.assert_allclose(sigma, information**-0.5, rtol=1e-9)


def test_consider_covariance_is_the_scatter_of_a_linear_problem():
    """20 000 draws of noise, of unknowns from their priors and of considered numbers: 2 % of a sigma is four sigmas."""
    rng = np.random.default_rng(4)
    J, Jc, turn, turn_c = (rng.normal(size=shape) for shape in ((30, 5), (30, 2), (7, 5), (7, 2)))
    prior, rows = np.array([0.0, 0.0, 1.0, 1.0, 1.0]), rng.normal(size=(4, 5))
    both, turned = np.hstack([J, Jc]), np.hstack([turn, turn_c])
    found = sigmas_of(both.T @ both, turned.T @ turned, np.asarray(1), prior, rows)
    x = rng.normal(size=(20_000, 5)) * np.where(prior > 0.0, 1.0, 3.0)
    c, noise = rng.normal(size=(20_000, 2)), rng.normal(size=(20_000, 30))
    estimate = (x @ J.T + c @ Jc.T + noise) @ J @ np.linalg.inv(J.T @ J + np.diag(prior))
    np.testing.assert_allclose(found.total, np.std((estimate - x) @ rows.T, axis=0), rtol=0.02)
    off = (estimate - x) @ turn.T - c @ turn_c.T
    assert found.attitude == pytest.approx(np.sqrt((off**2).sum(axis=1).mean()), rel=0.02)


@pytest.mark.parametrize(
    ("name", "by"), [("inertia.zz", 2e-6), ("mag.delay", 0.1), ("gyro.scale.x", 0.02), ("sun.gain.+x", 0.01)]
)
def test_predicted_bias_is_that_of_a_refit(vantage, name, by):
    """The whole model is fitted to data of a satellite whose number is off: the estimate goes where S says, to 5 %."""
    leaves = {leaf.name: k for k, leaf in enumerate(vantage.satellite.leaves)}
    leaf = vantage.satellite.leaves[leaves[name]]
    choice = choose(vantage, ["magnet", "gyro.bias"], [f"{name}={by}"])
    found = known(vantage, choice)
    true = vantage.at(np.zeros(6), {leaves[name]: by / leaf.to_unit}).residual
    numbers, scale, x = vantage.slopes.leaves.tolist(), vantage.slopes.scale, np.zeros(len(found.prior))
    for _ in range(4):
        full = choice.free @ x
        slopes = vantage.at(full[:6], dict(zip(numbers, full[6:] * scale, strict=True)))
        J = slopes.jacobian @ choice.free
        pull = np.einsum("scu,sc,sc->u", J, slopes.weight, slopes.residual - true)
        step = found.noise @ (pull + found.prior * x)
        x = x - step
    assert np.sqrt(step @ found.information @ step) < 0.01 * np.sqrt(x @ found.information @ x)
    size = np.sqrt(x @ found.information @ x)
    off = x - found.shift[:, 0]
    assert size > 0.1 and np.sqrt(off @ found.information @ off) < 0.05 * size


def test_slopes_of_a_choice_are_those_of_the_parametrisation(vantage):
    """With a dipole by its components under the gauge, by its angles, and an inertia that stays that of a body."""
    satellite = vantage.satellite
    for free in (
        ["magnet.x", "magnet.y", "magnet.z", "inertia"],
        ["magnet.modulus", "magnet.azimuth", "magnet.elevation", "inertia"],
    ):
        names = [leaf.name for leaf in satellite.leaves if leaf.name in free or leaf.name.split(".")[0] in free]
        parameters = free_parameters(vantage.model, satellite.leaves, names, held=("magnet",))
        expected = np.array(slopes_of(parameters.tree, jnp.zeros(len(parameters.columns))))
        rows = [k for k, leaf in enumerate(satellite.leaves) if not leaf.restates or leaf.name in names]
        assert parameters.gauged
        np.testing.assert_allclose(slopes_at_nominal(parameters)[rows], expected[rows], rtol=1e-9, atol=1e-15)


def test_whole_arc_of_the_map_is_the_analysis_and_shares_add_up(vantage):
    found = analysed(vantage, ["magnet", "mag.bias", "gyro.bias"], ["inertia", "sun.delay=0.1"])
    assert found.sampling is not None
    last = found.sampling.sigmas
    np.testing.assert_allclose(last.total[-1, 0], [row.sigma for row in found.quoted.rows], rtol=1e-6)
    assert np.degrees(last.attitude[-1, 0]) == pytest.approx(found.attitude_rms_deg[2], rel=1e-6)
    shares = found.contributions
    for each in (shares.channels, shares.parts):
        assert sum(one.share for one in each) + shares.priors == pytest.approx(1.0, abs=1e-9)
    assert shares.samples.sum() == pytest.approx(1.0 - shares.priors)
    table = found.bias_per_unit()
    assert table["sun.delay"]["attitude.x"] == pytest.approx(found.quoted.shift[0, -1] / 0.1)


def test_a_null_direction_is_named_and_flagged(vantage):
    """Without a gauge inertia and all torques beside the gravity gradient, which scales along, have no size."""
    free = replace(vantage, satellite=replace(vantage.satellite, held=()))
    found = analysed(free, ["magnet", "inertia", "mag.bias"])
    assert not found.regular
    assert [each.name for each in found.unseen if each.blind] == ["common scale of inertia and magnet"]
    assert found.worst[0].words == "inertia and magnet scale together"
    held = analysed(vantage, ["magnet", "inertia", "mag.bias"])
    assert not any(
        each.name == "common scale of inertia and magnet" and each.held_by == "the priors" for each in held.unseen
    )


@pytest.mark.parametrize(
    ("free", "consider", "expected"),
    [
        (["magnet"], ["magnet.x"], "both fitted and considered"),
        (None, ["mag.delay"], "no sigma"),
        (None, ["mag.delay=-1"], "positive number"),
        (None, ["mag.dela=1"], "did you mean mag.delay"),
        (["wheel"], [], "unknown free parameter"),
    ],
)
def test_wrong_choices_are_one_line(vantage, free, consider, expected):
    with pytest.raises(InputError, match=expected):
        choose(vantage, free, consider)


def test_the_derivatives_are_those_of_complete_runs(vantage):
    """Of two motions a little apart, by all unknowns at once, to the second order of the step."""
    rng = np.random.default_rng(1)
    slopes = vantage.slopes
    x = 1e-4 * rng.normal(size=len(STATE) + len(slopes.leaves))
    shifts = dict(zip(slopes.leaves.tolist(), x[6:] * slopes.scale, strict=True))
    ends = [vantage.at(sign * x[:6], {k: sign * v for k, v in shifts.items()}).residual for sign in (1.0, -1.0)]
    used = slopes.weight > 0.0
    expected = (slopes.jacobian @ x)[used]
    np.testing.assert_allclose(0.5 * (ends[0] - ends[1])[used], expected, atol=2e-6 * np.abs(expected).max())
    turn = Rotation.from_quat(slopes.quaternion, scalar_first=True)
    moved = Rotation.from_quat(vantage.at(x[:6], shifts).quaternion, scalar_first=True)
    np.testing.assert_allclose((turn.inv() * moved).as_rotvec(), slopes.rotation @ x, atol=1e-6)


MAP = [*("--duration", "300", "--every", "10", "--spin", "0.1", "2", "--days", "2", "--seed", "5")]
CHOICE = [*("--free", "magnet,gyro.bias", "--consider", "mag.bias,inertia.xx=1e-6", "--spread", "magnet,mag.bias")]


@pytest.fixture(scope="module")
def mapped(satellite, tmp_path_factory):
    """600 scenarios, two chunks of them, by the command; not drawn."""
    out = tmp_path_factory.mktemp("map")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("jaxsat.numerics.set_up_jax", lambda: None)
        assert run(["sensitivity", str(satellite.path), *MAP, *CHOICE, "--scenarios", "600", *quiet_to(out)]) == 0
    return out


def quiet_to(directory):
    return ["--no-plots", "--quiet", "--out", str(directory)]


def table_of(directory):
    found = pq.read_table(directory / "scenarios" / "cases.parquet")
    return {name: np.asarray(found.column(name)) for name in found.column_names}


def test_scenarios_are_what_each_would_be_alone(satellite, mapped, tmp_path):
    """Of any start, instant, choice and magnet: one on the second instant again by itself."""
    table, case = table_of(mapped), 70
    spin = np.linalg.norm([table[f"in_rate_{axis}_deg_s"] for axis in "xyz"], axis=0)
    assert 0.1 <= spin.min() and spin.max() <= 2.0
    # Ten instants have been begun, of 64 in two days.
    instants = np.unique(table["in_instant_s"])
    assert len(instants) == 10 and np.all((instants + 1350.0) % 2700.0 == 0.0) and np.ptp(instants) > 1.5 * 86400.0
    magnet = [table[f"in_magnet_{axis}_A_m2"] for axis in "xyz"]
    np.testing.assert_allclose(np.std(magnet, axis=1), 0.01, rtol=0.12)
    other = tmp_path / "other.sat.toml"
    numbers = ", ".join(repr(float(each[case])) for each in magnet)
    bias = ", ".join(repr(float(table[f"in_mag_bias_{axis}_nT"][case])) for axis in "xyz")
    text = SATELLITE.replace("value = [0.02, -0.01, 0.03]", f"value = [{numbers}]")
    other.write_text(text.replace("value = [0.0, 0.0, 0.0], sigma = 500", f"value = [{bias}], sigma = 500"))
    own = read_satellite(other)
    start = {
        "start_utc": epoch_of(own, PLAN).shifted(float(table["in_instant_s"][case])).iso(3) + "Z",
        "rate_deg_s": [float(table[f"in_rate_{axis}_deg_s"][case]) for axis in "xyz"],
        "quaternion": [float(table[f"in_attitude_{axis}"][case]) for axis in "wxyz"],
    }
    alone = vantage_of_plan(own, TwinSettings(**{**dict(PLAN), **start}))
    found = known(alone, choose(alone, ["magnet", "gyro.bias"], ["mag.bias", "inertia.xx=1e-6"]))
    # Their steps are longer; as short as that of one alone they lead to its sigmas to 5e-5.
    for row in quoted(alone, found).rows:
        assert table[column_of(row.name, row.unit)][case] == pytest.approx(row.sigma, rel=2e-3)


def test_scenarios_resumed_and_grown_are_the_same_to_the_bit(satellite, mapped, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda: None)
    words = ["sensitivity", str(satellite.path), *MAP, *CHOICE]
    stopped = tmp_path / "stopped"
    shutil.copytree(mapped, stopped)
    chunk = stopped / "scenarios/chunks/chunk-00000001.parquet"
    was = {path: path.read_bytes() for path in (chunk, stopped / "scenarios/cases.parquet")}
    for path in was:
        path.unlink()
    (stopped / "scenarios/summary.json").unlink()
    assert run([*words, "--scenarios", "600", *quiet_to(stopped)]) == 1
    assert "--resume finishes it" in capsys.readouterr().err
    assert run([*words, "--scenarios", "600", "--resume", *quiet_to(stopped)]) == 0
    assert all(path.read_bytes() == content for path, content in was.items())
    # And so does the other command that is named then.
    for path in was:
        path.unlink()
    assert run(["sweep", ADDRESS, "--out", str(stopped / "scenarios"), "--resume", "--no-plots", "-q"]) == 0
    assert all(path.read_bytes() == content for path, content in was.items())
    # More of them: those that were there stay what they were, though the last chunk was cut.
    assert run([*words, "--scenarios", "700", "--resume", *quiet_to(stopped)]) == 0
    before, after = table_of(mapped), table_of(stopped)
    assert all(np.array_equal(after[name][:600], before[name]) for name in before) and len(after["case"]) == 700
    document = json.loads((stopped / "sensitivity.json").read_text())["scenarios"]
    assert document["count"] == 700 and document["instants"] == 11
    # Another satellite under way is not taken for the same.
    shutil.copy(satellite.path, other := tmp_path / "small.sat.toml")
    words[1] = str(other)
    assert run([*words, "--scenarios", "700", "--resume", *quiet_to(stopped)]) == 1
    assert "holds a sweep with option satellite" in capsys.readouterr().err


def test_instants_and_starts_are_of_the_number_of_a_scenario_alone(satellite):
    draws = Draws(10**6, instants=1000, days=10.0)
    first = draws.instant_of(np.arange(64 * 1000))
    assert np.array_equal(np.bincount(first), np.full(1000, 64))
    assert np.array_equal(draws.instant_of(np.arange(64_000, 65_000)), first[:1000])
    # A part of them is as even as a golden section: no gap is longer than three of the mean.
    assert np.diff(np.sort(np.unique(first[: 64 * 40]))).max() < 3 * 1000 / 40
    both = drawn(draws, satellite, [], 3, np.arange(40, 60)), drawn(draws, satellite, [], 3, np.arange(50, 55))
    assert all(np.array_equal(a[10:15], b) for a, b in zip(*both, strict=True))
    with pytest.raises(ValueError, match="instants"):
        Draws(10, instants=0)


def test_the_command_writes_what_it_says(tmp_path, satellite, capsys, monkeypatch):
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda: None)
    plan = ["--duration", "300", "--every", "10", "--rate", "1", "0.3", "-2", "--attitude", "0.8", "0.36", "-0.48", "0"]
    out = tmp_path / "out"
    words = ["sensitivity", str(satellite.path), *plan, "--consider", "inertia,mag.delay=0.1", "--out", str(out)]
    assert run(words) == 0
    text = capsys.readouterr().out
    assert "attitude known to" in text and "attitude without it" in text and max(map(len, text.splitlines())) <= 80
    document = json.loads((out / "sensitivity.json").read_text())
    assert document["schema"] == "jaxsat.sensitivity/1" and document["considered"]["mag.delay"]["sigma"] == 0.1
    assert sorted(path.name for path in out.iterdir()) == [
        *("arc.png", "limits.png", "report.html", "sampling.png", "sensitivity.json")
    ]
    numbers = document["parameters"]["magnet.x"]
    assert numbers["sigma"] == pytest.approx(np.hypot(numbers["sigma_noise"], numbers["sigma_assumed"]))
    assert "What a wrong assumption costs" in (out / "report.html").read_text()


def test_wrong_places_are_one_line(tmp_path, satellite, capsys, monkeypatch):
    monkeypatch.setattr("jaxsat.numerics.set_up_jax", lambda: None)
    several = tmp_path / "several"
    several.mkdir()
    (several / "summary.json").write_text('{"schema": "jaxsat.fit-summary/1"}')
    for words, status, expected in (
        ([str(several)], 1, "name one of them"),
        ([str(satellite.path), "--apart", "gyro_bias"], 2, "--together and --apart are those of the directory of a"),
        ([str(tmp_path)], 1, "no fit.json"),
        ([str(tmp_path / "none.toml")], 1, "no such file"),
        ([str(satellite.path), "--config", "x.toml"], 2, "belong to the directory of a fit"),
        ([str(satellite.path), "--spin", "1", "2"], 2, "those of --scenarios"),
        ([str(satellite.path), "--consider", "mag.dela=1"], 2, "--consider: unknown number 'mag.dela'"),
        ([str(satellite.path), "--resume"], 2, "those of --scenarios"),
        ([str(satellite.path), "--duration", "-1"], 1, "--duration"),
        ([str(satellite.path), "--scenarios", "9", "--spin", "5", "1"], 1, "the slowest below the fastest"),
    ):
        assert run(["sensitivity", *words]) == status
        assert expected in capsys.readouterr().err
