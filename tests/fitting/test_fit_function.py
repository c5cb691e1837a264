"""The main job for any satellite, on a session whose truth another program made (`experiments.twins`)."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from experiments.twins.draw import draw
from experiments.twins.write import write_session
from fitting.measurements.assembly import Samples, channels_within
from fitting.measurements.units import turns_between
from fitting.parameters.chosen import chosen_leaves
from fitting.report.between import between_samples
from fitting.run import fit
from fitting.settings import FitSettings
from fitting.solvers.chunk import solve_chunk
from jaxsat.errors import InputError
from jaxsat.satellites import Satellite, read_satellite
from jaxsat.telemetry import TableSession, read_telemetry

pytestmark = pytest.mark.slow

SEED = 3
README = Path(__file__).parents[2] / "README.md"


def read(satellite_file, table):
    satellite = read_satellite(satellite_file)
    assert isinstance(satellite, Satellite)
    session = read_telemetry(table, satellite)
    assert isinstance(session, TableSession)
    return satellite, session


class Twin:
    """A 1U with magnetometer, gyroscope, diodes and commanded coils, 25 minutes, 30 % of them held out."""

    def __init__(self, folder):
        self.table = write_session(draw("1u-coils", SEED, 0.5), folder)
        self.satellite, self.session = read(self.table.with_suffix(".sat.toml"), self.table)
        self.truth = json.loads(self.table.with_suffix(".truth.json").read_text())
        settings = FitSettings(holdout=0.3, starts=16)
        self.fit = fit(
            self.satellite, self.session, settings=settings, profiles=("magnet.x", "mag.bias.y"), causes=False
        )
        self.result = self.fit.result

    def errors_deg(self, t, quaternion):
        fine = self.truth["fine"]
        true = Slerp(fine["t"], Rotation.from_quat(fine["q"], scalar_first=True))(t)
        return np.degrees((Rotation.from_quat(quaternion, scalar_first=True).inv() * true).magnitude())


@pytest.fixture(scope="module")
def twin(tmp_path_factory):
    return Twin(tmp_path_factory.mktemp("twin"))


def test_motion_is_the_true_one_within_its_sigma(twin):
    result = twin.result
    assert (result.status, result.verdict) == ("converged", "predicts")
    error = twin.errors_deg(result.t_s, result.quaternion_inertial_from_body)
    promised = np.linalg.norm(result.attitude_sigma_deg, axis=1)
    for part in (result.fitted, ~result.fitted):
        assert part.sum() > 50
        # The root of the sum over three axes is a chi of three correlated numbers: 2 is beyond all luck.
        assert np.sqrt(np.mean(error[part] ** 2)) < 2.0 * np.sqrt(np.mean(promised[part] ** 2))
    assert np.sqrt(np.mean(error[result.fitted] ** 2)) < 0.6


def test_numbers_are_the_true_ones_within_their_sigmas(twin):
    unit = {leaf.name: leaf.to_unit for leaf in twin.satellite.leaves}
    z = []
    for parameter in twin.result.parameters:
        truth = twin.truth["parameters"].get(parameter.name)
        if parameter.free and parameter.sigma and truth is not None:
            z.append((parameter.value - truth["value"] * unit[parameter.name]) / parameter.sigma)
    assert len(z) > 20 and np.max(np.abs(z)) < 4.0 and 0.5 < np.sqrt(np.mean(np.square(z))) < 1.5


def test_profiles_are_parabolas_about_the_truth(twin):
    """What 18 minutes tell well: the cost rises as the sigma promises, and the truth lies within it."""
    assert twin.fit.profile_remarks == () and [p.name for p in twin.fit.profiles] == ["magnet.x", "mag.bias.y"]
    for p in twin.fit.profiles:
        truth = twin.truth["parameters"][p.name]["value"] * {"uT": 1e6, "A m2": 1.0}[p.unit]
        assert p.settled.all() and p.note == "" and abs(p.best - truth) < 4.0 * p.sigma
        for end, z in zip((*p.interval_68, *p.interval_95), (-1.0, 1.0, -1.96, 1.96), strict=True):
            assert (end - p.best) / p.sigma == pytest.approx(z, rel=0.03)
        (own,) = [q for q in twin.result.parameters if q.name == p.name]
        assert (own.value, own.sigma, own.unit) == (pytest.approx(p.best), pytest.approx(p.sigma), p.unit)


def test_lines_between_the_samples_are_the_model_s_own(twin):
    """Straight lines through its points, against the model integrated to other instants; attitude against the truth."""
    fit, result = twin.fit, twin.result
    between = between_samples(result, fit.found, fit.around, fit.looked)
    assert between is not None
    turn = Rotation.from_quat(between.quaternion_inertial_from_body, scalar_first=True)
    assert np.degrees((turn[1:].inv() * turn[:-1]).magnitude()).max() < 4.5
    assert np.isin(np.round(result.t_s, 4), between.t_s).all()
    middle = result.t_s[:-1] + 0.37 * np.diff(result.t_s)
    q, _ = fit.motion(middle)
    drawn = Slerp(between.t_s, turn)(middle)
    assert np.degrees((drawn.inv() * Rotation.from_quat(q, scalar_first=True)).magnitude()).max() < 0.05
    for name, channel in result.channels.items():
        modelled, _ = fit.predict(name, middle)
        lines = np.column_stack([np.interp(middle, between.t_s, column) for column in between.readings[name].T])
        error = np.abs(lines - modelled) / channel.sigma
        # At an edge of light a line is off by as much as there is of it between two points.
        assert np.median(error) < 0.02 and np.quantile(error, 0.99) < 0.5
        # From sample to sample it would be more: the reason for all of it.
        chords = np.column_stack([np.interp(middle, channel.t_s, column) for column in channel.modelled.T])
        assert np.median(np.abs(chords - modelled)) > 3.0 * np.median(np.abs(lines - modelled))


def test_channels_are_predicted_as_promised(twin):
    for channel in twin.result.channels.values():
        assert channel.holdout is not None and channel.holdout.sigma_ratio < 2.0
        assert channel.rms == pytest.approx(channel.sigma, rel=0.15)
        assert (channel.fitted.sum(), (~channel.fitted).sum()) == (211, 90)
    # The dipole of a satellite that turns freely in the field is worth more than any number of a sensor.
    assert next(iter(twin.result.buys)) == "magnet" and min(twin.result.buys.values()) > -1.0


def test_another_choice_of_what_is_free_compiles_nothing(twin):
    before = set(solve_chunk._programs)
    assert before
    settings = FitSettings(holdout=0.3, starts=16, free=("magnet", "gyro.bias", "sun.gain"))
    found = fit(twin.satellite, twin.session, settings=settings, causes=False).result
    assert set(solve_chunk._programs) == before
    free = {p.name for p in found.parameters if p.free}
    assert {"magnet.x", "gyro.bias.z", "sun.gain.-z"} <= free and not any(n.startswith("mag.") for n in free)


def test_motion_and_readings_at_other_times(twin):
    at = np.array([100.0, 101.3, 740.0])
    quaternion, rate = twin.fit.motion(at)
    assert twin.errors_deg(at, quaternion).max() < 1.5 and rate.shape == (3, 3)
    own = np.flatnonzero(twin.result.t_s == 100.0)[0]
    overlap = abs(float(quaternion[0] @ twin.result.quaternion_inertial_from_body[own]))
    assert overlap == pytest.approx(1.0, abs=1e-9)
    channel = twin.result.channels["mag"]
    reading, sigma = twin.fit.predict("mag", channel.t_s[:3])
    np.testing.assert_allclose(reading, channel.modelled[:3], atol=1e-6)
    assert np.all(sigma > 0.0) and np.all(sigma < channel.sigma)
    with pytest.raises(ValueError, match="first sample"):
        twin.fit.motion(np.array([-5.0]))
    with pytest.raises(ValueError, match="1700"):
        twin.fit.motion(np.array([1700.0]))
    assert twin.fit.covariance.shape == (len(twin.fit.names),) * 2


def test_unknown_axes_are_found(twin, tmp_path):
    """The columns of the magnetometer in another order, two with their signs changed: a convention of the 24."""
    lines = twin.table.read_text().splitlines()
    columns = lines[0].split(",")
    x, y, z = (columns.index(name) for name in ("bx", "by", "bz"))
    rows = []
    for line in lines[1:]:
        cells = line.split(",")
        cells[x], cells[y], cells[z] = cells[z], str(-float(cells[x])), str(-float(cells[y]))
        rows.append(",".join(cells))
    table = tmp_path / "turned.csv"
    table.write_text("\n".join([lines[0], *rows]) + "\n")
    text = twin.table.with_suffix(".sat.toml").read_text()
    text = re.sub(r"(\[sensors.mag\][^\[]*?axes = )\[[^\]]*\]", r'\1"unknown"', text)
    (tmp_path / "sat.toml").write_text(text)
    tle = twin.table.with_suffix(".tle")
    (tmp_path / tle.name).write_text(tle.read_text())
    found = fit(*read(tmp_path / "sat.toml", table), settings=FitSettings(holdout=0.3, starts=8), causes=False).result
    assert found.axes == {"mag": ["+z", "-x", "-y"]} and found.status == "converged"


def test_readings_in_another_unit_are_told_before_the_search(twin, tmp_path):
    tle = twin.table.with_suffix(".tle")
    (tmp_path / tle.name).write_text(tle.read_text())
    text = twin.table.with_suffix(".sat.toml").read_text()
    (tmp_path / "sat.toml").write_text(text.replace('unit = "uT"\nsigma', 'unit = "mT"\nsigma'))
    with pytest.raises(
        InputError, match=r"channels\.mag\.unit: \|B\| of mag is 1.*e\+03 times that of IGRF .* as 'uT'"
    ):
        fit(*read(tmp_path / "sat.toml", twin.table))
    (tmp_path / "sat.toml").write_text(text.replace('unit = "deg/s"\nsigma', 'unit = "rad/s"\nsigma'))
    satellite, session = read(tmp_path / "sat.toml", twin.table)
    samples = Samples.of(channels_within(session, None), session.epoch, {})
    (remark,) = turns_between(samples, satellite.model)
    assert "by gyro the satellite turns by" in remark and "is its unit 'rad/s' right?" in remark
    assert turns_between(Samples.of(channels_within(twin.session, None), session.epoch, {}), satellite.model) == []


def test_what_is_free_by_name(twin):
    leaves = twin.satellite.leaves
    assert chosen_leaves(leaves, ["magnet"]) == ("magnet.x", "magnet.y", "magnet.z")
    assert chosen_leaves(leaves, ["sun.gain.+x", "albedo.diffuse"]) == ("albedo.diffuse", "sun.gain.+x")
    with pytest.raises(InputError, match="did you mean mag.bias"):
        chosen_leaves(leaves, ["mag.biass"])


def test_the_lines_of_python_in_the_readme_run(twin, tmp_path, monkeypatch, capsys):
    (example,) = re.findall(r"^```python\n(.*?)^```", README.read_text("utf-8"), flags=re.DOTALL | re.MULTILINE)
    tle = twin.table.with_suffix(".tle")
    for path, name in ((twin.table, "pass.csv"), (twin.table.with_suffix(".sat.toml"), "sat.toml"), (tle, tle.name)):
        (tmp_path / name).write_text(path.read_text())
    monkeypatch.chdir(tmp_path)
    exec(compile(example, "README.md", "exec"), {"__name__": "__main__"})
    assert "predicts one motion explains the data and predicts" in capsys.readouterr().out
    assert (tmp_path / "pass-fit" / "report.html").is_file()


def test_written_as_by_the_command(twin, tmp_path):
    assert twin.fit.write(tmp_path / "out", plots=False) == []
    document = json.loads((tmp_path / "out" / "fit.json").read_text())
    assert document["schema"] == "jaxsat.fit/1" and document["verdict"][0] == "predicts"
    assert document["holdout"]["mag"]["sigma_ratio"] < 2.0
