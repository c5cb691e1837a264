"""First guesses from files, and their place in a session: rates by hand, numbers within what is free."""

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.measurements.assembly import Samples
from fitting.parameters.free import free_parameters
from fitting.parameters.names import STATE
from fitting.starts.guess import STARTS, Guess, check_names, place
from fitting.starts.guess_files import read_guess
from jaxsat.errors import InputError
from jaxsat.satellites import read_satellite
from jaxsat.time import Epoch

EPOCH = Epoch.from_iso("2001-01-18T04:54:15")
LOCAL = """t_s,utc,solution,q_w,q_x,q_y,q_z,sigma_deg,status,reason
0,2001-01-18T04:54:15.000,1,0,0,1,0,90,does not fit,"the currents, all"
60,2001-01-18T04:55:15.000,1,1,0,0,0,3,solved,
60,2001-01-18T04:55:15.000,2,0,1,0,0,3,solved,
120,2001-01-18T04:56:15.000,1,0.7071067812,0,0,0.7071067812,3,solved,
180,2001-01-18T04:57:15.000,,,,,,,unsolved,no panel shows light
"""


@pytest.fixture
def file(tmp_path):
    def write(name: str, text: str):
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return write


@pytest.fixture
def samples():
    t = np.arange(0.0, 1200.0, 60.0)
    return Samples(t, {}, {}, EPOCH, {})


def test_lines_of_toml(file):
    text = "utc = '2001-01-18T04:55:15'\nquaternion = [0.0, 0, 3, 0]\nrate_deg_s = [0.0, 0.0, 2.0]\n"
    guess = read_guess(file("g.toml", text + "attitude_sigma_deg = 4.0\n[parameters]\nmagnet.x = 0.3\n'imax' = 240\n"))
    assert guess.epoch is not None and guess.epoch.seconds_since(EPOCH) == pytest.approx(60.0, abs=1e-9)
    np.testing.assert_allclose(guess.rate, [[0, 0, 2 * np.pi / 180]], rtol=1e-12)
    assert guess.attitude_sigma is not None and guess.values == {"magnet.x": 0.3, "imax": 240.0}


def test_attitudes_of_local_turn_at_the_rate_between_neighbours(file, samples):
    guess = read_guess(file("attitude.csv", LOCAL))
    # A quarter turn about z in a minute; the last attitude has no neighbour, and solved ones go before others.
    np.testing.assert_allclose(guess.rate, [[0.0, 0.0, np.pi / 2 / 60]], atol=1e-9)
    assert guess.rate_sigma is not None
    np.testing.assert_allclose(guess.rate_sigma, np.sqrt(2) * np.radians(3) / 60, rtol=1e-9)
    placed = place(guess, samples, 0, 20, np.arange(20))
    assert placed.sample == 1 and placed.attitude.magnitude() < 1e-9


def test_directory_of_a_fit_gives_what_was_free(file):
    names = "t_s,utc,q_w,q_x,q_y,q_z,rate_x_rad_s,rate_y_rad_s,rate_z_rad_s\n"
    path = file("attitude.csv", names + "0,2001-01-18T04:54:15.000,1,0,0,0,0.01,0,-0.02\n")
    file(
        "fit.json",
        '{"parameters": {"imax": {"value": 251.5, "free": true}, "rods.y": {"value": 0.03, "free": false}}}',
    )
    guess = read_guess(path.parent)
    assert guess.values == {"imax": 251.5} and read_guess(path).values == {}
    np.testing.assert_array_equal(guess.rate, [[0.01, 0.0, -0.02]])


def test_starts_lie_about_the_guess_and_carry_its_free_numbers(samples):
    satellite = read_satellite()
    parameters = free_parameters(satellite.model, satellite.leaves, ("imax", "magnet.x", "magnet.y", "magnet.z"))
    guess = Guess(
        np.array([[2.0, 0, 0, 0]]),
        np.array([[0.0, 0, 0.01]]),
        np.array([90.0]),
        attitude_sigma=np.array([0.1]),
        values={"imax": 250.0, "magnet.y": 0.02, "rods.y": 0.9},
    )
    check_names(guess, satellite.leaves)
    placed = place(guess, samples, 0, 20, np.arange(20))
    starts = placed.starts(parameters, np.random.default_rng(0))
    # Half a minute from the sample that is next, at its rate about z.
    angle = 0.01 * (samples.t[placed.sample] - 90.0)
    np.testing.assert_allclose(starts.reference[0], [np.cos(angle / 2), 0, 0, np.sin(angle / 2)], atol=1e-12)
    off = 2 * np.arccos(np.abs(starts.reference[1:] @ starts.reference[0]))
    assert len(starts.cost) == STARTS and 0.05 < np.sqrt(np.mean(off**2) / 3) < 0.2
    values = np.asarray(parameters.tree.values(jnp.asarray(starts.x[0, len(STATE) :])))
    found = {leaf.name: value * leaf.to_unit for leaf, value in zip(parameters.leaves, values, strict=True)}
    # What is not free stays nominal.
    assert found["imax"] == pytest.approx(250.0) and found["rods.y"] != pytest.approx(0.9)
    assert found["magnet.y"] == pytest.approx(0.02, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("g.toml", "quaternion = [0.0, 0, 0, 0]\nrate_deg_s = [0.0, 0, 1]\n", "quaternion: expected a quaternion"),
        ("g.toml", "quaternion = [1.0, 0, 0, 0]\n", "rate_deg_s: Field required"),
        (
            "g.toml",
            "quaternion=[1.0,0,0,0]\nrate_deg_s=[0.0,0,1]\n[parameters]\na = 'b'\n",
            "parameters.a: expected a nu",
        ),
        ("a.csv", "t_s,q_w\n0,1\n", "has no column utc"),
        ("a.csv", LOCAL.replace("0.7071067812,", "x,", 1), "csv:5: q_w: expected a number"),
        ("a.csv", LOCAL.replace("0.7071067812,", ",", 1), "csv:5: q_w: expected four numbers"),
        ("a.csv", LOCAL.replace("0.7071067812,", "1e99,", 1), "csv:5: q_w: expected a number"),
        ("a.csv", LOCAL.splitlines()[0] + "\n", "no row below a header"),
        ("a.csv", "\n".join(LOCAL.splitlines()[:2]) + "\n", "tells no rate"),
        ("a.csv", LOCAL.replace("2001-01-18T04:55:15.000", "2001-13", 1), "utc"),
    ],
)
def test_what_is_no_guess_is_one_line(name, text, reason, file):
    with pytest.raises(InputError) as caught:
        read_guess(file(name, text))
    assert reason in str(caught.value)


def test_a_guess_without_a_place_is_refused(samples):
    guess = Guess(np.array([[1.0, 0, 0, 0]]), np.zeros((1, 3)), np.array([900.0]))
    with pytest.raises(InputError, match="only 5 samples that tell a direction follow it"):
        place(guess, samples, 0, 20, np.arange(20))
    with pytest.raises(InputError, match=r"t = 900 s, where no sample is fitted within 60 s; they run from 0 to 540"):
        place(guess, samples, 0, 10, np.arange(20))
    with pytest.raises(InputError, match=r"magnet\.q, which is no number"):
        check_names(Guess(guess.quaternion, guess.rate, guess.t, values={"magnet.q": 1.0}), read_satellite().leaves)
    with pytest.raises(ValueError, match="finite quaternions"):
        Guess(np.zeros((1, 4)), np.zeros((1, 3)), np.zeros(1))
