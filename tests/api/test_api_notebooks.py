"""For notebooks: tables of pandas with times and units, and the figure of a dataset."""

from __future__ import annotations

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from api_cases import PERIOD_S, write_bench
from matplotlib.figure import Figure

import rtctl

needs_pandas = pytest.mark.skipif(importlib.util.find_spec("pandas") is None, reason="needs pandas")


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> rtctl.Dataset:
    """Three records of an oscillator."""
    return rtctl.read_dataset(write_bench(tmp_path_factory.mktemp("bench")) / "dataset.toml")


@pytest.fixture
def swept() -> rtctl.Record:
    """A sweep of three frequencies."""
    frequency, drive = np.repeat([9.0, 10.0, 11.0], 2), np.repeat([0.5, 0.5, 0.5], 2)
    signals = {
        "frequency": frequency,
        "drive": drive,
        "displacement": np.array([1.0, -0.1, 0.0, -2.0, -1.0, -0.1]),
    }
    return rtctl.Record(name="up", period_s=0.5, signals=signals)


def test_a_record_tells_the_time_of_each_sample(data: rtctl.Dataset, swept: rtctl.Record) -> None:
    record = data.record("r2")
    assert record.time_s.shape == record.signals["drive"].shape
    assert record.time_s[:2] == pytest.approx([0.0, PERIOD_S])
    with pytest.raises(rtctl.InputError, match="frequencies_hz"):
        _ = swept.time_s
    with pytest.raises(rtctl.InputError, match=r'no record "r22".*did you mean "r2"'):
        data.record("r22")


@needs_pandas
def test_a_record_is_a_table_with_times_and_units(data: rtctl.Dataset) -> None:
    frame = data.to_dataframe("r2")
    assert frame.index.name == "time_s"
    assert list(frame.columns) == ["drive", "displacement"]
    assert frame.attrs["units"] == {"drive": "V", "displacement": "mm"}
    assert np.array_equal(frame["displacement"].to_numpy(), data.record("r2").signals["displacement"])
    assert frame.index[1] == pytest.approx(PERIOD_S)
    alone = data.record("r2").to_dataframe()
    assert alone.attrs["units"] == {}
    assert alone.equals(frame)


@needs_pandas
def test_all_records_are_one_table(data: rtctl.Dataset) -> None:
    frame = data.to_dataframe()
    assert frame.index.names == ["record", "time_s"]
    assert len(frame) == sum(one.samples for one in data.records)
    assert frame.attrs["units"] == data.units
    assert frame.loc["r3"].equals(data.to_dataframe("r3"))


@needs_pandas
def test_a_sweep_is_a_table_of_complex_amplitudes(swept: rtctl.Record) -> None:
    frame = swept.to_dataframe({"drive": "V", "displacement": "mm"})
    assert frame.index.name == "frequency_hz"
    assert frame["displacement"].tolist() == [1.0 - 0.1j, -2.0j, -1.0 - 0.1j]
    assert frame["drive"].tolist() == [0.5, 0.5, 0.5]


@needs_pandas
def test_a_run_is_a_table_of_its_steps(model_file: Path) -> None:
    run = rtctl.run("steps", model=model_file, settings={"scenario.duration": "0.05 s"})
    frame = run.to_dataframe()
    assert set(frame.columns) == set(run.signals)
    assert frame.attrs["units"]["deflection"] == "um"
    assert np.array_equal(frame.index.to_numpy(), run.time_s)


def test_without_pandas_one_message_says_what_to_install(
    data: rtctl.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    for call in (data.to_dataframe, data.records[0].to_dataframe):
        with pytest.raises(
            rtctl.InputError, match=r"^Record.to_dataframe needs pandas: pip install 'rtctl\[pandas\]'$"
        ):
            call()


def test_the_figure_of_a_dataset_labels_its_axes_with_units(data: rtctl.Dataset) -> None:
    for figure, records in ((data.plot(), "3 records"), (data.plot("r2"), "1 record")):
        assert isinstance(figure, Figure)
        labels = [axes.get_ylabel() for axes in figure.axes] + [axes.get_xlabel() for axes in figure.axes]
        for text in ("V", "mm", "s", "Hz"):
            assert any(f"[{text}]" in one or f"({text})" in one for one in labels), (text, labels)
        told = " ".join(text.get_text() for text in figure.findobj(lambda one: hasattr(one, "get_text")))
        assert records in told
    with pytest.raises(rtctl.InputError, match="did you mean"):
        data.plot("r22")


def test_arrays_that_were_never_written_are_drawn_too(data: rtctl.Dataset, tmp_path: Path) -> None:
    mine = replace(data, path=tmp_path / "nowhere.toml", records=data.records[:1])
    assert isinstance(mine.plot(), Figure)
