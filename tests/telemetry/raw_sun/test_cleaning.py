"""Cleaning against the truth of the synthetic sessions: every defect counted, every sample found."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from jaxsat.errors import InputError
from jaxsat.telemetry import CleaningSettings, RawSunFile, Session, check_usable, clean, read_raw_sun
from jaxsat.telemetry.raw_sun.cleaning import DATE, DROPPED, MISMATCH, NO_READING, PANELS, SUM

DATA = Path(__file__).parents[3] / "jaxsat" / "data" / "munin"
SESSIONS = sorted(DATA.glob("*.RAW_SUN"))


def truth(path: Path) -> dict:
    return json.loads(path.with_suffix(".truth.json").read_text())


@pytest.fixture
def raw():
    return read_raw_sun(DATA / "b-specular50.RAW_SUN")


@pytest.mark.parametrize("path", SESSIONS, ids=lambda path: path.stem)
def test_samples_and_epoch_are_those_of_the_truth(path):
    session, true = clean(read_raw_sun(path)), truth(path)
    np.testing.assert_array_equal(session.t_s, true["t"])
    assert session.epoch.iso() == true["cfg"]["start"] + ".000"
    # Noise of 2 mA, 71 x 6 currents: 5 sigma. The exact file has its rounding to 1 mA only.
    limit = 5.0 * np.hypot(true["cfg"]["noise"], 1 / np.sqrt(12.0)) if true["cfg"]["noise"] else 0.5
    good = np.ones(session.t_s.size, dtype=bool)
    if true["cfg"]["clip"]:
        t0, t1 = true["cfg"]["clip"][:2]
        good = (session.t_s < t0) | (session.t_s > t1)
    assert np.max(np.abs(session.currents_mA - np.array(true["currents_clean"]))[good]) <= limit
    check_usable(session)


@pytest.mark.parametrize("path", SESSIONS, ids=lambda path: path.stem)
def test_every_defect_is_counted(path):
    """Expected numbers come from the raw text itself: dates off by a year, sums beyond 1000 mA, readings of 999.9."""
    rows = np.array([[float(x) for x in line.split()] for line in path.read_text().splitlines()[3:]])
    session = clean(read_raw_sun(path))
    wrong_date, absurd = rows[:, 0] != rows[0, 0], rows[:, 24] > 1000.0
    kept = ~wrong_date & ~absurd
    expected = {
        DATE: np.sum(wrong_date),
        SUM: np.sum(absurd & ~wrong_date),
        NO_READING[0]: np.sum(rows[kept, 25] == 999.9),
        NO_READING[1]: np.sum(rows[kept, 26] == 999.9),
    }
    assert session.rejected_by_reason == {reason: n for reason, n in expected.items() if n}
    mess = truth(path)["cfg"]["mess"]
    assert expected[DATE] == mess and expected[SUM] == mess
    by_row = {rejection.row for rejection in session.rejections if rejection.reason in (DATE, SUM)}
    assert by_row == set((np.flatnonzero(wrong_date | absurd) + 4).tolist())
    assert np.sum(session.repeats) == np.sum(kept) and session.repeats.max() == (3 if mess else 1)
    assert np.sum(session.raw_used) == np.sum(kept)
    assert np.all(np.diff(session.t_s) > 0.0)


def test_equal_instants_are_averaged_over_what_is_valid(raw):
    session = clean(raw)
    for k in range(session.t_s.size):
        rows = np.flatnonzero(raw_rows_of(session, k))
        assert rows.size == session.repeats[k]
        np.testing.assert_allclose(session.currents_mA[k], raw.currents_mA[rows].mean(axis=0), atol=1e-12)
        np.testing.assert_allclose(session.position_eci_m[k], 1e3 * raw.position_eci_km[rows].mean(axis=0), atol=1e-6)
        np.testing.assert_allclose(session.velocity_eci_m_s[k], 1e3 * raw.velocity_eci_km_s[rows].mean(0), atol=1e-9)
        for axis in range(2):
            valid = [b for b in raw.magnetometer_uT[rows, axis] if b != 999.9]
            expected = np.mean(valid) if valid else np.nan
            np.testing.assert_allclose(session.b_field_uT[k, axis], expected, atol=1e-12)
    assert np.any(np.isnan(session.b_field_uT))


def raw_rows_of(session, k) -> np.ndarray:
    return session.raw_used & (np.abs(session.raw_t_s - session.t_s[k]) < 1e-3)


def test_absurd_row_does_not_take_its_repeats_with_it(raw):
    session = clean(raw)
    assert np.sum(raw_rows_of(session, int(np.searchsorted(session.t_s, 64.0)))) >= 1
    assert np.max(session.currents_mA) < 300.0


def test_panels_are_put_in_natural_order(raw):
    backwards = dataclasses.replace(raw, currents_mA=raw.currents_mA[:, ::-1])
    session = clean(backwards, CleaningSettings(panel_order=PANELS[::-1]))
    np.testing.assert_array_equal(session.currents_mA, clean(raw).currents_mA)
    order = ("+Z", "-Z", "+X", "-X", "+Y", "-Y")
    session = clean(raw, CleaningSettings(panel_order=order))
    np.testing.assert_array_equal(session.currents_mA, clean(raw).currents_mA[:, [2, 3, 4, 5, 0, 1]])


def test_row_order_does_not_matter(raw):
    """All but the first row shuffled; sums of repeats may then round differently."""
    order = np.concatenate([[0], 1 + np.random.default_rng(0).permutation(raw.row.size - 1)])
    arrays = {f.name: getattr(raw, f.name)[order] for f in dataclasses.fields(raw) if f.name not in NOT_ROWS}
    shuffled, session = clean(dataclasses.replace(raw, **arrays)), clean(raw)
    np.testing.assert_array_equal(shuffled.t_s, session.t_s)
    np.testing.assert_allclose(shuffled.currents_mA, session.currents_mA, rtol=1e-14)
    assert shuffled.rejections == session.rejections


NOT_ROWS = ("path", "sha256", "satellite", "tle")


def rows_of(raw, keep) -> RawSunFile:
    return dataclasses.replace(
        raw, **{f.name: getattr(raw, f.name)[keep] for f in dataclasses.fields(raw) if f.name not in NOT_ROWS}
    )


def test_epoch_is_the_earliest_sample_even_if_the_first_row_is_later(raw):
    latest = np.argmax(clean(raw).raw_t_s * clean(raw).raw_used)
    order = np.concatenate([[latest], np.delete(np.arange(raw.row.size), latest)])
    assert clean(rows_of(raw, order)).epoch.iso() == "2001-01-18T04:54:15.000"


def test_samples_left_out_by_hand(raw):
    session = clean(raw, CleaningSettings(drop_s=((0.0, 64.0), (1000.0, 1100.0))))
    whole = clean(raw)
    gone = (whole.t_s <= 64.0) | ((whole.t_s >= 1000.0) & (whole.t_s <= 1100.0))
    np.testing.assert_array_equal(session.t_s, whole.t_s[~gone])
    assert session.epoch == whole.epoch, "leaving samples out does not move the time scale"
    assert session.rejected_by_reason[DROPPED] == np.sum(whole.repeats[gone])
    moved = session.with_time_zero(100.0)
    assert moved.epoch.iso() == "2001-01-18T04:55:55.000" and moved.t_s[0] == session.t_s[0] - 100.0


def test_sum_that_disagrees_with_its_currents(raw):
    total = raw.current_sum_mA.copy()
    total[5] += 150.0
    session = clean(dataclasses.replace(raw, current_sum_mA=total))
    assert [r.row for r in session.rejections if r.reason == MISMATCH] == [9]
    assert "150 mA" in [r.detail for r in session.rejections if r.reason == MISMATCH]


def test_wrong_date_in_the_first_row_is_said(raw):
    time = raw.sample_time.copy()
    time[0, 0] = 2000
    with pytest.raises(InputError, match=r":4: sample date: is more than 1 days from 15[0-9] of the 155 rows"):
        clean(dataclasses.replace(raw, sample_time=time))


def test_nothing_left_is_one_line_with_the_reasons(raw):
    with pytest.raises(InputError, match=r"no sample is left of 155 rows: absurd sum of currents \(\d+\), date"):
        clean(dataclasses.replace(raw, currents_mA=raw.currents_mA + 500.0))
    with pytest.raises(InputError, match=r"left out by hand \(153\)"):
        clean(raw, CleaningSettings(drop_s=((-10.0, 1e5),)))


def with_currents(raw, change) -> Session:
    currents = raw.currents_mA.copy()
    currents[raw.current_sum_mA > 1000.0] = 0.0
    change(currents)
    return clean(dataclasses.replace(raw, currents_mA=currents, current_sum_mA=currents.sum(axis=1)))


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda c: c.fill(0.0), "all 71 samples are in shadow: no current exceeds 2 mA"),
        (lambda c: c.fill(1.0), "all 71 samples are in shadow"),
    ],
    ids=["dark", "dark current"],
)
def test_unusable_sessions(raw, change, expected):
    with pytest.raises(InputError, match=f"{raw.path.name}: currents: .*{expected}"):
        check_usable(with_currents(raw, change))


def test_settings_are_checked():
    with pytest.raises(ValueError, match=r"panel_order\n.*expected each of"):
        CleaningSettings(panel_order=("+X",) * 6)
    with pytest.raises(ValueError, match=r"max_field_uT\n.*finite"):
        CleaningSettings(max_field_uT=float("nan"))
    with pytest.raises(ValueError, match=r"expected \[t0, t1\] with t0 < t1"):
        CleaningSettings(drop_s=((2.0, 1.0),))
