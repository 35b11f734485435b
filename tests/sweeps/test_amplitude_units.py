"""Amplitudes as analysers write them: peak, RMS, peak to peak, decibels; `rtctl init` and manifests of one's own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from sweep_cases import HEAD, UP, Sweep, response, write_sweeps

import rtctl
from rtctl.border.errors import InputError
from rtctl.measured.amplitude_unit import amplitude_unit, convention_in_name, level_at_end
from rtctl.measured.reading import open_dataset, read_dataset
from rtctl.measured.stated_unit import readable, stated_amplitude
from rtctl.measured.units import convert_column

ROOT2 = np.sqrt(2.0)
DRIVES = (0.08, 0.2, 0.4)
PASSES = [(direction, drive) for drive in DRIVES for direction in (UP, UP[::-1])]
F = np.concatenate([direction for direction, _ in PASSES])
U = np.concatenate([np.full(len(UP), drive) for _, drive in PASSES])
Z = np.concatenate([response(direction, drive) for direction, drive in PASSES])
"""Frequency [Hz], peak drive [V] and complex peak amplitude [um] of a rising and a falling sweep at each drive."""
DEGREES = np.rad2deg(np.angle(Z))


def dB(amplitude: np.ndarray) -> np.ndarray:
    return 20.0 * np.log10(amplitude)


def export(folder: Path, header: str, *columns: np.ndarray, form: str = "%.9g") -> Path:
    """Write a file as an analyser does: quoted names, Windows line ends."""
    path = folder / "run.csv"
    quoted = ",".join(f'"{one}"' for one in header.split("|"))
    np.savetxt(path, np.column_stack(columns), form, ",", header=quoted, comments="", newline="\r\n")
    return path


def check(made: rtctl.Initiation, within: float = 1e-6) -> None:
    """Check that every sweep of a dataset has its true drive and response."""
    records = made.dataset.records
    assert [one.use for one in records] == ["fit"] * (len(PASSES) - 1) + ["test"]
    for record, (direction, drive) in zip(records, PASSES, strict=True):
        np.testing.assert_allclose(record.frequencies_hz, direction)
        units = made.dataset.units
        held = convert_column(record.signals["drive"], units["drive"], "V")
        np.testing.assert_allclose(held, drive, rtol=within)
        micrometres = float(convert_column(np.ones(1), units["displacement"], "um")[0])
        found = micrometres * record.complex_amplitudes("displacement")
        np.testing.assert_allclose(found, response(direction, drive), rtol=within)


@pytest.mark.parametrize(
    ("header", "drive", "magnitude", "phase"),
    [
        ("Freq (Hz)|Drive (V pk)|Mag (dB re 1 um)|Phase (deg)", U, dB(np.abs(Z)), DEGREES),
        ("Freq (Hz)|Drive (Vrms)|Mag (um rms)|Phase (deg)", U / ROOT2, np.abs(Z) / ROOT2, DEGREES),
        ("Freq [Hz]|Drive [Vpp]|Mag [um p-p]|Phase [rad]", 2.0 * U, 2.0 * np.abs(Z), np.angle(Z)),
        ("f (kHz)|V pk|Magnitude, dB(m)|Phase (°)", U, dB(1e-6 * np.abs(Z)), DEGREES),
        ("Freq (Hz)|Drive (mV)|Mag dB re 20 nm|Phase (deg)", 1e3 * U, dB(50.0 * np.abs(Z)), DEGREES),
        (
            "Freq (Hz)|Drive (dBV)|Mag (dB re 1 um rms)|Phase (deg)",
            dB(U / ROOT2),
            dB(np.abs(Z) / ROOT2),
            DEGREES,
        ),
        ("Freq (Hz)|Drive RMS (V)|Amplitude RMS (um)|Phase (deg)", U / ROOT2, np.abs(Z) / ROOT2, DEGREES),
        ("Freq (Hz)|Drive (V)|H1 mag (dB re 1 um/V)|H1 phase (deg)", U, dB(np.abs(Z) / U), DEGREES + 360.0),
    ],
)
def test_init_reads_the_amplitudes_of_an_analyser(
    tmp_path: Path, header: str, drive: np.ndarray, magnitude: np.ndarray, phase: np.ndarray
) -> None:
    frequency = 1e-3 * F if "kHz" in header else F
    check(rtctl.init(export(tmp_path, header, frequency, drive, magnitude, phase), plot=False))


def test_units_in_a_row_below_the_names_are_read_too(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    table = np.column_stack([F, U / ROOT2, dB(np.abs(Z)), DEGREES])
    names = "Frequency,Drive,Magnitude,Phase\nHz,Vrms,dB re 1 um pk,deg"
    np.savetxt(path, table, "%.9g", ",", header=names, comments="")
    check(rtctl.init(path, plot=False))


@pytest.mark.parametrize(("sign", "turns"), [(1.0, -1.0), (1.0, 3.0), (-1.0, 0.0)])
def test_a_phase_is_the_same_however_often_it_turned(tmp_path: Path, sign: float, turns: float) -> None:
    """A phase that lags counts from 0 to 360 degrees, or on and on."""
    phase = sign * DEGREES + 360.0 * turns
    path = export(tmp_path, "Freq (Hz)|Drive (V pk)|Mag (um pk)|Phase (deg)", F, U, np.abs(Z), phase)
    made = rtctl.init(path, plot=False)
    assert any("taken to have a phase below 0" in one for one in made.unsure)
    if sign < 0.0:
        lag = made.path.read_text().replace('phase_unit = "deg"', 'phase_unit = "deg"\nphase_sign = "lag"')
        made.path.write_text(lag)
    found = read_dataset(made.path).records[0].complex_amplitudes("displacement")
    np.testing.assert_allclose(found, Z[: len(UP)], rtol=1e-6)


def test_what_is_left_open_of_peak_and_rms_is_told(tmp_path: Path) -> None:
    header = "Freq (Hz)|Drive (V rms)|Mag (um)|Phase (deg)"
    made = rtctl.init(export(tmp_path, header, F, U / ROOT2, np.abs(Z), DEGREES), plot=False)
    (told,) = [one for one in made.unsure if "RMS" in one]
    assert told.startswith('displacement: nobody states whether "Mag (um)" has peak or RMS values')
    plain = export(tmp_path, "Freq (Hz)|Drive (V)|Mag (um)|Phase (deg)", F, U, np.abs(Z), DEGREES)
    assert not [one for one in rtctl.init(plain, plot=False, out=tmp_path / "b").unsure if "RMS" in one]


def test_decibels_of_no_reference_are_asked_for_and_taken_when_said(tmp_path: Path) -> None:
    path = export(tmp_path, "Freq (Hz)|Drive (V pk)|Mag (dB)|Phase (deg)", F, U, dB(1e3 * np.abs(Z)), DEGREES)
    with pytest.raises(
        InputError, match=r'"Mag \(dB\)" is in decibels, and nobody tells what 0 dB is: say --output'
    ):
        rtctl.init(path, plot=False)
    with pytest.raises(InputError, match="nobody tells what 0 dB is"):
        rtctl.init(path, plot=False, outputs={"displacement": "Mag (dB):um"})
    check(rtctl.init(path, plot=False, outputs={"displacement": "Mag (dB):dB re 1 nm pk"}))


@pytest.mark.parametrize("magnitude", ["Mag (um)", "Mag (dB re 1 um)", "dB re 1 um"])
def test_an_amplitude_without_phase_is_refused(tmp_path: Path, magnitude: str) -> None:
    path = export(tmp_path, f"Freq (Hz)|Drive (V pk)|{magnitude}", F, U, dB(np.abs(Z)))
    with pytest.raises(InputError, match=r"without a phase.*export the phase against the drive"):
        rtctl.init(path, plot=False)


def test_a_phase_in_another_unit_is_refused(tmp_path: Path) -> None:
    path = export(tmp_path, "Freq (Hz)|Drive (V)|Mag (um)|Phase (mrad)", F, U, np.abs(Z), 1e3 * np.angle(Z))
    with pytest.raises(
        InputError, match=r'"Phase \(mrad\)" is a phase in mrad; export it in degrees or radians'
    ):
        rtctl.init(path, plot=False)


def test_a_logarithm_is_no_signal_in_time_whoever_says_so(tmp_path: Path) -> None:
    header = "Freq (Hz)|Drive (V pk)|Mag (dB re 1 um)|Phase (deg)"
    path = export(tmp_path, header, F, U, dB(np.abs(Z)), DEGREES)
    with pytest.raises(InputError, match=r'"Mag \(dB re 1 um\)".*is in dB, a logarithm, which is no signal'):
        rtctl.init(path, plot=False, sample_rate_hz=1.0, outputs={"displacement": "Mag (dB re 1 um):um"})


POLAR = 'amplitude = "x"\nphase = "y"\nphase_unit = "rad"\n'
CARTESIAN = 'in_phase = "x"\nquadrature = "y"\n'


def own(folder: Path, first: np.ndarray, second: np.ndarray, keys: str, names: str = "f,x,y") -> Path:
    """Write a manifest of one's own for the first sweep, with columns of these names."""
    path = write_sweeps(folder, [Sweep(UP, 0.08, first + 1j * second, "fit")], HEAD.replace(CARTESIAN, keys))
    table = folder / "s0.csv"
    table.write_text(table.read_text().replace("f,x,y", names))
    return path


Z0 = Z[: len(UP)]


@pytest.mark.parametrize(
    ("first", "second", "keys", "names"),
    [
        (Z0.real / ROOT2, Z0.imag / ROOT2, CARTESIAN + 'amplitude_unit = "um rms"\n', "f,x,y"),
        (2e3 * np.abs(Z0), np.angle(Z0), POLAR + 'amplitude_unit = "nm pp"\n', "f,x,y"),
        (dB(np.abs(Z0)), np.angle(Z0), POLAR + 'amplitude_unit = "dB re 1 um"\n', "f,x,y"),
        (dB(np.abs(Z0)), np.angle(Z0), POLAR.replace('"x"', '"x (dB re 1 um)"'), "f,x (dB re 1 um),y"),
        (
            dB(np.abs(Z0)),
            np.angle(Z0),
            POLAR.replace('"x"', '"x_dB"') + 'amplitude_unit = "dB re 1 um"\n',
            "f,x_dB,y",
        ),
        (
            dB(np.abs(Z0) / 0.08),
            np.angle(Z0),
            POLAR + 'per_drive = true\namplitude_unit = "dB re 1 um/V"\n',
            "f,x,y",
        ),
        (dB(np.abs(Z0) / 5.0), np.angle(Z0), POLAR + 'scale = 5.0\namplitude_unit = "dB re 1 V"\n', "f,x,y"),
    ],
)
def test_a_manifest_says_what_amplitudes_are(
    tmp_path: Path, first: np.ndarray, second: np.ndarray, keys: str, names: str
) -> None:
    record = read_dataset(own(tmp_path, first, second, keys, names)).records[0]
    np.testing.assert_allclose(record.complex_amplitudes("displacement"), Z0, rtol=1e-9)


@pytest.mark.parametrize(
    ("keys", "names", "message"),
    [
        (POLAR + 'amplitude_unit = "dB"\n', "f,x,y", "does not say what 0 dB is; write it like"),
        (
            POLAR.replace('"x"', '"x_dB"'),
            "f,x_dB,y",
            'column "x_dB" is in decibels, and nobody tells what 0 dB is',
        ),
        (POLAR + 'amplitude_unit = "dB re 1 V"\n', "f,x,y", '"dB re 1 V", which is not compatible with um'),
        (CARTESIAN + 'amplitude_unit = "dB re 1 um"\n', "f,x,y", "a logarithm, which has no sign"),
        (POLAR.replace('"x"', '"x (um rms)"') + 'amplitude_unit = "um"\n', "f,x (um rms),y", "correct one"),
        (POLAR.replace('"y"', '"y (deg)"'), "f,x,y (deg)", 'states unit "deg" for column "y \\(deg\\)"'),
        ('amplitude = "x"\n', "f,x,y", "an amplitude without its phase tells neither part"),
        (
            'column = "x"\namplitude_unit = "um rms"\n',
            "f,x,y",
            "amplitude_unit, phase_unit, .* are of a sweep",
        ),
    ],
)
def test_a_manifest_that_cannot_be_meant_is_refused(
    tmp_path: Path, keys: str, names: str, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        read_dataset(own(tmp_path, np.abs(Z0), np.angle(Z0), keys, names))


def test_the_drive_has_one_amplitude(tmp_path: Path) -> None:
    path = own(tmp_path, Z0.real, Z0.imag, CARTESIAN)
    text = path.read_text().replace('unit = "V"\n', 'unit = "V"\namplitude_unit = "V rms"\n')
    path.write_text(text)
    with pytest.raises(InputError, match=r"drive_amplitude is a peak value in V.*remove one"):
        open_dataset(path)
    path.write_text(
        text.replace("drive_amplitude = 0.08\n", "").replace('frequency = "f"', "sample_rate_hz = 1.0")
    )
    with pytest.raises(InputError, match=r"signals.drive.amplitude_unit. is of sweeps of frequencies"):
        open_dataset(path)


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("V pk", "V peak"), ("Vpk", "V peak"), ("mVp", "mV peak"), ("V rms", "V rms"), ("gRMS", "g rms"),
        ("m/s^2 rms", "m/s^2 rms"), ("Vpk-pk", "V peak-to-peak"), ("um (p-p)", "um peak-to-peak"),
        ("dB", "dB"), ("dBm", "dB"), ("dB/V", "dB"), ("dBV", "dB re 1 V rms"), ("dBVpk", "dB re 1 V peak"),
        ("dB(m)", "dB re 1 m"), ("dB re 20 uPa", "dB re 20 uPa"), ("dB (re: 1e-6 m/s rms)", "dB re 1e-06 m/s rms"),
        ("dB rel. um/V", "dB re 1 um/V"),
    ],
)  # fmt: skip
def test_units_of_amplitudes(text: str, meant: str) -> None:
    found = stated_amplitude(text)
    assert found is not None
    assert found.text == meant
    assert amplitude_unit(found.text) == found, "what is written is read back"
    assert not readable(text), "it is no unit of a reading at an instant"


@pytest.mark.parametrize("text", ["V", "mm", "m/s^2", "ppm", "mp", "kp", "1/s", "deg", "u_db", "step", "hop"])
def test_plain_units_and_words_are_no_amplitudes(text: str) -> None:
    assert stated_amplitude(text) is None
    assert level_at_end(text) is None
    assert convention_in_name(text) == ""
