"""A unit that a file states, in whatever form and words, is held against the manifest's, or remarked upon."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from measured_files import write_tdms

from rtctl.border.errors import InputError
from rtctl.measured import open_dataset, read_dataset
from rtctl.measured.columns.conversion import TableCache
from rtctl.measured.stated_unit import agrees, readable, stated_amplitude, time_unit_in_name, unit_in_name
from rtctl.measured.units import check_unit

Write = Callable[..., Path]
X = np.linspace(0.0, 1.0, 200)


@pytest.mark.parametrize(
    ("stated", "unit"),
    [
        ("m/s2", "m/s^2"), ("m/s²", "m/s^2"), ("m·s⁻²", "m/s^2"), ("m s-2", "m/s^2"), ("m/s**2", "m/s^2"),
        ("N/mm2", "MPa"), ("1/s2", "1/s^2"), ("Volts", "V"), ("volt", "V"), ("mVolts", "mV"), ("VOLTS", "V"),
        ("Amps", "A"), ("Ohms", "ohm"), ("kOhm", "kohm"), ("MOhm", "Mohm"), ("Ω", "ohm"), ("kΩ", "kohm"),
        ("µm", "um"), ("μm", "um"), ("microns", "um"), ("Millimeters", "mm"), ("millimetres", "mm"),
        ("Inches", "inch"), ("deg C", "degC"), ("°C", "degC"), ("C", "degC"), ("C", "coulomb"), ("°", "deg"),
        ("º", "deg"), ("g", "g_0"), ("g", "gram"), ("G", "gauss"), ("KHz", "kHz"), ("sec", "s"), ("Hertz", "Hz"),
        ("um/us", "m/s"), (" mm ", "mm"), ("%", "percent"), ("micrometer", "um"),
    ],
)  # fmt: skip
def test_words_of_instruments_are_understood(stated: str, unit: str) -> None:
    assert agrees(stated, unit)


@pytest.mark.parametrize(
    ("stated", "unit"),
    [("m/s2", "mm/s^2"), ("Volts", "mV"), ("MOhm", "mohm"), ("mV", "MV"), ("µm", "mm"), ("g", "m/s^2"), ("deg C", "K"),
     ("Amps", "am/s"), ("°", "rad"), ("C", "K")],
)  # fmt: skip
def test_a_thousand_between_two_units_shows(stated: str, unit: str) -> None:
    assert not agrees(stated, unit)


@pytest.mark.parametrize(
    "text", ["EU", "blorps", "mm pk-pk", "V (RMS)", "V/√Hz", "x" * 200, "9**9**9 s", "mm H2O"]
)
def test_what_is_no_unit_is_not_taken_for_one(text: str) -> None:
    assert not readable(text)


@pytest.mark.parametrize("text", ["9**9**9 s", "9^9^9", "((9)**9)**9 s", "s^99999", "m**(9**9)", "1e9999 m"])
def test_no_unit_is_worked_out_for_ever(text: str) -> None:
    with pytest.raises(ValueError, match="unit"):
        check_unit(text)


@given(st.text(max_size=12))
def test_any_text_is_a_stated_unit_or_none(text: str) -> None:
    assert readable(text) in (True, False)
    unit = unit_in_name(f"x [{text}]")
    assert unit is None or readable(unit) or stated_amplitude(unit) is not None


@pytest.mark.parametrize(
    ("name", "unit"),
    [("x [mm]", "mm"), ("x tip (m/s2)", "m/s2"), ("T [°C]", "°C"), ("a [m/(s^2)]", "m/(s^2)"), ("x (left)", None),
     ("U (V rms)", "V rms"), ("Mag (dB re 1 um)", "dB re 1 um"), ("Gain dB (m)", "dB (m)"), ("x_dB", "dB"),
     ("x[0]", None), ("x (1)", None), ("x", None), ("[mm]", None)],
)  # fmt: skip
def test_brackets_behind_a_name_are_a_unit_if_they_hold_one(name: str, unit: str | None) -> None:
    assert unit_in_name(name) == unit


@pytest.mark.parametrize(
    ("name", "unit"),
    [("t_ms", "ms"), ("time us", "us"), ("Time_ns", "ns"), ("millis", "ms"), ("t_s", "s"), ("times", None),
     ("t", None), ("status", None), ("items", None)],
)  # fmt: skip
def test_a_name_of_time_may_end_with_its_unit(name: str, unit: str | None) -> None:
    assert time_unit_in_name(name) == unit


def h5(path: Path, attributes: dict[str, Any]) -> None:
    with h5py.File(path, "w") as file:
        file["drive"], file["x_tip"] = X, X
        file["x_tip"].attrs.update(attributes)


def parquet(path: Path, metadata: dict[Any, Any], shared: dict[Any, Any] | None = None) -> None:
    fields = [pa.field("drive", pa.float64()), pa.field("x_tip", pa.float64(), metadata=metadata)]
    pq.write_table(pa.table({"drive": X, "x_tip": X}).cast(pa.schema(fields, metadata=shared)), path)


STATING: dict[str, Callable[[Path], None]] = {
    "text.h5": lambda path: h5(path, {"units": "um"}),
    "Unit.h5": lambda path: h5(path, {"Unit": "um"}),
    "UNITS.h5": lambda path: h5(path, {"UNITS": "um"}),
    "bytes.h5": lambda path: h5(path, {"units": np.bytes_(b"um")}),
    "padded.h5": lambda path: h5(path, {"units": np.bytes_(b"um\0\0 ")}),
    "array.h5": lambda path: h5(path, {"units": np.array([b"um"])}),
    "objects.h5": lambda path: h5(path, {"units": np.array(["um"], dtype=h5py.string_dtype())}),
    "latin.h5": lambda path: h5(path, {"unit": np.bytes_("µm".encode("latin-1"))}),
    "greek.h5": lambda path: h5(path, {"unit": "μm"}),
    "unit_string.h5": lambda path: h5(path, {"unit_string": "Micrometers"}),
    "unit.parquet": lambda path: parquet(path, {"unit": "um"}),
    "units.parquet": lambda path: parquet(path, {"units": "um"}),
    "latin.parquet": lambda path: parquet(path, {b"Unit": "µm".encode("latin-1")}),
    "shared.parquet": lambda path: parquet(path, {}, {"units": '{"x_tip": "um", "drive": "m/s2"}'}),
    "row.csv": lambda path: path.write_text("drive,x_tip\nm/s2,um\n" + "0.5,0.25\n" * 200) and None,
    "bracketed_row.csv": lambda path: (
        path.write_text("drive,x_tip\n[m/s2],(um)\n" + "0.5,0.25\n" * 200) and None
    ),
    "tdms.tdms": lambda path: write_tdms(
        path, {"drive": X, "x_tip": X}, {"x_tip": {"unit_string": "Micrometers"}}
    ),
    "daqmx.tdms": lambda path: write_tdms(
        path, {"drive": X, "x_tip": X}, {"x_tip": {"NI_UnitDescription": "um"}}
    ),
}


@pytest.mark.parametrize("name", STATING)
def test_every_way_to_state_a_unit_is_held_against_the_manifest(
    oscillator: Write, tmp_path: Path, name: str
) -> None:
    STATING[name](tmp_path / name)
    file = ('"r00.csv"', f'"{name}"')
    with pytest.raises(InputError, match=r'the file states unit ".*" for column "x_tip", the manifest "mm"'):
        open_dataset(oscillator(file))
    dataset = read_dataset(oscillator(file, ('unit = "mm"', 'unit = "µm"')))
    assert (dataset.records[0].samples, dataset.remarks) == (200, ())


def test_a_unit_in_brackets_behind_the_column_s_name(oscillator: Write, tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text("drive [m/s2],x_tip (um)\n" + "0.5,0.25\n" * 200)
    changes = (
        ('"r00.csv"', '"r.csv"'),
        ('"x_tip"', '"x_tip (um)"'),
        ('role = "input"', 'role = "input"\ncolumn = "drive [m/s2]"'),
    )
    with pytest.raises(InputError, match='states unit "um" for column "x_tip \\(um\\)", the manifest "mm"'):
        open_dataset(oscillator(*changes))
    assert read_dataset(oscillator(*changes, ('unit = "mm"', 'unit = "um"'))).records[0].samples == 200


NO_UNIT = "which is no known unit; taken as mm"
OF_AMPLITUDES = "a unit of amplitudes; its rows are taken as readings at instants, in mm"


@pytest.mark.parametrize(
    ("text", "remark"),
    [("blorps", NO_UNIT), ("EU", NO_UNIT), ("mm pk-pk", OF_AMPLITUDES), ("mm pk", OF_AMPLITUDES)],
)
def test_a_unit_that_is_none_of_readings_is_remarked_upon(
    oscillator: Write, tmp_path: Path, text: str, remark: str
) -> None:
    h5(tmp_path / "r00.h5", {"units": text})
    for read in (read_dataset, open_dataset):
        (told,) = read(oscillator(('"r00.csv"', '"r00.h5"'))).remarks
        assert told == f'records.0 "r00.h5": column "x_tip": the file states "{text}", {remark}'


@pytest.mark.parametrize("text", ["dB", "dB re 1 mm", "dBV", "dB(mm)"])
@pytest.mark.parametrize("counted", ["", "scale = 2.0"])
def test_a_logarithm_is_no_signal_in_time_whatever_the_manifest_says(
    oscillator: Write, tmp_path: Path, text: str, counted: str
) -> None:
    h5(tmp_path / "r00.h5", {"units": text})
    changes = ('"r00.csv"', '"r00.h5"'), ('unit = "mm"', f'unit = "mm"\n{counted}')
    with pytest.raises(InputError, match=r'"x_tip" is in "dB.*", a logarithm, which is no signal; export it'):
        open_dataset(oscillator(*changes))


@pytest.mark.parametrize("text", ["", "-", "none", "N/A", "unknown"])
def test_a_word_that_only_fills_the_place_says_nothing(oscillator: Write, tmp_path: Path, text: str) -> None:
    h5(tmp_path / "r00.h5", {"units": text})
    assert read_dataset(oscillator(('"r00.csv"', '"r00.h5"'))).remarks == ()


@pytest.mark.parametrize("attribute", ["", " ", np.bytes_(b""), h5py.Empty("f8")])
def test_an_attribute_that_is_empty_says_nothing(tmp_path: Path, attribute: Any) -> None:
    h5(tmp_path / "r.h5", {"units": attribute})
    assert TableCache().stated_unit(tmp_path / "r.h5", "x_tip") is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('unit = "m/s^2"', 'unit = "dB"'), '"dB" is a logarithm or has its zero elsewhere'),
        (
            ('unit = "m/s^2"', 'unit = "degC"'),
            'write unit = "K" with offset = 273.15, which convert the column \\(degC to K\\)',
        ),
        (('unit = "mm"', 'unit = "dB"'), 'key "signals.displacement.unit": "dB" is a logarithm'),
        (
            ('unit = "mm"', 'unit = "g"'),
            '"g" is the gram; standard gravity is "g_0", which this signal cannot be',
        ),
        (('unit = "mm"', 'unit = "g_0"'), '"g_0" is a unit like m/s\\^2, which this signal cannot be'),
        (('unit = "mm"', 'unit = "mm/s"'), '"mm/s" is a unit like m/s, which this signal cannot be'),
        (('unit = "m/s^2"', 'unit = "g"'), '"g" is the gram; standard gravity is "g_0"'),
    ],
)
def test_units_in_which_no_equation_of_motion_holds(
    oscillator: Write, change: tuple[str, str], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        open_dataset(oscillator(change))


def test_a_factor_of_a_logarithm_in_a_name_is_no_scale() -> None:
    assert unit_in_name("20*log10(x) [V]") == "V"
    assert unit_in_name("20*x [V]") is None
