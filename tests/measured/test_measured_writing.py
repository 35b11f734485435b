"""What is written reads back as it was, and what is half-written never looks whole."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import rtctl.measured.writer as writer
from rtctl.border.errors import InputError, RunError
from rtctl.measured import Record, read_dataset, write_dataset


def vo2_record(name: str, *, deflection: float | None = 3.0, resistance: float = 5e4) -> Record:
    signals = {"current": np.linspace(4.0, 8.0, 9), "resistance": np.full(9, resistance)}
    if deflection is not None:
        signals["deflection"] = np.full(9, deflection)
    return Record(name=name, period_s=1e-3, signals=signals, use="identify", conditions={"room_degC": 23.5})


def test_a_vo2_dataset_reads_back_as_it_was_written(tmp_path: Path) -> None:
    records = [vo2_record("up"), vo2_record("bare", deflection=None)]
    path = write_dataset(tmp_path, name="n", plant="vo2", identity="sim-a", records=records)
    back = read_dataset(path)
    assert (back.name, back.plant, back.identity, back.holds) == ("n", "vo2", "sim-a", {"current": "zero"})
    for given, read in zip(records, back.records, strict=True):
        assert (read.name, read.period_s, read.use) == (given.name, given.period_s, given.use)
        assert read.conditions == given.conditions
        assert read.signals.keys() == given.signals.keys()
        for name, values in given.signals.items():
            np.testing.assert_array_equal(read.signals[name], values)


def test_an_oscillator_reads_back_with_its_units_hold_and_state(tmp_path: Path) -> None:
    record = Record(
        name="r",
        period_s=0.002,
        signals={"drive": np.arange(5.0), "displacement": np.arange(5.0)},
        initial={"displacement": 2.0, "velocity": -1.0},
        ignore_first=2,
        repeat="A",
    )
    units, holds = {"drive": "V", "displacement": "mm"}, {"drive": "linear"}
    path = write_dataset(tmp_path, name="n", plant="oscillator", records=[record], units=units, holds=holds)
    back = read_dataset(path)
    assert (back.units, back.holds) == (units, holds)
    (read,) = back.records
    assert (read.initial, read.ignore_first, read.repeat) == (record.initial, 2, "A")


def test_each_file_states_units_and_metadata(tmp_path: Path) -> None:
    write_dataset(
        tmp_path, name="n", plant="vo2", records=[vo2_record("up")], metadata={"scenario": "[scenario]"}
    )
    schema = pq.read_schema(tmp_path / "up.parquet")
    units = {field.name: field.metadata[b"unit"].decode() for field in schema}
    assert units == {"current": "mA", "resistance": "ohm", "deflection": "um"}
    assert schema.metadata[b"scenario"] == b"[scenario]"


def test_an_absent_instrument_is_left_out(tmp_path: Path) -> None:
    records = [vo2_record("up"), vo2_record("bare", deflection=float("nan"))]
    back = read_dataset(write_dataset(tmp_path, name="n", plant="vo2", records=records))
    assert [record.has("deflection") for record in back.records] == [True, False]


@pytest.mark.parametrize(
    ("records", "message"),
    [
        ([], "records with different names"),
        ([vo2_record("a"), vo2_record("a")], "records with different names, got ['a', 'a']"),
        (
            [vo2_record("a", resistance=float("nan"))],
            "resistance [ohm] has 9 of 9 samples that are not finite",
        ),
        (
            [Record(name="a", period_s=1.0, signals={"drive": np.zeros(2)})],
            'a plant "vo2" has no signal drive',
        ),
    ],
)
def test_what_a_reader_would_refuse_is_not_written(
    tmp_path: Path, records: list[Record], message: str
) -> None:
    with pytest.raises(RunError) as caught:
        write_dataset(tmp_path / "out", name="n", plant="vo2", records=records)
    assert message in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_a_missing_unit_is_told(tmp_path: Path) -> None:
    record = Record(name="a", period_s=1.0, signals={"drive": np.zeros(2), "displacement": np.zeros(2)})
    with pytest.raises(RunError, match="the unit of displacement is not given"):
        write_dataset(tmp_path, name="n", plant="oscillator", records=[record], units={"drive": "V"})


def test_a_write_that_breaks_leaves_no_manifest_even_over_an_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_dataset(tmp_path, name="old", plant="vo2", records=[vo2_record("a"), vo2_record("b")])
    real = writer.write_parquet

    def breaks_on_b(target: Path, *rest: object) -> None:
        if target.name == "b.parquet":
            raise OSError("disk full")
        real(target, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(writer, "write_parquet", breaks_on_b)
    with pytest.raises(OSError, match="disk full"):
        write_dataset(tmp_path, name="new", plant="vo2", records=[vo2_record("a"), vo2_record("b")])
    with pytest.raises(InputError, match="no such file"):
        read_dataset(path)
    assert not list(tmp_path.glob(".*"))
