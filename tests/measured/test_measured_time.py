"""Time columns: units, epochs, dates, rounded stamps, gaps; starts and rates that the file states."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from measured_files import uff58, write_tdms, write_uff

import rtctl
from rtctl.border.errors import InputError
from rtctl.measured import Dataset, open_dataset, read_dataset
from rtctl.measured.columns.time_axis import straightened, uniform_period
from rtctl.measured.columns.time_column import decimal_step

Write = Callable[..., Path]
K = np.arange(200)
RATE = "sample_rate_hz = 1000.0"
START = np.datetime64("2026-11-21T10:00:00", "ns")


def text_file(folder: Path, stamps: Any, name: str = "t", separator: str = ",") -> None:
    rows = [separator.join([name, "drive", "x_tip"])]
    rows += [separator.join([str(t), repr(0.1 * k), repr(0.2 * k)]) for k, t in enumerate(stamps)]
    (folder / "r00.csv").write_text("\n".join(rows) + "\n")


def read(
    oscillator: Write, folder: Path, stamps: Any, keys: str = 'time = "t"', name: str = "t", **how: Any
) -> Dataset:
    path = oscillator((RATE, keys))
    text_file(folder, stamps, name, **how)
    return read_dataset(path)


@pytest.mark.parametrize(
    ("stamps", "name", "keys"),
    [
        (K, "t [ms]", ""),
        (K, "t (ms)", ""),
        (K / 60e3, "t [min]", ""),
        (1000 * K, "Time (µs)", ""),
        (K, "t", 'time_unit = "ms"'),
        (1000 * K, "t", 'time_unit = "us"'),
        (1_000_000 * K, "t", 'time_unit = "ns"'),
        (K / 86.4e6, "t", 'time_unit = "day"'),
        (K, "t [ms]", 'time_unit = "ms"'),
        ((1_700_000_000.0 + 0.001 * K).tolist(), "t", ""),
        (1_700_000_000_000 + K, "t", 'time_unit = "ms"'),
        (1_700_000_000_000_000 + 1000 * K, "t", 'time_unit = "us"'),
        (1_700_000_000_000_000_000 + 1_000_000 * K, "t", 'time_unit = "ns"'),
        (1_700_000_000_000 + K, "t [ms]", ""),
        (np.datetime_as_string(START + 1_000_000 * K, "ms"), "t", ""),
        (np.char.add(np.datetime_as_string(START + 1_000_000 * K, "ms"), "Z"), "t", ""),
        (np.char.replace(np.datetime_as_string(START + 1_000_000 * K, "us"), "T", " "), "t", ""),
        ([f"23:59:{59 + k // 1000:02d}.{k:03d}" for k in range(900, 1000)], "t", ""),
    ],
    ids=str,
)  # fmt: skip
def test_the_unit_of_time_is_that_of_the_file_or_the_manifest(
    oscillator: Write, tmp_path: Path, stamps: Any, name: str, keys: str
) -> None:
    dataset = read(oscillator, tmp_path, stamps, f'time = "{name}"\n{keys}', name)
    (record,) = dataset.records
    assert record.period_s == pytest.approx(1e-3, rel=1e-5)
    assert (record.samples, dataset.remarks) == (len(stamps), ())


def test_a_unit_in_the_name_of_time_is_taken_and_said(oscillator: Write, tmp_path: Path) -> None:
    dataset = read(oscillator, tmp_path, K, 'time = "t_ms"', "t_ms")
    assert dataset.records[0].period_s == pytest.approx(1e-3)
    assert "is read in ms, which its name ends with" in dataset.remarks[0]
    dataset = read(oscillator, tmp_path, K, 'time = "t_ms"\ntime_unit = "s"', "t_ms")
    assert dataset.records[0].period_s == 1.0
    (said,) = dataset.remarks
    assert "read in s, as time_unit says, though its name ends with ms" in said
    assert read(oscillator, tmp_path, K, 'time = "t_ms"\ntime_unit = "msec"', "t_ms").remarks == ()


@pytest.mark.parametrize(
    ("stamps", "meant"),
    [(17 * 10**11 + K, "ms"), (17 * 10**14 + 1000 * K, "us"), (17 * 10**17 + 10**6 * K, "ns")],
)  # fmt: skip
def test_an_epoch_that_is_no_seconds_is_refused_with_its_unit(
    oscillator: Write, tmp_path: Path, stamps: Any, meant: str
) -> None:
    with pytest.raises(
        InputError, match=f'key time: .* as {meant} since 1970 would.* say time_unit = "{meant}"'
    ):
        read(oscillator, tmp_path, stamps)


@pytest.mark.parametrize("stamps", [K, 45_000.0 + K / 86.4e6 / 1e3])
def test_an_unusual_rate_that_nobody_stated_is_said(oscillator: Write, tmp_path: Path, stamps: Any) -> None:
    if stamps[0]:
        stamps = (1e-9 * K).tolist()
    dataset = read(oscillator, tmp_path, stamps)
    assert 'time column "t" is taken in seconds, as nothing says otherwise' in dataset.remarks[0]
    opened = open_dataset(dataset.path)
    assert opened.remarks == ()
    assert len(list(opened)) == 1
    assert opened.remarks == dataset.remarks
    assert read(oscillator, tmp_path, stamps, 'time = "t"\ntime_unit = "s"').remarks == ()


@pytest.mark.parametrize(
    ("name", "keys", "message"),
    [
        (
            "t [ms]",
            'time_unit = "s"',
            'the file states unit "ms" for column "t [ms]", the manifest time_unit = "s"',
        ),
        ("t [V]", "", 'the file states unit "V" for column "t [V]", which is no time'),
        ("t", 'time_unit = "mm"', 'unit "mm" is not compatible with s'),
        ("t", 'time_unit = "sekunde"', 'unknown unit "sekunde"'),
    ],
)
def test_units_of_time_that_contradict(
    oscillator: Write, tmp_path: Path, name: str, keys: str, message: str
) -> None:
    with pytest.raises(InputError) as caught:
        read(oscillator, tmp_path, K, f'time = "{name}"\n{keys}', name)
    assert message in str(caught.value)


def test_a_time_unit_without_a_time_column(oscillator: Write) -> None:
    with pytest.raises(InputError, match="time_unit is of a time column; name it with time"):
        open_dataset(oscillator((RATE, f'{RATE}\ntime_unit = "ms"')))


@pytest.mark.parametrize("stamp", ["soon", "21.11.2026 10:00", "2026-11-21T10:00:00.5x"])
def test_what_is_no_date_is_told(oscillator: Write, tmp_path: Path, stamp: str) -> None:
    with pytest.raises(InputError, match=r"numbers are needed.* Dates are read as 2026-11-21T10:00:00.001"):
        read(oscillator, tmp_path, [stamp] * 5)


def test_clock_times_go_on_over_midnight(oscillator: Write, tmp_path: Path) -> None:
    stamps = ["23:59:58", "23:59:59", "00:00:00", "00:00:01"]
    (record,) = read(oscillator, tmp_path, stamps).records
    assert record.period_s == pytest.approx(1.0)


@pytest.mark.parametrize("kind", ["s", "ms", "us", "ns"])
@pytest.mark.parametrize("zone", [None, "Europe/Berlin"])
def test_dates_of_parquet(oscillator: Write, tmp_path: Path, kind: str, zone: str | None) -> None:
    step = 1 if kind == "s" else 1_000_000_000
    dates = pa.array(START + step * K * (1_000_000_000 if kind == "s" else 1)).cast(
        pa.timestamp(kind, tz=zone)
    )
    pq.write_table(pa.table({"t": dates, "drive": 0.1 * K, "x_tip": 0.2 * K}), tmp_path / "r00.parquet")
    (record,) = read_dataset(oscillator(('"r00.csv"', '"r00.parquet"'), (RATE, 'time = "t"'))).records
    assert record.period_s == pytest.approx(1.0)


def test_durations_and_dates_of_numpy(oscillator: Write, tmp_path: Path) -> None:
    for stamps in (START + 1_000_000 * K, (1_000_000 * K).astype("timedelta64[ns]")):
        np.savez(tmp_path / "r00.npz", t=stamps, drive=0.1 * K, x_tip=0.2 * K)
        (record,) = read_dataset(oscillator(('"r00.csv"', '"r00.npz"'), (RATE, 'time = "t"'))).records
        assert record.period_s == pytest.approx(1e-3)


def test_a_date_that_is_missing_is_told_with_its_row(oscillator: Write, tmp_path: Path) -> None:
    stamps = START + 1_000_000 * K
    stamps[3] = np.datetime64("NaT")
    np.savez(tmp_path / "r00.npz", t=stamps, drive=0.1 * K, x_tip=0.2 * K)
    with pytest.raises(InputError, match='column "t" has no date in row 3'):
        read_dataset(oscillator(('"r00.csv"', '"r00.npz"'), (RATE, 'time = "t"')))


# ---- rounded stamps


@pytest.mark.parametrize(
    ("rate_hz", "digits"), [(2048, 6), (2048, 4), (3000, 4), (1 / 3, 1), (44_100, 6), (12.8e3, 5)]
)
@pytest.mark.parametrize("cut", [np.round, lambda t, digits: np.floor(t * 10**digits) / 10**digits])
def test_stamps_are_judged_by_their_own_resolution(
    oscillator: Write, tmp_path: Path, rate_hz: float, digits: int, cut: Callable[..., np.ndarray]
) -> None:
    stamps = [f"{t:.{digits}f}" for t in cut(K / rate_hz, digits)]
    if len(set(stamps)) < len(stamps):
        pytest.skip("stamps that coincide are refused elsewhere")
    (record,) = read(oscillator, tmp_path, stamps, 'time = "t"\ntime_unit = "s"').records
    assert record.period_s == pytest.approx(1 / rate_hz, rel=2 * 10.0**-digits * rate_hz / len(K))


def test_a_lost_sample_shows_through_rounded_stamps(oscillator: Write, tmp_path: Path) -> None:
    stamps = np.round((K + (K > 120)) / 2048, 6)
    with pytest.raises(InputError, match=r"is not uniform: after row 120 it goes on by 0\.00097"):
        read(oscillator, tmp_path, stamps)


@given(st.integers(2, 300), st.floats(0.5, 1e4), st.integers(1, 9))
def test_rounding_alone_never_makes_a_column_uneven(count: int, rate_hz: float, digits: int) -> None:
    stamps = np.round(np.arange(count) / rate_hz, digits)
    step = 10.0**-digits
    if step < 0.4 / rate_hz:
        assert uniform_period(stamps, "t", 0, step) == pytest.approx(
            1 / rate_hz, abs=1.1 * step / (count - 1)
        )


@pytest.mark.parametrize(
    ("values", "step"),
    [([0.0, 0.5, 1.2], 0.1), ([0.0, 10.0, 30.0], 10.0), ([0.0, 1 / 3], 0.0), ([1e9, 1e9 + 0.25], 0.01), ([0.0], 1e3)],
)  # fmt: skip
def test_the_decimal_step_of_numbers(values: list[float], step: float) -> None:
    assert decimal_step(np.array(values)) == pytest.approx(step)


# ---- gaps


@pytest.mark.parametrize(("lost", "bridged"), [(1, True), (4, True), (5, False), (1000, False)])
def test_resampling_bridges_no_gap(oscillator: Write, tmp_path: Path, lost: int, bridged: bool) -> None:
    stamps = 0.001 * (K + lost * (K > 100))
    keys = 'time = "t"\nresample = true'
    if bridged:
        assert read(oscillator, tmp_path, stamps.tolist(), keys).records[0].samples == 200 + lost
        return
    with pytest.raises(InputError) as caught:
        read(oscillator, tmp_path, stamps.tolist(), keys)
    assert f"the longest of {0.001 * (lost + 1):.6g} s after row 100" in str(caught.value)
    assert "rows = [0, 101], [101, 200]" in str(caught.value)
    parts = f'{keys}\nrows = [0, 101]\n[[records]]\nfile = "r00.csv"\n{keys}\nrows = [101, 200]'
    assert [one.samples for one in read(oscillator, tmp_path, stamps.tolist(), parts).records] == [101, 99]


LOST = [120, 151]


@pytest.mark.parametrize("rate_hz", [1024.0, 2048.0, 333.3])
def test_lost_rows_do_not_change_the_rate_of_rounded_stamps(oscillator: Write, rate_hz: float) -> None:
    """At 1024 Hz the median of stamps of 6 decimals is 977 us, 1023.54 Hz: every row would be off by more and more."""
    kept = np.delete(np.arange(202), LOST)
    stamps = np.round(5.0 + kept / rate_hz, 6)
    x = np.sin(0.1 * kept)
    manifest = oscillator((RATE, 'time = "t"\nresample = true'), t=stamps, drive=x, x_tip=x)
    (record,) = read_dataset(manifest).records
    assert 1.0 / record.period_s == pytest.approx(rate_hz, rel=1e-7)
    assert record.samples == 202
    np.testing.assert_allclose(record.signals["displacement"][kept], x, atol=1e-7)


def test_uneven_stamps_are_not_straightened() -> None:
    """Neither those that drift nor those that jitter by more than their rounding."""
    t = np.arange(200.0) * 1e-3
    for stamps in (t + 1e-4 * np.sin(40.0 * t), t + 2e-5 * t * np.arange(200.0)):
        np.testing.assert_array_equal(straightened(stamps, "t", 0, 1e-6), stamps)


# ---- columns that begin at different times, rates of the file


def tdms(folder: Path, **of_x_tip: Any) -> None:
    shared = {"wf_increment": 1e-3, "wf_start_offset": 0.0, "wf_start_time": START.astype("datetime64[us]")}
    write_tdms(
        folder / "r00.tdms",
        {"drive": K.astype(float), "x_tip": K.astype(float)},
        {"drive": shared, "x_tip": shared | of_x_tip},
    )


TDMS = ('"r00.csv"', '"r00.tdms"')


@pytest.mark.parametrize(
    "later",
    [{"wf_start_offset": 0.005}, {"wf_start_time": (START + 5_000_000).astype("datetime64[us]")},
     {"wf_start_time": (START + 4_000_000).astype("datetime64[us]"), "wf_start_offset": 0.001}],
)  # fmt: skip
def test_channels_are_aligned_by_their_starts(
    oscillator: Write, tmp_path: Path, later: dict[str, Any]
) -> None:
    tdms(tmp_path, **later)
    dataset = read_dataset(oscillator(TDMS))
    (record,) = dataset.records
    np.testing.assert_array_equal(record.signals["drive"], K[5:])
    np.testing.assert_array_equal(record.signals["displacement"], K[:-5])
    assert 'the first samples are left out, 5 of "drive"' in dataset.remarks[0]
    (part,) = read_dataset(oscillator(TDMS, (RATE, f"{RATE}\nrows = [10, 20]"))).records
    np.testing.assert_array_equal(part.signals["drive"], K[15:25])
    np.testing.assert_array_equal(part.signals["displacement"], K[10:20])
    with pytest.raises(InputError, match="ends after the file's 195 rows"):
        open_dataset(oscillator(TDMS, (RATE, f"{RATE}\nrows = [0, 200]")))


@pytest.mark.parametrize("offset_s", [0.0, 5e-6, -5e-6])
def test_starts_within_a_hundredth_of_a_period_are_one(
    oscillator: Write, tmp_path: Path, offset_s: float
) -> None:
    tdms(tmp_path, wf_start_offset=offset_s)
    dataset = read_dataset(oscillator(TDMS))
    assert (dataset.records[0].samples, dataset.remarks) == (200, ())


def test_starts_that_are_a_part_of_a_period_apart_are_refused(oscillator: Write, tmp_path: Path) -> None:
    tdms(tmp_path, wf_start_offset=0.0023)
    with pytest.raises(
        InputError, match=r'"drive" begins 2.3 sample periods before .* not a whole number of them'
    ):
        open_dataset(oscillator(TDMS))


def test_a_channel_that_begins_after_the_other_has_ended(oscillator: Write, tmp_path: Path) -> None:
    tdms(tmp_path, wf_start_offset=1.0)
    with pytest.raises(InputError, match="the file has no rows"):
        open_dataset(oscillator(TDMS))


@pytest.mark.parametrize(("factor", "agrees"), [(1.0, True), (1.002, False)])
def test_the_rate_of_a_file_needs_no_word_in_the_manifest(
    oscillator: Write, tmp_path: Path, factor: float, agrees: bool
) -> None:
    functions = [uff58(K, id1="drive", increment=5e-4), uff58(K, id1="x_tip", increment=5e-4 * factor)]
    write_uff(tmp_path / "r00.uff", functions)
    path = oscillator(('"r00.csv"', '"r00.uff"'), (RATE, ""))
    if agrees:
        assert read_dataset(path).records[0].period_s == pytest.approx(5e-4)
        return
    with pytest.raises(InputError, match='column "drive" goes on at 2000 Hz'):
        open_dataset(path)


def test_without_a_rate_anywhere_one_is_asked_for(oscillator: Write, tmp_path: Path) -> None:
    write_uff(
        tmp_path / "r00.uff", [uff58(K, id1="drive", increment=0.0), uff58(K, id1="x_tip", increment=0.0)]
    )
    for file in ('"r00.uff"', '"r00.csv"'):
        with pytest.raises(InputError, match="no sample rate: add sample_rate_hz = <Hz>, or time = <column"):
            open_dataset(oscillator(('"r00.csv"', file), (RATE, "")))


def test_a_time_column_is_held_against_the_rate_that_the_file_states(
    oscillator: Write, tmp_path: Path
) -> None:
    columns = {"t": 0.002 * K, "drive": K.astype(float), "x_tip": K.astype(float)}
    write_tdms(tmp_path / "r00.tdms", columns, {"drive": {"wf_increment": 1e-3}})
    with pytest.raises(
        InputError, match=r'the file states 1000 Hz for column "drive".*time column "t" goes on at 500 Hz'
    ):
        read_dataset(oscillator(TDMS, (RATE, 'time = "t"')))


def test_dates_are_not_said_to_be_seconds_that_nobody_stated(tmp_path: Path) -> None:
    rows = "".join(f"2026-03-04 09:{k // 30:02d}:{2 * (k % 30):02d},{k % 7},{k % 5}\n" for k in range(200))
    (tmp_path / "slow.csv").write_text("Horodatage,u [V],x [mm]\n" + rows)
    made = rtctl.init(tmp_path / "slow.csv", plot=False)
    assert [one for one in rtctl.read_dataset(made.path).remarks if "as nothing says otherwise" in one] == []
