"""The orbit that a satellite file names, against SGP4, ERFA and SciPy; motions known beforehand."""

import erfa
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from sgp4.api import Satrec

from jaxsat.constants import EARTH_MU
from jaxsat.errors import InputError
from jaxsat.telemetry import OrbitEphemeris, motion_for, oem_text, orbit_for, read_telemetry
from jaxsat.time import Epoch

TLE = (
    "1 99001U 21001A   20326.72226509  .00001924  00000-0  13588-3 0  9993",
    "2 99001  82.1924 107.1117 0028351 295.3535 124.0543 15.40668907    12",
)
EPOCH = Epoch.from_iso("2020-11-21T20:58:01Z")
ROWS = "utc,bx,by,bz\n2020-11-21T20:58:01Z,1,2,3\n2020-11-21T21:38:01Z,1,2,3\n"
TIMES = np.array([-60.0, 0.0, 777.7, 2400.0, 2460.0])


def states(orbit):
    return [np.asarray(each) for each in jax.vmap(orbit)(jnp.asarray(TIMES))]


def sgp4_of_date(times):
    """SGP4's positions with the equation of the equinoxes by ERFA [m]."""
    satellite = Satrec.twoline2rv(*TLE)
    utc1, utc2 = EPOCH.utc1, EPOCH.utc2
    found = []
    for t in times:
        _, position, _ = satellite.sgp4(utc1, utc2 + t / 86400.0)
        tt1, tt2 = EPOCH.shifted(float(t)).tt()
        ut1 = EPOCH.shifted(float(t)).ut1()
        angle = erfa.gst06a(*ut1, tt1, tt2) - erfa.gmst82(*ut1)
        turn = Rotation.from_rotvec([0.0, 0.0, angle])
        found.append(turn.apply(np.array(position) * 1e3))
    return np.array(found)


@pytest.fixture
def session(table):
    return lambda satellite: read_telemetry(table(ROWS), satellite)


@pytest.mark.parametrize("given", ["file", "lines", "both sets"])
def test_element_sets(table, satellite, session, given):
    if given == "lines":
        orbit = "[orbit]\ntle = [" + ", ".join(f'"{line}"' for line in TLE) + "]\n"
    else:
        # An older set of another orbit stands before it: the nearest in time counts.
        older = (TLE[0].replace("20326", "20320")[:68] + "7", TLE[1])
        lines = [*older, *TLE] if given == "both sets" else ["A NAME", *TLE]
        table("\n".join(lines) + "\n", "sat.tle")
        orbit = '[orbit]\ntle = "sat.tle"\n'
    found = satellite(orbit=orbit)
    position, _ = states(orbit_for(found, session(found)))
    assert np.allclose(position, sgp4_of_date(TIMES), rtol=0, atol=1.0)


def test_kepler_elements(satellite, session):
    found = satellite(
        orbit="[orbit]\nelements = {a_km = 6900, e = 0.01, i_deg = 97, raan_deg = 20, argp_deg = 10,"
        ' mean_anomaly_deg = 5, epoch = "2020-11-21T20:00:00Z"}\n'
    )
    position, velocity = states(orbit_for(found, session(found)))

    def slope(_, y):
        return [*y[3:], *(-EARTH_MU * y[:3] / np.linalg.norm(y[:3]) ** 3)]

    # From the perigee of the ellipse, flown by another integrator.
    turn = Rotation.from_euler("ZXZ", [20, 97, 10], degrees=True)
    a, e = 6.9e6, 0.01
    start = np.array([a * (1 - e), 0, 0]), np.array([0, np.sqrt(EARTH_MU / a * (1 + e) / (1 - e)), 0])
    after_perigee = np.radians(5) / np.sqrt(EARTH_MU / a**3) + 3481.0 + TIMES
    flown = solve_ivp(
        slope,
        (0, after_perigee[-1]),
        np.concatenate([turn.apply(x) for x in start]),
        "DOP853",
        after_perigee,
        rtol=1e-12,
    )
    assert np.allclose(position, flown.y[:3].T, rtol=0, atol=0.1)
    assert np.allclose(velocity, flown.y[3:].T, rtol=0, atol=1e-4)


def test_ephemeris(table, tmp_path, satellite, session):
    t = np.concatenate([np.arange(-400.0, 1000.0, 60.0), np.arange(1030.0, 3000.0, 90.0)])
    position, velocity = kepler_states(t)
    to_gcrf = np.transpose([erfa.pnm06a(*EPOCH.shifted(float(each)).tt()) for each in t], (0, 2, 1))
    ephemeris = OrbitEphemeris(
        object_name="ONE",
        object_id="2021-001A",
        frame="GCRF",
        epoch=EPOCH,
        t_s=t,
        position_m=np.einsum("nij,nj->ni", to_gcrf, position),
        velocity_m_s=np.einsum("nij,nj->ni", to_gcrf, velocity),
    )
    (tmp_path / "sat.oem").write_text(oem_text(ephemeris, created=EPOCH))
    found = satellite(orbit='[orbit]\noem = "sat.oem"\n')
    expected, rates = kepler_states(TIMES)
    position, velocity = states(orbit_for(found, session(found)))
    assert np.allclose(position, expected, rtol=0, atol=0.01) and np.allclose(velocity, rates, rtol=0, atol=1e-4)
    with pytest.raises(InputError, match=r"sat.oem: no segment reaches over the session"):
        orbit_for(found, read_telemetry(table(ROWS.replace("T21:38", "T22:38")), found))


def kepler_states(t):
    """Positions and velocities on a circle, by hand."""
    radius = 6.9e6
    n = np.sqrt(EARTH_MU / radius**3)
    turn = Rotation.from_euler("ZX", [20, 97], degrees=True)
    c, s, zero = np.cos(n * t), np.sin(n * t), np.zeros_like(t)
    return turn.apply(radius * np.stack([c, s, zero], 1)), turn.apply(radius * n * np.stack([-s, c, zero], 1))


@pytest.mark.parametrize("frame", ["eci", "gcrf", "ecef"])
def test_positions_of_the_table(table, satellite, frame):
    t = np.concatenate([np.arange(0.0, 900.0, 7.0), np.arange(1500.0, 2401.0, 7.0)])
    t = np.append(t, 2400.0)
    position, _ = kepler_states(t)
    if frame == "gcrf":
        matrices = [erfa.pnm06a(*EPOCH.shifted(float(each)).tt()).T for each in t]
    elif frame == "ecef":
        angles = [erfa.gst06a(*EPOCH.shifted(float(x)).ut1(), *EPOCH.shifted(float(x)).tt()) for x in t]
        matrices = [Rotation.from_rotvec([0, 0, -angle]).as_matrix() for angle in angles]
    else:
        matrices = [np.eye(3)] * len(t)
    position = np.einsum("nij,nj->ni", matrices, position)
    stamps = EPOCH.iso_texts(t)
    lines = [
        f"{stamp}Z,1,2,3,{x / 1e3:.3f},{y / 1e3:.3f},{z / 1e3:.3f}"
        for stamp, (x, y, z) in zip(stamps, position, strict=True)
    ]
    orbit = f'[orbit.columns]\nposition = ["x", "y", "z"]\nunit = "km"\nframe = "{frame}"\n'
    found = satellite(orbit=orbit)
    session = read_telemetry(table("utc,bx,by,bz,x,y,z\n" + "\n".join(lines) + "\n"), found)
    expected, rates = kepler_states(TIMES)
    position, velocity = states(orbit_for(found, session))
    # Rounding to a metre; a hole of ten minutes; a minute beyond the ends.
    assert np.allclose(position, expected, rtol=0, atol=20.0) and np.allclose(velocity, rates, rtol=0, atol=0.3)


def test_positions_that_are_none(table, satellite):
    found = satellite(orbit='[orbit.columns]\nposition = ["x", "y", "z"]\nunit = "m"\nframe = "eci"\n')
    path = table("utc,bx,by,bz,x,y,z\n" + "".join(f"2020-11-21T20:0{k}:00Z,1,2,3,6900,{k},0\n" for k in range(9)))
    with pytest.raises(InputError, match=r"positions beyond the Earth, found 6.9 km at 0 s; is the unit right"):
        orbit_for(found, read_telemetry(path, found))
    few = table(path.read_text().replace("6900", "6900000").rsplit("\n", 5)[0] + "\n")
    with pytest.raises(InputError, match="at least 6 positions a minute apart, found 5"):
        orbit_for(found, read_telemetry(few, found))


def test_orbits_that_are_not_there(table, satellite, session):
    found = satellite(orbit='[orbit]\ntle = "nowhere.tle"\n')
    with pytest.raises(InputError, match="nowhere.tle: no such file"):
        orbit_for(found, session(found))
    found = satellite(orbit=f'[orbit]\ntle = ["{TLE[0]}", "{TLE[1][:-1]}3"]\n')
    with pytest.raises(InputError, match="sat.toml: orbit.tle: TLE checksum: is 3"):
        orbit_for(found, session(found))


@pytest.mark.parametrize("sense", ["inertial_from_body", "body_from_inertial"])
@pytest.mark.parametrize("scalar", ["first", "last"])
def test_a_given_motion(table, satellite, sense, scalar):
    true = Rotation.from_rotvec([[0.1, 0.2, 0.3], [0.2, -3.0, 0.3]])
    frame = [erfa.pnm06a(*EPOCH.shifted(t).tt()) for t in (0.0, 2.0)]
    told = Rotation.from_matrix(np.transpose(frame, (0, 2, 1))) * true
    told = told.inv() if sense == "body_from_inertial" else told
    q = told.as_quat() if scalar == "last" else np.roll(told.as_quat(), 1, axis=1)
    lines = [
        f"{stamp}Z,1,2,3,{','.join(map(repr, map(float, row)))}"
        for stamp, row in zip(EPOCH.iso_texts(np.array([0.0, 2.0])), q, strict=True)
    ]
    motion = f'[motion]\nkind = "given"\ncolumns = ["a", "b", "c", "d"]\nsense = "{sense}"\nscalar = "{scalar}"\n'
    found = satellite(more=motion + 'frame = "gcrf"\n')
    session = read_telemetry(table("utc,bx,by,bz,a,b,c,d\n" + "\n".join(lines) + "\n"), found)
    assert session.motion is not None
    t, quaternions = session.motion
    assert t.tolist() == [0.0, 2.0]
    apart = Rotation.from_quat(np.roll(quaternions, -1, axis=1)).inv() * true
    assert np.max(apart.magnitude()) < 1e-12
    assert motion_for(found, session, orbit_for(found, session)) is session.motion


def test_a_quaternion_that_is_none(table, satellite):
    motion = '[motion]\nkind = "given"\ncolumns = ["a", "b", "c", "d"]\nsense = "inertial_from_body"\n'
    path = table("utc,bx,by,bz,a,b,c,d\n2020-11-21T20:58:01Z,1,2,3,1,1,0,0\n")
    with pytest.raises(InputError, match="pass.csv: a: expected unit quaternions, found one of length 1.414 at 0 s"):
        read_telemetry(path, satellite(more=motion))


def test_a_motion_fixed_to_the_orbital_frame(satellite, session):
    found = satellite(more='[motion]\nkind = "orbital"\n')
    known = session(found)
    orbit = orbit_for(found, known)
    motion = motion_for(found, known, orbit)
    assert motion is not None
    t, q = motion
    assert t[0] == -60.0 and t[-1] == 2460.0
    body = Rotation.from_quat(np.roll(q, -1, axis=1))
    position, velocity = (np.asarray(each) for each in jax.vmap(orbit)(jnp.asarray(t)))
    assert np.allclose(body.apply([0, 0, 1]), -position / np.linalg.norm(position, axis=1, keepdims=True), atol=1e-12)
    normal = np.cross(position, velocity)
    assert np.allclose(body.apply([0, -1, 0]), normal / np.linalg.norm(normal, axis=1, keepdims=True), atol=1e-12)
    assert np.all(np.sum(body.apply([1, 0, 0]) * velocity, axis=1) > 0.99 * np.linalg.norm(velocity, axis=1))
    assert np.min(np.sum(q[1:] * q[:-1], axis=1)) > 0.99
