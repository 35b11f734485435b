"""What data do not allow is said in words: before the search, with the record's name, value and unit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from coarse_cases import dataset
from diagnosis_cases import PERIOD_S, device, measured, noise_drive, write_case

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.cli import main
from rtctl.diagnosis.nominal_fit.misfit.foreign_model import note_foreign_model
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.screening.excitation_checks import note_constant_drive, note_few_periods
from rtctl.diagnosis.screening.split import split_records
from rtctl.diagnosis.thresholds import ScreeningThresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales
from rtctl.measured import read_dataset
from rtctl.plants.oscillator.diagnosis import OSCILLATOR
from rtctl.plants.vo2.diagnosis import VO2

PLANT = device()


def record(seed: int, use: str = "fit", samples: int = 600) -> tuple[np.ndarray, np.ndarray, str]:
    drive = noise_drive(seed, samples=samples)
    return drive, measured(PLANT, drive), use


def warnings_of(folder: Path, *records: tuple[np.ndarray, np.ndarray, str]) -> list[str]:
    dataset = read_dataset(write_case(folder, list(records)))
    return list(split_records(dataset, OSCILLATOR).notes)


def test_good_data_raise_no_warning(tmp_path: Path) -> None:
    assert warnings_of(tmp_path, record(1), record(2, "test")) == []


def test_without_test_records_the_last_is_held_out_and_that_is_said(tmp_path: Path) -> None:
    fit, tests, warnings = split_records(
        read_dataset(write_case(tmp_path, [record(1), record(2)])), OSCILLATOR
    )
    assert [one.name for one in fit] == ["r0"]
    assert [one.name for one in tests] == ["r1"]
    assert "r1 was held out" in warnings[0]


def test_one_record_alone_is_fitted_and_has_no_gain(tmp_path: Path) -> None:
    fit, tests, warnings = split_records(read_dataset(write_case(tmp_path, [record(1)])), OSCILLATOR)
    assert (len(fit), tests) == (1, ())
    assert "the gain could not be measured" in warnings[0]


def test_a_short_record_is_left_out_by_name(tmp_path: Path) -> None:
    (warning,) = warnings_of(tmp_path, record(1), record(2, samples=150), record(3, "test"))
    assert "r1 has 150 scored samples" in warning


def test_a_heater_without_any_current_is_bad_input() -> None:
    problem = dataset(share=0.0, steps=17)
    off = [
        replace(one, signals={**one.signals, "current": 0.0 * one.signals["current"]})
        for one in problem.records
    ]
    with pytest.raises(InputError, match="current of every record to fit is 0 mA"):
        split_records(replace(problem, records=tuple(off)), VO2)


@pytest.mark.parametrize(("other", "said"), [(0.0, False), (0.01, False), (0.5, True)])
def test_repeats_of_other_inputs_are_said_and_not_taken_for_repeats(
    tmp_path: Path, other: float, said: bool
) -> None:
    drive, reading, _ = record(1)
    again = drive + other * record(2)[0]
    manifest = write_case(tmp_path, [(drive, reading, "fit"), (again, reading, "fit"), record(3, "test")])
    manifest.write_text(manifest.read_text().replace('use = "fit"', 'use = "fit"\nrepeat = "A"'))
    fit, _, warnings = split_records(read_dataset(manifest), OSCILLATOR)
    assert [one.repeat for one in fit] == ([None, None] if said else ["A", "A"])
    assert any("are no repeats of one input" in warning for warning in warnings) == said


def test_a_resistance_that_no_film_has_is_said() -> None:
    problem = dataset(share=0.0, steps=17)
    (bad, *rest) = problem.records
    resistance = bad.signals["resistance"].copy()
    assert not any("which no film has" in one for one in split_records(problem, VO2)[2])
    resistance[500:503] = -1.0
    bad = replace(bad, signals={**bad.signals, "resistance": resistance}, use="fit")
    warnings = split_records(replace(problem, records=(bad, *rest)), VO2)[2]
    assert any(f"{bad.name}: 3 readings of the resistance are 0 ohm or less" in one for one in warnings)


def said_of_velocities(
    folder: Path, read: Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
) -> tuple[str, ...]:
    """What is said of two records in which `read` makes displacement and velocity of a displacement and its slope."""
    problem = read_dataset(write_case(folder, [record(1), record(2, "test")]))
    records = []
    for one in problem.records:
        displacement = one.signals["displacement"]
        made = read(displacement, np.gradient(displacement, PERIOD_S))
        signals = {**one.signals, "displacement": made[0], "velocity": made[1]}
        records.append(replace(one, signals=signals))
    return split_records(replace(problem, records=tuple(records)), OSCILLATOR)[2]


@pytest.mark.parametrize(
    ("scale", "noise", "said"), [(1.0, 0.0, ""), (1.0, 1.0, ""), (1e3, 0.0, "0.001 times"), (-1.0, 0.1, "-")]
)
def test_a_velocity_that_is_no_slope_of_the_displacement_is_said(
    tmp_path: Path, scale: float, noise: float, said: str
) -> None:
    """Of its noise it may be any share: of a slope that is noisy too nothing is said."""
    rng = np.random.default_rng(0)

    def noisy(displacement: FloatArray, slope: FloatArray) -> tuple[FloatArray, FloatArray]:
        velocity = scale * (slope + noise * slope.std() * rng.standard_normal(len(slope)))
        return displacement + noise * 0.02 * rng.standard_normal(len(slope)), velocity

    notes = [one for one in said_of_velocities(tmp_path, noisy) if "the displacement's slope is" in one]
    assert len(notes) == bool(said)
    assert all(said in note for note in notes)


@pytest.mark.parametrize(("late", "said"), [(0.0, ""), (0.6, "later"), (-0.6, "earlier")])
def test_a_velocity_that_is_of_another_time_than_the_displacement_is_said(
    tmp_path: Path, late: float, said: str
) -> None:
    """A stranger's vibrometer delayed one of its channels by 0.4 ms: three causes were told, and a wrong hold."""
    rng = np.random.default_rng(0)

    def delayed(displacement: FloatArray, slope: FloatArray) -> tuple[FloatArray, FloatArray]:
        rows = np.arange(len(slope))
        return displacement, np.interp(rows - late, rows, slope) + 0.01 * slope.std() * rng.standard_normal(
            len(slope)
        )

    notes = [
        one for one in said_of_velocities(tmp_path, delayed) if "than the slope of the displacement" in one
    ]
    assert len(notes) == bool(said)
    assert all(f" {said} than" in note for note in notes)


def test_no_usable_record_is_bad_input_with_every_reason(tmp_path: Path) -> None:
    drive, _, _ = record(1)
    case = write_case(tmp_path, [record(2, samples=100), (drive, np.full_like(drive, 0.3), "fit")])
    with pytest.raises(InputError, match=r"no record with use(.|\n)*100 scored(.|\n)*one constant number"):
        split_records(read_dataset(case), OSCILLATOR)


def ringing_down(stiffness: float = 1.6e4) -> tuple[np.ndarray, np.ndarray, str]:
    """A device that was let go of, whose drive is 0."""
    time = PERIOD_S * np.arange(1500)
    noise = 1e-4 * np.random.default_rng(8).standard_normal(1500)
    return np.zeros(1500), np.exp(-4.0 * time) * np.cos(np.sqrt(stiffness) * time) + noise, "fit"


def test_of_a_free_decay_only_what_the_drive_does_is_said_to_be_unseen(tmp_path: Path) -> None:
    (said,) = [one for one in warnings_of(tmp_path, ringing_down()) if "one constant number" in one]
    assert "most causes" not in said
    assert "its gain, and causes in its path) is only seen while it changes" in said
    assert "shows the rest: of an oscillator damping, friction and springs" in said


def test_of_a_heater_at_one_current_most_causes_are_unseen() -> None:
    heated = dataset(share=0.0, steps=17).records[:1]
    still = [
        replace(one, signals={**one.signals, "current": 0.0 * one.signals["current"] + 1.0}) for one in heated
    ]
    (said,) = note_constant_drive(still, "current", rests=True)
    assert "most causes, are only seen while it changes" in said


def test_a_clipped_sensor_is_said_with_its_rail_and_a_quantised_one_is_not(tmp_path: Path) -> None:
    drive, reading, _ = record(1)
    rail = round(float(np.quantile(reading, 0.97)), 6)
    clipped = (drive, np.minimum(reading, rail), "fit")
    (warning,) = warnings_of(tmp_path, clipped, record(2, "test"))
    assert f"exactly the largest value, {rail:.5g} mm" in warning
    time = PERIOD_S * np.arange(2000)
    sine = np.round(np.sin(127.0 * time), 2)
    assert not [
        w for w in warnings_of(tmp_path, (noise_drive(5, samples=2000), sine, "fit")) if "clipped" in w
    ]


def test_one_repeated_tone_is_said_and_two_levels_of_it_are_not(tmp_path: Path) -> None:
    time = PERIOD_S * np.arange(1500)
    tone = np.sin(2.0 * np.pi * 18.0 * time)
    same = [(level * tone, measured(PLANT, level * tone), "fit") for level in (3.0, 3.0)]
    assert any("same tone of 18 Hz" in w for w in warnings_of(tmp_path, *same, record(3, "test")))
    two = [(level * tone, measured(PLANT, level * tone), "fit") for level in (3.0, 6.0)]
    assert warnings_of(tmp_path, *two, record(3, "test")) == []


def _fit_record(folder: Path) -> FitRecord:
    return split_records(read_dataset(write_case(folder, [record(1)])), OSCILLATOR)[0][0]


def test_a_few_periods_are_said_to_be_few(tmp_path: Path) -> None:
    one = _fit_record(tmp_path)
    duration = one.samples * one.period_s
    assert note_few_periods([one], 2.0 * np.pi * 6.0 / duration, ScreeningThresholds()) == []
    (warning,) = note_few_periods([one], 2.0 * np.pi * 4.0 / duration, ScreeningThresholds())
    assert "4 periods" in warning


def test_a_model_that_leaves_most_of_the_signal_may_be_of_another_plant(tmp_path: Path) -> None:
    one = _fit_record(tmp_path)
    power = float(np.sum((one.measured["displacement"] - one.measured["displacement"].mean()) ** 2))
    problem = Problem(subject=OSCILLATOR, records=(one,), scales=estimate_scales([one]))
    whole = power / problem.size("displacement") ** 2
    assert note_foreign_model(problem, ("displacement",), 0.5 * 0.5**2 * whole) == []
    (warning,) = note_foreign_model(problem, ("displacement",), 0.5 * 0.8**2 * whole)
    assert "leaves 80% of" in warning


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("model.toml", 'kind = "oscillator"', 'kind = "vo2"'), "vo2"),
        (("model.toml", '"mm/s^2/V"', '"mm/s^2/A"'), "drive_gain"),
        (("dataset.toml", "[signals.displacement]", "[signals.displacemnt]"), "displacement"),
        (("r0.csv", "\n", "\nnan,nan\n"), "NaN"),
    ],
)
def test_other_plants_units_missing_signals_and_gaps_are_exit_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], change: tuple[str, str, str], said: str
) -> None:
    write_case(tmp_path, [record(1), record(2, "test")])
    file, old, new = change
    text = (tmp_path / file).read_text()
    assert old in text
    (tmp_path / file).write_text(text.replace(old, new, 1))
    command = ["diagnose", str(tmp_path / "dataset.toml"), "--model", str(tmp_path / "model.toml")]
    assert main([*command, "--out", str(tmp_path / "out")]) == 2
    message = capsys.readouterr().err
    assert said in message
    assert "Traceback" not in message
    assert not (tmp_path / "out" / "diagnosis.json").exists()
