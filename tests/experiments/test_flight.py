"""Flight data end to end: the magnetometer of the station however it is turned, its break; the tables of OPS-SAT."""

from pathlib import Path

import numpy as np
import pytest

from experiments.flight import opssat_files
from experiments.flight.clustered import passes, sandwich
from experiments.flight.iss import BEGIN, EXCERPT, FITTED, HERE, HOUR
from fitting.run import fit
from fitting.settings import FitSettings
from jaxsat.satellites import Satellite, read_satellite
from jaxsat.telemetry.table.reading import read_tables

HALF_TURN, QUARTERS = np.diag([-1.0, -1.0, 1.0]), np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def station() -> Satellite:
    found = read_satellite(HERE / "iss.sat.toml")
    assert isinstance(found, Satellite)
    return found


def turned_table(folder: Path, turn: np.ndarray) -> Path:
    """Every tenth row of the excerpt, as a sensor with turned axes would have sent it."""
    header, *rows = EXCERPT.read_text("ascii").splitlines()
    path, lines = folder / "turned.csv", [header]
    for row in rows[::10]:
        stamp, *cells = row.split(",")
        lines.append(",".join([stamp, *(f"{x:.1f}" for x in turn @ np.array(cells, float))]))
    path.write_text("\n".join(lines) + "\n")
    return path


# As it is, the tutorial fits it (docs/tutorials/iss.md).
@pytest.mark.parametrize("turn", [HALF_TURN, QUARTERS], ids=["half a turn", "quarters"])
def test_the_station_s_magnetometer_is_found_however_it_is_turned(tmp_path, turn):
    satellite = station()
    session = read_tables(turned_table(tmp_path, turn), satellite)
    end = session.span_s[1]
    holdout = (end - FITTED) / (end - BEGIN)
    result = fit(satellite, session, settings=FitSettings(arc_s=(BEGIN, end), holdout=holdout), causes=False).result
    channel = result.channels["mag"]
    assert channel.rms is not None and channel.rms < 0.42 and channel.angle_deg is not None and channel.angle_deg < 0.9
    before = ~channel.fitted & (channel.t_s < 8.3 * HOUR)
    assert np.all(np.sqrt(np.nanmean((channel.residual[before] * channel.sigma) ** 2, axis=0)) < 0.6)
    # Nothing is said of the break to the fit; it lies between two rows at 8.86 h.
    (found,) = channel.breaks
    assert found.t_s == pytest.approx(8.86 * HOUR, abs=200.0) and 11.0 < found.turn_deg < 14.0
    assert result.verdict == "fits, does not predict" and any("mag breaks at" in remark for remark in result.remarks)


def test_attitudes_that_stand_still_or_leap_are_marked(tmp_path):
    export = ["# Exported Parameter(s)", "CADC1002,N/A,FLOAT", "2020-11-15 00:00:00.000", "# DATE TIME,CADC1002"]
    angles = [0.0, 3.0, 6.0, 6.0, 6.0, 40.0, 43.0, 46.0]
    for k, angle in enumerate(np.radians(angles)):
        export.append(f"2020-11-15 00:00:{10 * (k % 6):02d}.5".replace("00:00", f"00:{k // 6:02d}"))
        export[-1] += f",{np.cos(angle / 2):.7f},{np.sin(angle / 2):.7f},0.0,0.0"
    export.append("2020-11-15 00:01:20.5,0,0,0,0")
    path = tmp_path / "export.csv"
    path.write_text("\n".join(export))
    found = opssat_files.read_attitude(path)
    assert found[:, 0].tolist() == [0.5 + 10.0 * k for k in range(9)]
    assert found[:, 5].tolist() == [0, 0, 1, 1, 1, 0, 0, 0, 0]
    # The faster of the turns to both neighbours; one of no length has none.
    np.testing.assert_allclose(found[:8, 6], [0.3, 0.3, 0.3, 0.0, 3.4, 3.4, 0.3, 0.3], atol=1e-4)
    assert np.isnan(found[8, 6])


def test_bundled_tables_are_small():
    files = [path for path in (HERE / "data").iterdir() if path.suffix == ".csv"]
    assert len(files) == 3 and all(path.stat().st_size < 300_000 for path in files)


def test_sigmas_by_passes_are_those_of_samples_where_nothing_hangs_together():
    rng = np.random.default_rng(4)
    slopes, noise = rng.normal(size=(4000, 3)), rng.normal(size=4000)
    t = np.arange(4000) * 10.0 + 1e4 * (np.arange(4000) // 20)
    number = passes(t)
    inverse = np.linalg.inv(slopes.T @ slopes)

    def sigmas(noise):
        pulls = np.stack([(slopes * noise[:, None])[number == k].sum(axis=0) for k in range(number[-1] + 1)])
        return np.sqrt(np.diagonal(sandwich(inverse, pulls)))

    assert number[-1] == 199
    np.testing.assert_allclose(sigmas(noise), np.sqrt(np.diagonal(inverse)), rtol=0.2)
    # One error and one slope a pass: twenty samples count as one.
    slopes = np.repeat(slopes[:200], 20, axis=0)
    inverse = np.linalg.inv(slopes.T @ slopes)
    np.testing.assert_allclose(sigmas(np.repeat(noise[:200], 20)), np.sqrt(20.0 * np.diagonal(inverse)), rtol=0.2)
