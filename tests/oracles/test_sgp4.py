"""SGP4 against its published verification set, its frame against the FK5 chain of ERFA, flight elements of the ISS."""

import math
from importlib import resources

import erfa
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from sgp4.api import Satrec

from jaxsat.environment import sgp4_orbit
from jaxsat.environment.orbit.mean_elements import elements_epoch, teme_states, true_from_teme
from jaxsat.time import Epoch, greenwich_angle

# Two of the element sets of 28 January 2022, 7.8 hours apart (telemetry of the Astro Pi computers).
ISS = (
    "1 25544U 98067A   22028.21808647  .00007418  00000-0  13935-3 0  9994",
    "2 25544  51.6438 309.7475 0006790  70.1663  84.4979 15.49675244323476",
)
ISS_LATER = (
    "1 25544U 98067A   22028.54190878  .00007326  00000-0  13770-3 0  9995",
    "2 25544  51.6449 308.1439 0006911  70.4247  91.9832 15.49680064323520",
)
# Of the verification set: on its last orbit.
DECAYING = (
    "1 28872U 05037B   05333.02012661  .25992681  00000-0  24476-3 0  1534",
    "2 28872  96.4736 157.9986 0303955 244.0492 110.6523 16.46015938 10708",
)


def verification_set():
    """Element lines, minutes from epoch, positions [km] and velocities [km/s] of TEME, as printed by Vallado (2006)."""
    folder = resources.files("sgp4")
    lines = [line[:69] for line in folder.joinpath("SGP4-VER.TLE").read_text().splitlines() if line[:2] in ("1 ", "2 ")]
    blocks = []
    for line in folder.joinpath("tcppver.out").read_text().splitlines():
        fields = line.split()
        if len(fields) == 2:
            blocks.append([])
        else:
            blocks[-1].append([float(x) for x in fields[:7]])
    assert len(lines) == 2 * len(blocks)
    return [(*pair, np.array(rows)) for *pair, rows in zip(lines[::2], lines[1::2], blocks, strict=True)]


CASES = verification_set()


# 33334 is there to provoke an error.
@pytest.mark.parametrize(
    "first, second, rows",
    [case for case in CASES if "33334" not in case[0]],
    ids=lambda x: x[2:7] if len(x) == 69 else "",
)
def test_published_vectors(first, second, rows):
    satellite = Satrec.twoline2rv(first, second)
    epoch = elements_epoch(satellite)
    position, velocity = teme_states(satellite, epoch, 60.0 * rows[:, 0])
    # Printed to 1e-8 km and 1e-9 km/s; a day's fraction years from the epoch is rounded to 2e-8 s, at 8 km/s.
    years = np.max(np.abs(rows[:, 0])) > 1e5
    np.testing.assert_allclose(position / 1e3, rows[:, 1:4], rtol=0, atol=3e-7 if years else 5.1e-9)
    np.testing.assert_allclose(velocity / 1e3, rows[:, 4:7], rtol=0, atol=6e-10)


def test_published_turn_from_its_frame():
    # Vallado (2013), example 3-15: the same state in TEME and in the true equator and equinox of date.
    epoch = Epoch.from_utc(2004, 4, 6, 7, 51, 28.386009)
    position_km = np.array([[5094.18016210, 6127.64465950, 6380.34453270]])
    velocity_km_s = np.array([[-4.746131487, 0.785818041, 5.531931288]])
    position, velocity = true_from_teme(1e3 * position_km, 1e3 * velocity_km_s, epoch, np.zeros(1))
    # The mean equinoxes of 1976 and 2006 differ by 0.3" a century: 2e-8 rad in 2004, 0.2 m.
    np.testing.assert_allclose(position / 1e3, [[5094.51478040, 6127.36646120, 6380.34453270]], atol=2e-4)
    np.testing.assert_allclose(velocity / 1e3, [[-4.746088567, 0.786077222, 5.531931288]], atol=2e-7)


@pytest.mark.parametrize("year", [1980, 2000, 2022, 2030])
def test_frame_against_the_chain_of_1976(year):
    """Mean equinox of date to true by `eqeq94`, to J2000 by the theories of 1976/1980, back by those of 2006/2000A."""
    epoch, t_s = Epoch.from_utc(year, 6, 1, 3), np.array([0.0, 40000.0, 864000.0])
    vectors = np.random.default_rng(year).normal(size=(3, 3))
    found, _ = true_from_teme(vectors, np.zeros((3, 3)), epoch, t_s)
    for k, t in enumerate(t_s):
        tt = epoch.shifted(float(t)).tt()
        chain = erfa.pnm06a(*tt) @ erfa.pnm80(*tt).T @ erfa.rz(-erfa.eqeq94(*tt), np.eye(3))
        # The precession of 1976 is wrong by 0.3" a century, the nutation of 1980 by up to 0.06".
        np.testing.assert_allclose(found[k], chain @ vectors[k], rtol=0, atol=1e-6)


def test_ground_track_is_that_of_sgp4():
    satellite = Satrec.twoline2rv(*ISS)
    epoch, t_s = Epoch.from_utc(2022, 1, 28), 7200.0 * np.arange(40)
    teme, _ = teme_states(satellite, epoch, t_s)
    true, _ = true_from_teme(*teme_states(satellite, epoch, t_s), epoch, t_s)
    for k, t in enumerate(t_s):
        now = epoch.shifted(float(t))
        classical = math.atan2(teme[k, 1], teme[k, 0]) - float(erfa.gmst82(now.utc1, now.utc2))
        ours = math.atan2(true[k, 1], true[k, 0]) - greenwich_angle(now)
        assert abs(math.remainder(ours - classical, 2 * math.pi)) < 1e-9
    np.testing.assert_allclose(np.linalg.norm(true, axis=1), np.linalg.norm(teme, axis=1), rtol=1e-14)


def test_orbit_between_its_samples():
    satellite = Satrec.twoline2rv(*ISS)
    epoch = elements_epoch(satellite)
    assert epoch.iso(3) == "2022-01-28T05:14:02.671"
    orbit = sgp4_orbit(satellite, epoch, start=-3600.0, stop=86400.0)
    t_s = np.random.default_rng(1).uniform(-3600.0, 86400.0, 500)
    position, velocity = jax.jit(jax.vmap(orbit))(jnp.asarray(t_s))
    expected = true_from_teme(*teme_states(satellite, epoch, t_s), epoch, t_s)
    # SGP4's velocity leaves the derivative of its position by 0.02 m/s; over a step of 60 s that is up to 0.4 m.
    np.testing.assert_allclose(position, expected[0], atol=0.4)
    np.testing.assert_allclose(velocity, expected[1], atol=0.05)
    with pytest.raises(ValueError, match="times must lie in -3600..86400 s"):
        orbit.check_span(np.array([86461.0]))


def test_leap_second_is_lived_through():
    # One second of UTC more between these instants: the satellite goes on for it, 7.7 km.
    satellite = Satrec.twoline2rv(
        "1 00005U 58002B   16366.50000000  .00000023  00000-0  28098-4 0  4759",
        "2 00005  34.2682 348.7242 1859667 331.7664  19.3264 10.82419157413667",
    )
    noon, after = Epoch.from_utc(2016, 12, 31, 12), Epoch.from_utc(2017, 1, 1)
    assert elements_epoch(satellite).seconds_since(noon) == pytest.approx(0.0, abs=1e-5)
    position, _ = teme_states(satellite, after, np.zeros(1))
    code, expected, _ = satellite.sgp4_tsince((12 * 3600 + 1) / 60)
    assert code == 0
    np.testing.assert_allclose(position[0] / 1e3, expected, atol=1e-5)


def test_successive_flight_elements_agree_to_a_kilometre():
    first, later = (Satrec.twoline2rv(*lines) for lines in (ISS, ISS_LATER))
    epoch = elements_epoch(first)
    gap = elements_epoch(later).seconds_since(epoch)
    t = jnp.linspace(0.0, gap, 200)
    a, b = (jax.jit(jax.vmap(sgp4_orbit(one, epoch, start=0.0, stop=gap)))(t)[0] for one in (first, later))
    distance = np.linalg.norm(np.asarray(a - b), axis=1)
    # 0.1 to 1.6 km over the 42 pairs of that week: the known accuracy of elements of a station in low orbit.
    assert 0.01e3 < np.max(distance) < 2e3


def test_failure_of_sgp4_is_announced_with_its_time():
    satellite = Satrec.twoline2rv(*DECAYING)
    epoch = elements_epoch(satellite)
    sgp4_orbit(satellite, epoch, start=0.0, stop=1200.0)
    with pytest.raises(ValueError, match=r"28872 at 2005-11-29T\d\d:\d\d:\d\d UTC, \+0\.\d\d days.*: .*decayed"):
        sgp4_orbit(satellite, epoch, start=0.0, stop=7200.0)
    refused = Satrec.twoline2rv(*next(case[:2] for case in CASES if "33334" in case[0]))
    with pytest.raises(ValueError, match=r"33334 at .*, \+0\.00 days.*: perturbed eccentricity is outside"):
        sgp4_orbit(refused, elements_epoch(refused), start=0.0, stop=7200.0)
    damaged = Satrec.twoline2rv(ISS[0].replace("22028.2", "22o28.2"), ISS[1])
    with pytest.raises(ValueError):
        sgp4_orbit(damaged, Epoch.from_utc(2022, 1, 28), start=0.0, stop=3600.0)


@pytest.mark.parametrize("start, stop, step", [(0.0, 0.0, 60.0), (100.0, 0.0, 60.0), (0.0, 100.0, 0.0)])
def test_refuses_an_empty_span(start, stop, step):
    with pytest.raises(ValueError, match="start < stop"):
        sgp4_orbit(Satrec.twoline2rv(*ISS), Epoch.from_utc(2022, 1, 28), start=start, stop=stop, step=step)
