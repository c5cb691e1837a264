"""skCUBE's tables and the laws of its panels, on made-up frames."""

import csv

import numpy as np

from experiments.flight.asked import Figure
from experiments.flight.skcube import Agreement, Threshold
from experiments.flight.skcube_files import ADCS, CURRENTS, KEPT, POWER, Pass, write_tables


def _frames(path, names, rows):
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, names)
        writer.writeheader()
        writer.writerows([dict.fromkeys(names, "0") | row for row in rows])


def test_angles_count_only_in_full_light_and_passes_are_parted(tmp_path):
    names = ["t_rx", "mode", *KEPT]
    bright = {"sunXp_x": "12", "sunXp_y": "-30", "sunXp_irr": "50", "sunZp_x": "55", "sunZp_irr": "50"}
    _frames(tmp_path / ADCS, names, [{"t_rx": "90"}, {"t_rx": "100", **bright}, {"t_rx": "310"}])
    _frames(tmp_path / POWER, ["t_rx", *CURRENTS, "uBatA"], [{"t_rx": "103", "iXp": "400"}, {"t_rx": "500"}])
    adcs, power = write_tables(tmp_path, tmp_path / "out", Pass("one", 95, 320, True))
    with adcs.open(encoding="utf-8") as stream:
        first, second = csv.DictReader(stream)
    assert (first["t_rx"], first["sunXp_x"], first["sunXp_y"]) == ("100", "12", "-30")
    # Too far off the axis, and dark.
    assert first["sunZp_x"] == first["sunYm_x"] == second["sunXp_x"] == ""
    with power.open(encoding="utf-8") as stream:
        assert [row["t_rx"] for row in csv.DictReader(stream)] == ["103"]


def test_full_sun_is_only_behind_the_shadow():
    t = np.array([3.0, 100.0, 203.0, 204.0])
    assert Pass("one", 0, 1, True).in_full_sun(t).tolist() == [True, True, True, False]
    assert not Pass("one", 0, 1, False).in_full_sun(t).any()


def test_the_law_of_a_threshold_is_found_again():
    modelled = np.random.default_rng(1).uniform(0.0, 500.0, (8, 6))
    measured = np.maximum(1.2 * modelled - 60.0, 0.0)
    law = Threshold.of(measured, modelled)
    assert abs(law.gain - 1.2) < 1e-9 and abs(law.lost_ma - 60.0) < 1e-9
    assert law.agreement(measured, modelled).rms_ma < 1e-9
    plain = Agreement.of(measured, modelled, 500.0)
    assert plain is not None and plain.rms_ma > 10.0
    assert Agreement.of(measured[:0], modelled[:0], 500.0) is None


def test_a_figure_may_be_asked_from_below():
    assert Figure("r", 0.98, "1", 0.97, at_least=True).reached
    assert not Figure("r", 0.96, "1", 0.97, at_least=True).reached
    assert Figure("rms", 0.5, "uT", 0.55).reached and Figure("rms", 0.5, "uT").reached is None
