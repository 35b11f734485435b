"""Manifests of sweeps: the ways in which people write a complex amplitude, and one message for each mistake."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from sweep_cases import HEAD, UP, Sweep, response, write_sweeps

from rtctl.border.errors import InputError
from rtctl.measured.reading import open_dataset, read_dataset

Z = response(UP, 0.08)
ONE = Sweep(UP, 0.08, Z, "fit")
CARTESIAN = 'in_phase = "x"\nquadrature = "y"\n'
POLAR = 'amplitude = "x"\nphase = "y"\nphase_unit = "{}"\n'


def read(folder: Path, made: Sweep = ONE, old: str = "", new: str = "") -> np.ndarray:
    path = write_sweeps(folder, [made])
    path.write_text(path.read_text().replace(old, new) if old else path.read_text())
    record = read_dataset(path).records[0]
    np.testing.assert_allclose(record.frequencies_hz, made.frequency_hz)
    return record.complex_amplitudes("displacement")


def as_columns(first: np.ndarray, second: np.ndarray) -> Sweep:
    return Sweep(UP, 0.08, first + 1j * second, "fit")


def test_in_phase_and_quadrature_are_the_complex_amplitude(tmp_path: Path) -> None:
    found = read(tmp_path)
    np.testing.assert_allclose(found, Z, rtol=1e-12)
    assert (found.imag < 0.0).all(), "a driven resonator lags"


@pytest.mark.parametrize(("unit", "factor"), [("deg", 180.0 / np.pi), ("rad", 1.0)])
def test_amplitude_and_phase_are_the_complex_amplitude(tmp_path: Path, unit: str, factor: float) -> None:
    made = as_columns(np.abs(Z), factor * np.angle(Z))
    np.testing.assert_allclose(read(tmp_path, made, CARTESIAN, POLAR.format(unit)), Z, rtol=1e-9)


def test_a_phase_counted_as_lag_is_turned_round(tmp_path: Path) -> None:
    made = as_columns(np.abs(Z), -np.angle(Z))
    found = read(tmp_path, made, CARTESIAN, POLAR.format("rad") + 'phase_sign = "lag"\n')
    np.testing.assert_allclose(found, Z, rtol=1e-9)


def test_a_response_per_drive_is_multiplied_by_the_drive(tmp_path: Path) -> None:
    made = as_columns(Z.real / 0.08, Z.imag / 0.08)
    found = read(tmp_path, made, CARTESIAN, CARTESIAN + "per_drive = true\n")
    np.testing.assert_allclose(found, Z, rtol=1e-9)


def test_without_an_amplitude_a_response_per_drive_is_of_one_and_said_so(tmp_path: Path) -> None:
    path = write_sweeps(tmp_path, [ONE])
    text = path.read_text().replace(CARTESIAN, CARTESIAN + "per_drive = true\n")
    path.write_text(text.replace("drive_amplitude = 0.08\n", ""))
    dataset = read_dataset(path)
    assert dataset.records[0].signals["drive"][0] == 1.0
    assert any("the amplitude of the drive is not given" in one for one in dataset.remarks)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (CARTESIAN, 'amplitude = "x"\nphase = "y"\n', 'the phase "y" needs its unit: phase_unit = "deg" or "rad"'),
        (CARTESIAN, 'in_phase = "x"\n', 'in_phase and quadrature, or amplitude and phase; got "x"'),
        (CARTESIAN, 'column = "x"\n', "signals.displacement of a sweep needs two columns"),
        ("drive_amplitude = 0.08\n", "", "the amplitude of the drive is nowhere: add drive_amplitude = <V>"),
        ("drive_amplitude = 0.08", "drive_amplitude = -1.0", "is no amplitude; write a number above 0"),
        ('frequency = "f"', 'frequency = "f"\nsample_rate_hz = 10.0', "makes it a sweep, whose rows are steady states"),
        ('quadrature = "y"', 'quadrature = "z"', 'no column "z"'),
    ],
)  # fmt: skip
def test_a_mistake_in_the_manifest_is_one_message(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, ONE, old, new)
    assert message in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize(
    ("frequency", "message"),
    [
        (
            np.concatenate([UP[:30], UP[:26][::-1]]),
            "a record of its own, rows = [0, 30] and rows = [30, 56]",
        ),
        (UP - 95.2, "a frequency must be above 0 Hz, got -0.2 in rows 0, 1"),
        (np.where(np.arange(56) == 7, np.nan, UP), 'column "f" is NaN in 1 of 56 rows: row 7'),
    ],
    ids=["both ways", "negative", "NaN"],
)
def test_frequencies_that_are_no_sweep_are_one_message(
    tmp_path: Path, frequency: np.ndarray, message: str
) -> None:
    with pytest.raises(InputError) as caught:
        read_dataset(write_sweeps(tmp_path, [Sweep(frequency, 0.08, Z, "fit")]))
    assert message in str(caught.value)


def test_sweeps_beside_records_in_time_are_refused_with_what_to_do(tmp_path: Path) -> None:
    path = write_sweeps(tmp_path, [ONE, ONE])
    in_time = path.read_text().replace(
        'file = "s1.csv"\nfrequency = "f"\ndrive_amplitude = 0.08', 'file = "s1.csv"\nsample_rate_hz = 10.0'
    )
    path.write_text(in_time)
    with pytest.raises(
        InputError, match=r"records.0 is a sweep .*, records.1 is in time: .* second manifest"
    ):
        open_dataset(path)


def test_a_vo2_has_no_sweeps(tmp_path: Path) -> None:
    path = write_sweeps(
        tmp_path,
        [ONE],
        HEAD.replace('"oscillator"', '"vo2"')
        .replace("signals.drive", "signals.current")
        .replace('"V"', '"mA"')
        .replace("signals.displacement", "signals.resistance")
        .replace('"um"', '"ohm"'),
    )
    with pytest.raises(InputError, match='a plant "vo2" has no sweeps of frequencies'):
        read_dataset(path)
