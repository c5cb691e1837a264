"""Simulated sessions of any satellite: what stands in the files against independent code, and what is refused."""

import csv
import json
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from twin_files import PHOTODIODES, SATELLITE

from jaxsat.cli.main import run
from jaxsat.errors import InputError
from jaxsat.satellites import Satellite, read_satellite
from jaxsat.satellites.model import array_at
from jaxsat.synthetic.twins import TwinSettings, make_twin, write_twin
from jaxsat.synthetic.twins.drawn import _some_axes, drawn_model
from jaxsat.telemetry import TableSession, read_telemetry

TLE = (
    "1 99001U 21001A   20326.72226509  .00001924  00000-0  13588-3 0  9993",
    "2 99001  82.1924 345.6831 0007886 218.7368 155.1969 15.40668907    14",
)


@pytest.fixture
def satellite(tmp_path):
    """Reads the small satellite with changes to its text."""

    def read(*changes: tuple[str, str], more: str = ""):
        text = SATELLITE + more
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "small.sat.toml"
        path.write_text(text)
        found = read_satellite(path)
        assert isinstance(found, Satellite)
        return found

    return read


def rows_of(path):
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


def test_motion_and_readings_are_those_of_independent_code(satellite, tmp_path):
    """Euler's equation by SciPy with the gradient of gravity and the dipole, readings by SciPy's rotations."""
    found = satellite(("sigma = 100.0\n", "sigma = 100.0\ndelay_s = 1.5\ninterval_s = 8.0\n"))
    settings = TwinSettings(duration_s=60.0, every_s=4.0, seed=5, rate_deg_s=(2.0, -1.0, 0.5), tolerance_rad=1e-9)
    twin = make_twin(found, settings)
    model, motion = twin.model, twin.motion
    craft, around = model.spacecraft, twin.around(motion.t_s)
    inertia, dipole = np.array(craft.inertia), np.array(craft.magnet)
    places, fields = np.array(around.position_eci), np.array(around.b_field_eci)

    def slope(t, y):
        turn, w = Rotation.from_quat(y[:4], scalar_first=True), y[4:]
        place, field = (np.array([np.interp(t, motion.t_s, c) for c in v.T]) for v in (places, fields))
        down, field = turn.inv().apply(place / np.linalg.norm(place)), turn.inv().apply(field)
        torque = 3 * 3.986004418e14 / np.linalg.norm(place) ** 3 * np.cross(down, inertia @ down)
        torque = torque + np.cross(dipole, field) - np.cross(w, inertia @ w)
        q_dot = 0.5 * np.concatenate([[-y[1:4] @ w], y[0] * w + np.cross(y[1:4], w)])
        return np.concatenate([q_dot, np.linalg.solve(inertia, torque)])

    start = np.concatenate([motion.quaternion[0], motion.angular_velocity[0]])
    truth = solve_ivp(slope, (0.0, 60.0), start, "DOP853", motion.t_s, rtol=1e-10, atol=1e-12).y.T
    np.testing.assert_allclose(np.degrees(motion.angular_velocity[0]), [2.0, -1.0, 0.5], rtol=1e-12)
    # Between its samples the field is taken along a straight line here: 1e-5 of its torque.
    apart = Rotation.from_quat(motion.quaternion, scalar_first=True).inv() * Rotation.from_quat(
        truth[:, :4], scalar_first=True
    )
    assert apart.magnitude().max() < 1e-5
    np.testing.assert_allclose(motion.angular_velocity, truth[:, 4:], atol=1e-6)

    # Stamps are whole intervals, measured before them; what the sensor read then, in its unit.
    mag, gyro = twin.channels["mag"], twin.channels["gyro"]
    np.testing.assert_array_equal(mag.stamp_s, 8.0 * np.arange(1, 8))
    np.testing.assert_allclose(mag.instant_s, mag.stamp_s - 1.5, rtol=1e-14)
    np.testing.assert_array_equal(gyro.stamp_s, 4.0 * np.arange(16))
    here = np.searchsorted(motion.t_s, mag.instant_s)
    body = Rotation.from_quat(motion.quaternion[here], scalar_first=True).inv().apply(fields[here])
    np.testing.assert_allclose(mag.mean, 1e9 * (body + np.array(array_at(model, "sensors.mag.bias"))), rtol=1e-10)
    np.testing.assert_allclose(gyro.values, np.round(gyro.values, 2), atol=1e-12)
    write_twin(tmp_path, twin, plots=False)
    written = rows_of(tmp_path / "small.csv")
    by_stamp = {row["utc"]: row for row in written}
    instants = [datetime(2021, 5, 1, tzinfo=UTC) + timedelta(seconds=float(t)) for t in mag.stamp_s]
    shown = [by_stamp[instant.strftime("%Y-%m-%dT%H:%M:%S.000Z")] for instant in instants]
    assert {row["utc"] for row in written if row["bx"]} == {row["utc"] for row in shown}
    # Written to a fiftieth of the noise or better.
    np.testing.assert_allclose([[float(row[c]) for c in ("bx", "by", "bz")] for row in shown], mag.values, atol=1.0)
    document = json.loads((tmp_path / "small.truth.json").read_text())
    np.testing.assert_array_equal(document["t"], motion.t_s)
    np.testing.assert_array_equal(document["q"], motion.quaternion)
    assert document["parameters"]["magnet.x"]["value"] == dipole[0] and document["parameters"]["mag.delay"][
        "value"
    ] == pytest.approx(1.5)
    assert document["parameters"]["inertia.xx"]["unit"] == "kg m2"


def test_noise_is_that_of_the_file(satellite):
    twin = make_twin(satellite(), TwinSettings(duration_s=4000.0, every_s=2.0, nominal=True, rate_deg_s=(0.1, 0, 0)))
    for name, sigma in (("mag", 100.0), ("gyro", np.hypot(0.02, 0.01 / np.sqrt(12)))):
        noise = twin.channels[name].values - twin.channels[name].mean
        # Of 6003 numbers the spread is known to 0.9 %, the mean to 1.3 % of the spread: four sigmas.
        assert noise.std() == pytest.approx(sigma, rel=0.037)
        assert abs(noise.mean()) < 0.052 * sigma
        assert np.abs(np.corrcoef(noise.T)[np.triu_indices(3, 1)]).max() < 0.1


def test_numbers_are_drawn_from_their_priors(satellite):
    found = satellite(("sigma = 500.0", "sigma = 500.0, bounds = [-300.0, 800.0]"))
    models = [drawn_model(found, np.random.default_rng(seed)) for seed in range(150)]
    bias = 1e9 * np.array([np.asarray(array_at(model, "sensors.mag.bias")) for model in models])
    assert bias.min() > -300.0 and bias.max() < 800.0 and bias.max() > 700.0
    dipole = np.array([np.asarray(model.spacecraft.magnet) for model in models])
    # Of 450 numbers to 3.3 %: three sigmas.
    assert dipole.std() == pytest.approx(0.01, rel=0.1)
    inertia = np.array([np.asarray(model.spacecraft.inertia) for model in models])
    moments = np.linalg.eigvalsh(inertia)
    assert np.all(moments[:, 0] > 0.0) and np.all(moments[:, 2] <= moments[:, 0] + moments[:, 1])
    np.testing.assert_array_equal(inertia, np.swapaxes(inertia, 1, 2))


def test_priors_without_room_and_unknown_axes(satellite):
    with pytest.raises(InputError, match=r"mag\.bias\.x: its prior allows next to no value"):
        drawn_model(satellite(("sigma = 500.0", "sigma = 500.0, bounds = [-1e-9, 1e-9]")), np.random.default_rng(0))
    random = np.random.default_rng(0)
    right, all_ways = ({tuple(_some_axes(random, mirrored=on).ravel()) for _ in range(600)} for on in (False, True))
    assert len(right) == 24 and len(all_ways) == 48 and right < all_ways
    assert all(np.linalg.det(np.reshape(way, (3, 3))) == pytest.approx(1.0) for way in right)
    unknown = satellite(('kind = "magnetometer"', 'kind = "magnetometer"\naxes = "unknown"'))
    found = {
        tuple(np.ravel(array_at(drawn_model(unknown, np.random.default_rng(k)), "sensors.mag.axes"))) for k in range(6)
    }
    assert 1 < len(found) and found < right


def test_same_seed_same_session_whatever_the_options(satellite):
    settings = TwinSettings(duration_s=30.0, seed=8)
    first, again = (make_twin(satellite(), settings) for _ in range(2))
    for name in first.channels:
        np.testing.assert_array_equal(first.channels[name].values, again.channels[name].values)
    other = make_twin(satellite(), settings.changed(rate_deg_s=(1.0, 0.0, 0.0)))
    np.testing.assert_array_equal(other.motion.quaternion[0], first.motion.quaternion[0])
    np.testing.assert_array_equal(other.model.spacecraft.magnet, first.model.spacecraft.magnet)


@pytest.mark.parametrize(
    ("time", "second"),
    [
        ('column = "clock"\nform = "unix"', "1619827205"),
        ('column = "clock"\nform = "unix"\nunit = "ms"\noffset_s = 0.25', "1619827205250"),
        ('column = "clock"\nform = "seconds"\nepoch = "2021-04-30T23:59:00Z"', "5"),
        ('column = "clock"\noffset_s = 18.0', "2021-05-01T00:00:23.000Z"),
        ('column = "clock"\nresolution_s = 2.0', "2021-05-01T00:00:04.000Z"),
    ],
)
def test_stamps_in_every_form_are_read_back(satellite, tmp_path, time, second):
    found = satellite(('column = "utc"', time))
    twin = make_twin(found, TwinSettings(duration_s=30.0))
    write_twin(tmp_path, twin, plots=False)
    assert rows_of(tmp_path / "small.csv")[1]["clock"] == second
    session = read_telemetry(tmp_path / "small.csv", found)
    np.testing.assert_allclose(session.channels["mag"].t_s, twin.channels["mag"].stamp_s, atol=1e-6)
    assert abs(session.epoch.seconds_since(twin.epoch)) < 1e-4 and not session.rejections


MORE = """
[motion]
kind = "given"
columns = ["q1", "q2", "q3", "q4"]
sense = "body_from_inertial"
scalar = "last"
frame = "gcrf"

[rows]
keep = ["mode == 0", 'state == "on"']

[[coils]]
axis = "+x"
area_turns_m2 = 0.5
column = "coil"
unit = "mA"

[[wheels]]
axis = "+z"
inertia = 1e-6
column = "wheel"
unit = "rpm"
"""
POSITIONS = '[orbit.columns]\nposition = ["x", "y", "z"]\nframe = "{}"\n\n[time]'


@pytest.mark.parametrize("frame", ["eci", "gcrf", "ecef"])
def test_commands_motion_and_positions_come_back_from_the_table(satellite, tmp_path, frame):
    text = SATELLITE[SATELLITE.index("[orbit.elements]") : SATELLITE.index("[time]") + 6]
    found = satellite((text, POSITIONS.format(frame)), more=MORE)
    tle = tmp_path / "sat.tle"
    tle.write_text("\n".join(TLE) + "\n")
    columns = {
        "coil": (np.array([0.0, 12.0]), np.array([0.02, -0.03])),
        "wheel": (np.array([0.0, 30.0]), np.array([0, 300.0])),
    }
    twin = make_twin(found, TwinSettings(duration_s=30.0), orbit=tle, columns=columns)
    write_twin(tmp_path, twin, plots=False)
    session = read_telemetry(tmp_path / "small.csv", found)
    assert not session.rejections and session.motion is not None and session.positions is not None
    t, coil = session.columns["coil"]
    np.testing.assert_allclose(coil, np.where(t < 12.0, 0.02, -0.03), rtol=1e-9)
    assert 12.0 in t
    t, wheel = session.columns["wheel"]
    np.testing.assert_allclose(wheel, 10.0 * t, rtol=1e-8, atol=1e-8)
    t, q = session.motion
    apart = Rotation.from_quat(q, scalar_first=True).inv() * Rotation.from_quat(
        twin.motion.at(t).quaternion, scalar_first=True
    )
    assert apart.magnitude().max() < 1e-8
    t, position = session.positions
    np.testing.assert_allclose(position, np.asarray(twin.around(t).position_eci), atol=1e-2)


def test_body_fixed_to_the_orbit_turns_with_it(satellite):
    twin = make_twin(satellite(more='[motion]\nkind = "orbital"\n'), TwinSettings(duration_s=300.0))
    mean_motion = np.sqrt(3.986004418e14 / 6.9e6**3)
    # Of an eccentricity of 0.001 the rate swings by 0.2 %.
    expected = np.tile([0.0, -mean_motion, 0.0], (len(twin.motion.t_s), 1))
    np.testing.assert_allclose(twin.motion.angular_velocity, expected, atol=0.003 * mean_motion)


def test_command_writes_a_session_that_reads_as_it_stands(satellite, tmp_path, capsys):
    found = satellite(("[time]", "[time] # stamps"), more=PHOTODIODES)
    tle, out = tmp_path / "sat.tle", tmp_path / "out"
    tle.write_text("\n".join(TLE) + "\n")
    words = ["simulate", "--satellite", str(found.path), "--orbit", str(tle), "--rate", "1", "-2", "0.5"]
    words += ["--duration", "60", "--seed", "4", "--start", "2020-11-22T00:00:00Z", "--out", str(out)]
    assert run(words) == 0
    assert "next: jaxsat fit" in capsys.readouterr().out
    names = {"small.csv", "small.truth.json", "small.sat.toml", "small.tle", "small.motion.png", "small.mag.png"}
    assert {path.name for path in out.iterdir()} == names | {"small.gyro.png", "small.sun.png"}
    copied = (out / "small.sat.toml").read_text()
    assert "# What its builder knows." in copied and "[time] # stamps" in copied and 'tle = "small.tle"' in copied
    again = read_satellite(out / "small.sat.toml")
    assert isinstance(again, Satellite)
    session = read_telemetry(out / "small.csv", again)
    assert isinstance(session, TableSession)
    assert {name: len(channel.t_s) for name, channel in session.channels.items()} == {"mag": 13, "gyro": 13, "sun": 13}
    # From there once more, into the same place: the copy is what it would be, and is not in the way.
    assert run(["simulate", "--satellite", str(again.path), "--duration", "60", "--no-plots", "--out", str(out)]) == 0


def test_what_is_refused(satellite, tmp_path, capsys):
    found = satellite()
    path = str(found.path)
    tle = tmp_path / "sat.tle"
    tle.write_text("\n".join(TLE) + "\n")
    commands = tmp_path / "commands.csv"
    commands.write_text("t_s,coil\n0,1\n")
    refused = {
        ("--satellite", path, "--start", "yesterday"): "--start: expected a UTC instant",
        ("--satellite", path, "--duration", "6", "--every", "5"): "duration over interval gives 1.2 readings",
        ("--satellite", path, "--attitude", "0", "0", "0", "0"): "--attitude: expected a quaternion that is not zero",
        ("--satellite", path, "--commands", str(commands)): "holds no column of the satellite file; there are none",
        ("--satellite", path, "--orbit", str(tmp_path / "no.tle")): "no.tle: cannot be read",
        ("--satellite", path, "--orbit", str(tle), "--out", str(tmp_path)): "would be written over it",
        ("--satellite", str(tle)): "sat.tle",
    }
    for words, message in refused.items():
        out = [] if "--out" in words else ["--out", str(tmp_path / "out")]
        assert run(["simulate", *words, *out]) == 1
        assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    assert run(["simulate", "--nominal"]) == 2 and "belong to --satellite" in capsys.readouterr().err
    assert run(["simulate", "munin.toml", "--satellite", path]) == 2
    with pytest.raises(InputError, match=r"coli: no column of a coil, .*did you mean 'coil'"):
        columns = {"coli": (np.zeros(1), np.zeros(1))}
        make_twin(satellite(more=MORE.split("[[wheels]]")[0][MORE.index("[[coils]]") :]), columns=columns)
