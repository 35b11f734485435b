"""Records that begin in motion, as a period of a steady state: nobody knows what acted before their first sample."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from coarse_cases import dataset, identified
from diagnosis_cases import MODEL, PERIOD_S, answer_to, device, json_of, measured, noise_drive, write_case
from numba import njit
from numpy.typing import NDArray
from vo2_model_cases import UNITS

from rtctl.border.simulation import Stimulus
from rtctl.cli import main
from rtctl.diagnosis.diagnose import diagnose
from rtctl.diagnosis.problem.fit import fit_hypothesis
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.screening.screened import Screened
from rtctl.diagnosis.screening.unknown_initial_state import (
    has_two_wells,
    warm_up_moving_records,
)
from rtctl.diagnosis.search.request import DiagnosisOptions
from rtctl.diagnosis.thresholds import ScreeningThresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.measured import open_dataset
from rtctl.session.validation.model_validation import simulation_for
from rtctl.simulations.vo2 import vo2_simulation

FloatArray = NDArray[np.float64]
LIMITS = ScreeningThresholds()
RATE = 2.0 * np.pi * 20.0
PERIOD = 2.0 * np.pi / RATE / PERIOD_S  # samples
LAG: dict[str, object] = {"id": "sensor.lag", "parameters": {"time_constant": {"value": 1.5e-3, "unit": "s"}}}


def of(reading: FloatArray, first: int = 0) -> FitRecord:
    stimulus = Stimulus(
        inputs={"drive": np.zeros(len(reading))}, holds={"drive": "zero"}, period_s=PERIOD_S,
        initial={"displacement": float(reading[0])}, read=frozenset({"displacement"}),
    )  # fmt: skip
    return FitRecord(name="r", stimulus=stimulus, measured={"displacement": reading}, first=first)


def swinging(samples: int = 4000, phase: float = 0.0, noise: float = 0.01) -> FloatArray:
    """A tone of RMS 1 that begins anywhere."""
    time_s = PERIOD_S * np.arange(samples)
    rng = np.random.default_rng(round(100 * phase))
    tone: FloatArray = np.sqrt(2.0) * np.sin(RATE * time_s + phase) + noise * rng.standard_normal(samples)
    return tone


def from_rest(samples: int = 4000, noise: float = 0.01) -> FloatArray:
    time_s = PERIOD_S * np.arange(samples)
    grown: FloatArray = swinging(samples, noise=noise) * (1.0 - np.exp(-0.5 * (RATE * time_s) ** 2 / 40.0))
    return grown


def warmed_up(
    fit: list[FitRecord], tests: list[FitRecord] | None = None, *, two_wells: bool = False
) -> Screened:
    screened = Screened(tuple(fit), tuple(tests or ()))
    return warm_up_moving_records(screened, RATE, LIMITS, two_wells=two_wells)


def let_go(samples: int = 4000) -> FloatArray:
    time_s = PERIOD_S * np.arange(samples)
    rng = np.random.default_rng(3)
    decayed: FloatArray = 5.0 * np.exp(-4.0 * time_s) * np.cos(RATE * time_s)
    return decayed + 0.01 * rng.standard_normal(samples)


def test_what_begins_in_motion_warms_up_for_some_periods() -> None:
    (fit,), (test,), said = warmed_up([of(swinging())], [of(swinging(phase=1.0))])
    assert LIMITS.warm_up_periods[0] * PERIOD <= fit.first == test.first <= LIMITS.warm_up_periods[1] * PERIOD
    assert "2 of 2 records begin in motion" in said[0]
    for one, phase in ((fit, 0.0), (test, 1.0)):
        expected = np.sqrt(2.0) * RATE * np.cos(phase)
        assert one.stimulus.initial["velocity"] == pytest.approx(expected, abs=0.2 * RATE)


def test_between_two_wells_few_periods_warm_up_since_nothing_scores_which_well_they_end_in() -> None:
    (one,), _, _ = warmed_up([of(swinging())], two_wells=True)
    assert one.first == round(LIMITS.warm_up_periods_two_wells[0] * PERIOD)
    assert has_two_wells(device(stiffness=(-1.6e4, "1/s^2"), stiffness_cubic=(10.0, "1/(mm^2*s^2)")))
    assert not has_two_wells(device())


def test_at_most_a_quarter_of_a_record_warms_up_and_what_is_ignored_already_counts() -> None:
    short, ignoring = of(swinging(400)), of(swinging(), first=1000)
    (short, ignoring), _, said = warmed_up([short, ignoring])
    assert (short.first, ignoring.first) == (100, 1000)
    assert "1 of 2 records begin in motion" in said[0]


def test_records_from_rest_or_let_go_are_scored_from_their_first_sample() -> None:
    records = [of(from_rest()), of(let_go())]
    fit, _, said = warmed_up(records)
    assert list(fit) == records
    assert not said


def test_beside_others_in_motion_those_at_rest_stay_whole_and_those_that_are_said_to_be_let_go() -> None:
    said = of(let_go())
    said = dataclasses.replace(said, stimulus=dataclasses.replace(said.stimulus, read=frozenset()))
    records = [of(swinging()), of(let_go()), of(from_rest()), said]
    (swung, in_passing, rested, released), _, _ = warmed_up(records)
    assert swung.first > 0 < in_passing.first
    assert rested.first == released.first == 0


def test_noise_that_could_be_a_velocity_is_none() -> None:
    rng = np.random.default_rng(5)
    for _ in range(20):
        noisy = of(from_rest() + 0.1 * rng.standard_normal(4000))
        assert warmed_up([noisy]).fit[0].first == 0


def test_the_first_half_period_of_a_small_motion_before_the_record_is_not_scored() -> None:
    """A moving base moves the device before its drive does; by its first sample a lag of the sensor was no rival."""
    (moved, still), _, said = warmed_up([of(from_rest(noise=1e-3) + 0.1 * swinging()), of(from_rest())])
    assert (moved.first, still.first) == (int(0.5 * PERIOD), 0)
    assert said[0].startswith("1 of 2 records begin with a small motion")


def driven(drive: FloatArray) -> FitRecord:
    record = of(from_rest(len(drive)))
    return dataclasses.replace(record, stimulus=dataclasses.replace(record.stimulus, inputs={"drive": drive}))


def test_the_first_half_period_under_a_drive_that_is_at_work_is_not_scored() -> None:
    tone = np.cos(RATE * PERIOD_S * np.arange(4000))
    (sudden, quiet, short, constant), _, said = warmed_up(
        [driven(tone), driven(tone - tone[0]), driven(tone[:600]), driven(np.ones(4000))]
    )
    assert sudden.first == int(0.5 * PERIOD)
    assert short.first == 6, "a hundredth of it"
    assert quiet.first == constant.first == 0
    assert said[0].startswith("the drive of 2 of 4 records is not zero at their first sample")


def test_a_late_drive_that_was_off_before_the_record_is_a_delay_alone(tmp_path: Path) -> None:
    """A simulation holds the first value of the drive backwards: what that does is no cause."""
    late: dict[str, object] = {"id": "drive.delay", "parameters": {"delay": {"value": 7.3e-3, "unit": "s"}}}
    records = []
    for seed, use in ((1, "fit"), (2, "test")):
        drive = noise_drive(seed, 9.0, samples=3000)
        drive[:2] = 15.0
        before = np.concatenate((np.zeros(40), drive))
        records.append((drive, measured(device(late), before, noise=1e-4)[40:], use))
    answer = answer_to(tmp_path, records, "drive.delay,sensor.lag,drive.lag")
    assert answer["verdict"] == "explained"
    (cause,) = answer["causes"]
    assert cause["id"] == "drive.delay"
    assert cause["parameters"]["delay"]["value"] == pytest.approx(7.3e-3, rel=1e-3)


def in_a_steady_state(seed: int, level: float) -> tuple[FloatArray, FloatArray]:
    """Drive and reading of the second of two equal periods, held between samples."""
    drive = np.tile(noise_drive(seed, level, samples=3000), 2)
    return drive[3000:], measured(device(LAG), drive, hold="zero")[3000:]


@pytest.mark.slow
def test_of_a_linear_device_in_a_steady_state_a_lag_of_the_sensor_is_not_told_from_one_of_the_drive(
    tmp_path: Path,
) -> None:
    """They are one law there; only what they are taken to hold at the first sample made one of them look right."""
    records = [
        (*in_a_steady_state(seed, level), use)
        for seed, level, use in ((1, 6.0, "fit"), (2, 9.0, "fit"), (3, 7.5, "test"))
    ]
    manifest = write_case(tmp_path, records, more='hold = "zero"')
    answer = json_of(manifest, tmp_path / "model.toml", "sensor.lag,drive.lag")
    (cause,) = answer["causes"]
    assert answer["verdict"] == "explained"
    assert {cause["id"], *cause["indistinguishable_from"]} == {"sensor.lag", "drive.lag"}
    assert any("3 of 3 records begin in motion" in warning for warning in answer["warnings"])


def test_a_start_that_the_scored_samples_have_forgotten_stays_where_the_record_shows_it() -> None:
    """It would go anywhere else, and a law that is added to the model would begin there."""
    heavy, drive = device(damping=(60.0, "1/s")), noise_drive(1, samples=3000)
    reading = measured(heavy, np.tile(drive, 2))[3000:]
    speed = float(np.gradient(reading, PERIOD_S)[0])
    stimulus = Stimulus(
        inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S,
        initial={"displacement": float(reading[0]), "velocity": speed},
    )  # fmt: skip
    record = FitRecord(name="r", first=1500, stimulus=stimulus, measured={"displacement": reading})
    subject = subject_of("oscillator")
    problem = Problem(subject=subject, records=(record,), scales=subject.scales((record,)))
    off = {"damping": (80.0, "1/s"), "stiffness": (1.2e4, "1/s^2")}
    found = fit_hypothesis(problem, device(**off), ())
    assert found is not None
    assert found.values[0] == pytest.approx(60.0, rel=0.01)
    assert abs(found.start(0)[0] - reading[0]) < problem.scales.displacement
    assert abs(found.start(0)[1] - speed) < problem.scales.velocity


@njit(cache=True)
def bouc_wen(force: FloatArray, step_s: float) -> FloatArray:  # pragma: no cover - compiled
    """Displacement [m] under a periodic force [N]; Noel and Schoukens, Hysteretic benchmark with a dynamic nonlinearity
    (2016), eq. 1 and 2 with the parameters of table 1.
    """
    read = np.empty(len(force))
    state, slope = np.zeros(3), np.zeros((4, 3))
    share = (0.0, 0.5, 0.5, 1.0)
    for k in range(len(force)):
        read[k] = state[0]
        ends = force[k], force[(k + 1) % len(force)]
        for stage in range(4):
            here = state + share[stage] * step_s * slope[stage - 1] if stage else state
            y, v, z = here
            u = ends[0] + share[stage] * (ends[1] - ends[0])
            slope[stage, 0] = v
            slope[stage, 1] = (u - 10.0 * v - 5e4 * y - z) / 2.0
            slope[stage, 2] = 5e4 * v - 1e3 * (0.8 * abs(v) * z - 1.1 * v * abs(z))
        state = state + step_s / 6.0 * (slope[0] + 2.0 * slope[1] + 2.0 * slope[2] + slope[3])
    return read


BENCHMARK = """
[dataset]
name = "Bouc-Wen"
plant = "oscillator"
[signals.drive]
role = "input"
column = "force"
unit = "N"
hold = "band-limited"
[signals.displacement]
role = "output"
unit = "mm"
"""


@pytest.mark.slow
def test_the_hysteretic_benchmark_is_named_from_its_linear_model_and_its_numbers_are_found(
    tmp_path: Path,
) -> None:
    """Periods of a steady state, as the benchmark has them: multisines of 5 to 150 Hz, 50 N, sampled at 750 Hz."""
    rate_hz, finer, samples, noise_mm = 750.0, 20, 4096, 8e-4
    manifest = BENCHMARK
    for k, use in enumerate(("fit", "fit", "test")):
        rng = np.random.default_rng(k)
        lines = np.zeros(samples * finer // 2 + 1, complex)
        excited = np.arange(int(5.0 * samples / rate_hz), int(150.0 * samples / rate_hz))
        lines[excited] = np.exp(2j * np.pi * rng.random(len(excited)))
        force = np.fft.irfft(lines)
        force *= 50.0 / force.std()
        reading = 1e3 * bouc_wen(np.tile(force, 2), 1.0 / rate_hz / finer)[-samples * finer :: finer]
        table = np.column_stack((force[::finer], reading + noise_mm * rng.standard_normal(samples)))
        np.savetxt(tmp_path / f"r{k}.csv", table, delimiter=",", header="force,displacement", comments="")
        manifest += f'[[records]]\nfile = "r{k}.csv"\nsample_rate_hz = {rate_hz}\nuse = "{use}"\n'
    (tmp_path / "dataset.toml").write_text(manifest)
    model = MODEL.replace("430.0", "480.0").replace("mm/s^2/V", "mm/s^2/N").replace("1.58e4", "4.5e4")
    (tmp_path / "model.toml").write_text(model)
    ids = "hysteresis.bouc_wen,stiffness.cubic,stiffness.viscoelastic,sensor.saturation,damping.quadratic"
    command = ["diagnose", str(tmp_path / "dataset.toml"), "--model", str(tmp_path / "model.toml"), "--quiet"]
    assert main([*command, "--mechanisms", ids, "--out", str(tmp_path / "out")]) == 0
    found = simulation_for(tmp_path / "out" / "model-extended.toml", open_dataset(tmp_path / "dataset.toml"))
    values = {one.name.split(".")[-1]: one.value for one in found.parameters}
    assert [one.id for one in found.mechanisms] == ["hysteresis.bouc_wen"]
    assert values["damping"] == pytest.approx(5.0, rel=0.01)
    assert values["stiffness"] == pytest.approx(2.5e4, rel=0.01)
    assert values["level"] / values["displacement"] == pytest.approx(2.5e4, rel=0.01)
    assert values["bend"] / values["loop"] == pytest.approx(-1.1 / 0.8, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("cut", [0, 340])
def test_what_a_film_remembers_of_a_history_that_is_not_known_is_no_gap(cut: int) -> None:
    """Cut from the middle of a record, it begins hot, on any branch; it forgets that with the next large swings."""
    whole = dataset(share=0.0)
    model = identified(whole)
    records = tuple(
        one
        if one.use == "identify"
        else dataclasses.replace(one, signals={name: values[cut:] for name, values in one.signals.items()})
        for one in whole.records
    )
    problem = dataclasses.replace(whole, records=records)
    simulation = vo2_simulation(model, UNITS, "model.toml")
    ids = ("actuation.delay", "sensor.lag", "sensor.ageing", "thermal.second_time_constant")
    answer = diagnose(problem, model, simulation, ids, DiagnosisOptions(threads=1))
    assert answer.verdict == "adequate"
    said = [one for one in answer.warnings if "where a full cooling leaves the device" in one]
    assert len(said) == (cut > 0)
    scored = [record.first for record in (*answer.problem.records, *answer.tests)]
    assert 0 < max(scored) < 700 if cut else max(scored) == 0
