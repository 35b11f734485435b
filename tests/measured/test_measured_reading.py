"""A manifest and its files become records in the units that the program holds."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rtctl.border.errors import InputError
from rtctl.measured import Record, open_dataset, read_dataset

Write = Callable[..., Path]


def test_a_vo2_is_held_in_mA_ohm_um_whatever_its_files_use(
    vo2: Write, staircase: dict[str, np.ndarray]
) -> None:
    dataset = read_dataset(vo2())
    (record,) = dataset.records
    np.testing.assert_allclose(record.signals["current"], 1e3 * staircase["current"], rtol=1e-12)
    np.testing.assert_allclose(record.signals["resistance"], 1e3 * staircase["resistance"], rtol=1e-12)
    np.testing.assert_allclose(record.signals["deflection"], 1e3 * staircase["deflection"], rtol=1e-12)
    assert dataset.units == {"current": "mA", "resistance": "ohm", "deflection": "um"}


def test_an_oscillator_keeps_the_units_of_its_manifest(
    oscillator: Write, shaker: dict[str, np.ndarray]
) -> None:
    dataset = read_dataset(oscillator())
    np.testing.assert_array_equal(dataset.records[0].signals["displacement"], shaker["x_tip"])
    assert dataset.units == {"drive": "m/s^2", "displacement": "mm"}


def test_velocity_is_held_in_the_unit_of_displacement_per_second(oscillator: Write) -> None:
    velocity = np.linspace(0.0, 1.0, 200)
    table = ("[[records]]", '[signals.velocity]\nrole = "output"\nunit = "m/s"\ncolumn = "v"\n[[records]]')
    dataset = read_dataset(oscillator(table, v=velocity))
    np.testing.assert_allclose(dataset.records[0].signals["velocity"], 1e3 * velocity, rtol=1e-12)
    assert dataset.units["velocity"] == "mm/s"


@pytest.mark.parametrize(
    ("drive", "displacement", "velocity", "factor"),
    [
        ("V", "V", "V/s", 1.0),
        ("N", "m", "mm/s", 1e-3),
        ("m/s^2", "mm", "m/s", 1e3),
        ("mA", "um", "m/min", 1e6 / 60.0),
        ("A/m", "rad", "rad/ms", 1e3),
        ("dimensionless", "inch", "inch/s", 1.0),
    ],
)
def test_an_oscillator_may_be_measured_in_any_units(
    oscillator: Write, drive: str, displacement: str, velocity: str, factor: float
) -> None:
    tables = [
        ('unit = "m/s^2"', f'unit = "{drive}"'),
        ('unit = "mm"', f'unit = "{displacement}"'),
        (
            "[[records]]",
            f'[signals.velocity]\nrole = "output"\nunit = "{velocity}"\ncolumn = "v"\n[[records]]',
        ),
    ]
    dataset = read_dataset(oscillator(*tables, v=np.ones(200)))
    assert dataset.units == {"drive": drive, "displacement": displacement, "velocity": f"{displacement}/s"}
    np.testing.assert_allclose(dataset.records[0].signals["velocity"], factor, rtol=1e-12)


@pytest.mark.parametrize("hold", ["linear", "zero", "band-limited"])
def test_every_hold_of_the_drive_arrives(oscillator: Write, hold: str) -> None:
    table = ('unit = "m/s^2"', f'unit = "m/s^2"\nhold = "{hold}"')
    assert read_dataset(oscillator(table)).holds == {"drive": hold}


def test_signals_tell_role_unit_and_hold_with_linear_as_the_default(oscillator: Write, vo2: Write) -> None:
    assert read_dataset(oscillator()).signals["drive"] == ("input", "m/s^2", "linear")
    assert read_dataset(vo2()).signals["current"] == ("input", "mA", "zero")
    assert read_dataset(vo2()).signals["resistance"] == ("output", "ohm", None)


def test_a_bare_number_in_initial_is_in_the_unit_of_its_signal(oscillator: Write) -> None:
    table = ("[[records]]", '[signals.velocity]\nrole = "output"\nunit = "m/s"\ncolumn = "v"\n[[records]]')
    state = ("= 1000.0", "= 1000.0\ninitial = { displacement = 0.5, velocity = 0.25 }")
    (record,) = read_dataset(oscillator(table, state, v=np.zeros(200))).records
    assert record.initial == {"displacement": 0.5, "velocity": 250.0}


def test_every_key_of_a_record_arrives(oscillator: Write, shaker: dict[str, np.ndarray]) -> None:
    keys = """sample_rate_hz = 500.0
rows = [20, 120]
ignore_first = 7
use = "test"
repeat = "A"
initial = { displacement = "1 cm", velocity = 2.5 }
conditions = { frequency_hz = 10.25 }"""
    (record,) = read_dataset(oscillator(("sample_rate_hz = 1000.0", keys))).records
    np.testing.assert_array_equal(record.signals["drive"], shaker["drive"][20:120])
    assert (record.period_s, record.ignore_first, record.use, record.repeat) == (0.002, 7, "test", "A")
    assert record.initial == {"displacement": 10.0, "velocity": 2.5}
    assert record.conditions == {"frequency_hz": 10.25}


def test_conditions_of_the_dataset_hold_unless_the_record_says_otherwise(oscillator: Write) -> None:
    heading = ('plant = "oscillator"', 'plant = "oscillator"\nconditions = { air = "dry", lid = "open" }')
    record = ("= 1000.0", '= 1000.0\nconditions = { lid = "shut" }')
    assert read_dataset(oscillator(heading, record)).records[0].conditions == {"air": "dry", "lid": "shut"}


def test_the_identity_of_the_device_arrives(vo2: Write) -> None:
    assert read_dataset(vo2()).identity == ""
    assert read_dataset(vo2(('plant = "vo2"', 'plant = "vo2"\nidentity = "sim-a"'))).identity == "sim-a"


def test_a_record_without_the_reference_instrument_has_no_deflection(vo2: Write, tmp_path: Path) -> None:
    second = '[[records]]\nfile = "bare.csv"\nsample_rate_hz = 10.0\n[[records]]\nfile = "r00.csv"'
    path = vo2(('[[records]]\nfile = "r00.csv"', second))
    (tmp_path / "bare.csv").write_text("current,resistance\n0.004,100\n0.005,90\n")
    bare, whole = read_dataset(path).records
    assert (bare.has("deflection"), whole.has("deflection")) == (False, True)


def test_an_instrument_that_gave_nothing_but_nan_counts_as_absent(vo2: Write, tmp_path: Path) -> None:
    second = '[[records]]\nfile = "bare.csv"\nsample_rate_hz = 10.0\n[[records]]\nfile = "r00.csv"'
    path = vo2(('[[records]]\nfile = "r00.csv"', second))
    (tmp_path / "bare.csv").write_text("current,resistance,deflection\n0.004,100,nan\n0.005,90,\n")
    assert [record.has("deflection") for record in read_dataset(path).records] == [False, True]


def test_records_of_one_file_are_named_by_their_rows(oscillator: Write) -> None:
    more = (
        '= 1000.0\nrows = [0, 50]\n[[records]]\nfile = "r00.csv"\nrows = [50, 200]\nsample_rate_hz = 1000.0'
    )
    dataset = read_dataset(oscillator(("= 1000.0", more)))
    assert [record.name for record in dataset.records] == ["r00_0-50", "r00_50-200"]
    assert [record.file for record in dataset.records] == ["r00.csv", "r00.csv"]


def test_the_uses_of_records_are_told_apart(oscillator: Write) -> None:
    more = '= 1000.0\n[[records]]\nname = "b"\nfile = "r00.csv"\nuse = "test"\nsample_rate_hz = 1000.0'
    dataset = read_dataset(oscillator(("= 1000.0", more)))
    assert [record.name for record in dataset.used_for("test")] == ["b"]
    assert [record.name for record in dataset.used_for("fit")] == ["r00"]


def test_a_uniform_time_column_gives_the_period(oscillator: Write) -> None:
    time_s = 3.0 + 0.002 * np.arange(200)
    (record,) = read_dataset(oscillator(("sample_rate_hz = 1000.0", 'time = "t"'), t=time_s)).records
    assert record.period_s == pytest.approx(0.002, rel=1e-12)
    assert record.signals.keys() == {"drive", "displacement"}


def test_resampling_is_linear_between_samples(oscillator: Write) -> None:
    time_s = np.cumsum(np.where(np.arange(200) % 50 == 49, 0.003, 0.001))
    line = 2.0 * time_s + 1.0
    change = ("sample_rate_hz = 1000.0", 'time = "t"\nresample = true')
    (record,) = read_dataset(oscillator(change, t=time_s, x_tip=line)).records
    grid = time_s[0] + 0.001 * np.arange(len(record.signals["drive"]))
    assert record.period_s == pytest.approx(0.001, rel=1e-9)
    assert grid[-1] == pytest.approx(time_s[-1], abs=1e-9)
    np.testing.assert_allclose(record.signals["displacement"], 2.0 * grid + 1.0, rtol=1e-9)


def test_resampling_a_held_input_never_invents_levels_between_its_own(oscillator: Write) -> None:
    time_s = np.cumsum(np.where(np.arange(200) % 50 == 49, 0.0025, 0.001))
    levels = np.where(np.arange(200) % 20 < 10, 1.0, 5.0)
    hold = ('unit = "m/s^2"', 'unit = "m/s^2"\nhold = "zero"')
    rate = ("sample_rate_hz = 1000.0", 'time = "t"\nresample = true')
    (record,) = read_dataset(oscillator(hold, rate, t=time_s, drive=levels)).records
    assert set(record.signals["drive"]) == {1.0, 5.0}


@pytest.mark.parametrize("hold", ["zero", "linear"])
def test_resampling_what_is_uniform_changes_nothing(oscillator: Write, hold: str) -> None:
    time_s = np.cumsum(np.full(200, 0.1))  # not the same floats as 0.1 k
    table = ('unit = "m/s^2"', f'unit = "m/s^2"\nhold = "{hold}"')
    rate = ("sample_rate_hz = 1000.0", 'time = "t"\nresample = true')
    (record,) = read_dataset(oscillator(table, rate, t=time_s, drive=np.arange(200.0))).records
    np.testing.assert_allclose(record.signals["drive"], np.arange(200.0), atol=1e-9)


@pytest.mark.parametrize(
    ("name", "samples", "hold"),
    [("silverbox", [65062, 21688, 40475, 32000], "band-limited"), ("emps", [24841, 24841], "zero")],
)
def test_the_public_measurements_load(name: str, samples: list[int], hold: str) -> None:
    path = Path(__file__).parents[2].parent / "shared" / "data" / name / "dataset.toml"
    if not path.is_file():
        pytest.skip("the public measurements are not beside the repository")
    dataset = read_dataset(path)
    assert [record.samples for record in dataset.records] == samples
    assert [record.samples for record in open_dataset(path)] == samples
    assert dataset.signals["drive"].hold == hold
    assert {record.use for record in dataset.records} == {"fit", "test"}


def test_a_record_checks_itself_at_construction() -> None:
    values = np.zeros(3)
    with pytest.raises(InputError, match="period_s must be > 0 s, got nan"):
        Record(name="r", period_s=float("nan"), signals={"drive": values})
    with pytest.raises(InputError, match="one length"):
        Record(name="r", period_s=1.0, signals={"drive": values, "displacement": np.zeros(4)})
    with pytest.raises(InputError, match="ignore_first = 3 leaves nothing of 3 samples"):
        Record(name="r", period_s=1.0, signals={"drive": values}, ignore_first=3)


def test_a_path_that_is_no_manifest_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_dataset(tmp_path / "dataset.toml")
