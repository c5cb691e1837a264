"""Whole files that the attacks begin with, one or more of each kind that is read."""

import json
import subprocess
import sys
from pathlib import Path

from jaxsat.bundled import BUNDLED

LINES = (
    "1 25544U 98067A   20366.85235953  .00001264  00000-0  29621-4 0  9994",
    "2 25544  51.6461  24.1230 0001027 190.2420 288.5610 15.49507896262357",
)
FIELDS = {
    **{"OBJECT_NAME": "ISS (ZARYA)", "OBJECT_ID": "1998-067A", "CENTER_NAME": "EARTH", "REF_FRAME": "TEME"},
    **{"TIME_SYSTEM": "UTC", "MEAN_ELEMENT_THEORY": "SGP4", "EPOCH": "2020-12-31T20:27:23.863392"},
    **{"MEAN_MOTION": "15.49507896", "ECCENTRICITY": "0.0001027", "INCLINATION": "51.6461"},
    **{"RA_OF_ASC_NODE": "24.1230", "ARG_OF_PERICENTER": "190.2420", "MEAN_ANOMALY": "288.5610"},
    **{"EPHEMERIS_TYPE": "0", "CLASSIFICATION_TYPE": "U", "NORAD_CAT_ID": "25544", "ELEMENT_SET_NO": "999"},
    **{"REV_AT_EPOCH": "26235", "BSTAR": "0.29621E-4", "MEAN_MOTION_DOT": "0.1264E-4", "MEAN_MOTION_DDOT": "0"},
}
SATELLITE = """
name = "Test"
[body]
size_m = [0.1, 0.1, 0.3]
inertia_kg_m2 = {value = [0.002, 0.002, 0.001], sigma = 0.0002}
[magnet]
dipole_A_m2 = {value = [0.1, 0.0, 0.0], sigma = 0.05}
[time]
column = "t"
form = "seconds"
epoch = "2024-03-01T12:00:00"
[orbit.elements]
epoch = "2024-03-01T12:00:00"
a_km = 6900.0
e = 0.001
i_deg = 97.5
raan_deg = 30.0
argp_deg = 10.0
mean_anomaly_deg = 80.0
[sensors.mag]
kind = "magnetometer"
bias = {value = [0.0, 0.0, 0.0], sigma = 2000.0}
[channels.mag]
columns = ["bx", "by", "bz"]
unit = "nT"
sigma = 300.0
[rows]
keep = ["abs(bx) < 60000", "mode == 0"]
"""
TABLE = "t,mode,bx,by,bz\n" + "".join(f"{5 * k},0,{200 * k},{-100 * k},{30000 - k}\n" for k in range(40))
GIVEN = """
[orbit]
inclination_deg = 95.4
raan_deg = 64.8
argument_of_perigee_deg = 16.7
eccentricity = 0.07
semi_major_axis_km = 7630.0
argument_of_latitude_deg = -159.3
[time]
zero_s = 10.0
[earth]
radius_km = 6371.2
greenwich_angle_deg = 191.28
[sun]
direction_eci = [0.47176670, -0.80932067, -0.34990890]
"""
NUMBERS = """
[spacecraft]
imax_mA = 250.0
[albedo]
specular = 0.1
"""
PLAN = {
    **{"schema": "jaxsat.sweep-plan/1", "scenario": "gravity-gradient", "seed": 1, "options": {"rate_deg_s": "0.1"}},
    **{"chunk": 1024, "cases": 2000, "versions": {"python": "3.11.7", "jax": "0.10.2"}},
}
GUESS = """t_s,utc,solution,q_w,q_x,q_y,q_z,sigma_deg,status,reason
0,2001-01-18T04:54:15.000,1,0.44,0.15,-0.59,-0.66,3.5,solved,
64,2001-01-18T04:55:19.000,1,0.41,0.33,-0.61,-0.58,3.5,solved,
128,2001-01-18T04:56:23.000,,,,,,,unsolved,"no panel, no light"
"""
GUESS_TOML = """
utc = "2001-01-18T04:54:15"
quaternion = [0.41, 0.11, -0.61, -0.67]
rate_deg_s = [0.7, 0.1, 0.0]
attitude_sigma_deg = 10.0
[parameters]
imax = 250.0
magnet.x = 0.3
"""
RUN_FILES = ("fit.json", "provenance.json", "scene.json", "attitude.csv", "channel-cells.csv")


def written() -> dict[str, list[bytes]]:
    """Contents by kind of what is written by hand."""
    kvn = "CCSDS_OMM_VERS = 2.0\n" + "".join(f"{key} = {value}\n" for key, value in FIELDS.items())
    groups = list(FIELDS.items())
    tags = ["".join(f"<{k}>{v}</{k}>\n" for k, v in part) for part in (groups[:6], groups[6:])]
    xml = (
        '<?xml version="1.0" encoding="UTF-8"?>\n<ndm><omm id="CCSDS_OMM_VERS" version="2.0"><header/><body><segment>'
        f"<metadata>{tags[0]}</metadata><data>{tags[1]}</data></segment></body></omm></ndm>\n"
    )
    rows = [",".join(FIELDS), ",".join(FIELDS.values()), ",".join(FIELDS.values())]
    made: dict[str, list[str]] = {
        "tle": [f"ISS (ZARYA)\n{LINES[0]}\n{LINES[1]}\n0 OTHER\n{LINES[0]}\n{LINES[1]}\n", "\n".join(LINES)],
        "omm kvn": [kvn, kvn + kvn],
        "omm xml": [xml],
        "omm json": [json.dumps([FIELDS, FIELDS])],
        "omm csv": ["\n".join(rows) + "\n"],
        "limb": ["utc,distance_deg,turn_deg\n2001-01-18T04:54:15,10.5,20\n2001-01-18T04:55:19,,30\n"],
        "table": [TABLE],
        "satellite": [SATELLITE],
        "numbers": [NUMBERS],
        "given": [GIVEN],
        "plan": [json.dumps(PLAN, indent=2)],
        "guess": [GUESS],
        "guess toml": [GUESS_TOML],
    }
    found = {kind: [text.encode() for text in texts] for kind, texts in made.items()}
    return {**found, "raw_sun": [b"\n".join(BUNDLED.read_bytes().split(b"\n")[:15]) + b"\n"]}


def sources(folder: Path) -> dict[str, list[bytes]]:
    """All contents by kind; a fit of a session and its export are made in `folder`, if not there already."""
    found, run, out = written(), folder / "run", folder / "export"
    if not (run / "fit.json").exists():
        # One that the motion alone explains: a fit that is denied ends with another status than 0.
        session = BUNDLED.with_name("a-nominal-exact.RAW_SUN")
        command("fit", str(session), "--free", "state", "--no-plots", "--out", str(run))
    if not out.exists():
        formats = [x for name in ("aem", "aem1", "oem") for x in ("--format", name)]
        command("export", str(run), *formats, "--out", str(out))
    found["oem"] = [_short(out / "orbit.oem"), _segments(_short(out / "orbit.oem"))]
    found["aem"] = [_short(out / "attitude.aem"), _short(out / "attitude-v1.aem")]
    for name in RUN_FILES:
        found[f"view {name}"] = [(run / name).read_bytes()]
    return found


def command(*arguments: str) -> None:
    """Runs `jaxsat` to its end."""
    subprocess.run([str(Path(sys.executable).with_name("jaxsat")), *arguments], check=True, capture_output=True)


def _short(path: Path, lines: int = 12) -> bytes:
    """A message with its first lines of data, and the span that they have."""
    text = path.read_text().split("\n")
    data = [k for k, line in enumerate(text) if line[:2] == "20"]
    last = text[data[lines - 1]].split()[0]
    kept = [line for k, line in enumerate(text) if k not in data[lines:]]
    return "\n".join(f"{x[: x.index('=')]}= {last}" if x.startswith("STOP_TIME") else x for x in kept).encode()


def _segments(message: bytes) -> bytes:
    """A message of version 3.0 with a second segment, of another satellite, and with a covariance."""
    second = message[message.index(b"META_START") :].replace(b"= MUNIN", b"= OTHER").rstrip() + b"\n"
    rows = "\n".join(" ".join(["1e-3"] * k) for k in range(1, 7))
    epoch = message[message.index(b"START_TIME") :].split(b"=")[1].split()[0].decode()
    covariance = f"COVARIANCE_START\nEPOCH = {epoch}\nCOV_REF_FRAME = RTN\n{rows}\nCOVARIANCE_STOP\n"
    return message.replace(b"VERS = 2.0", b"VERS = 3.0").rstrip() + b"\n\n" + second + covariance.encode()
