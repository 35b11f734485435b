"""The best linear oscillator as a start: also where nothing oscillates, or a pole is too fast for the samples."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import lsim

import rtctl
from rtctl.border.arrays import FloatArray
from rtctl.border.simulation import Stimulus
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.oscillator.linear_start import fit_linear

LEVITATED = """
[model]
kind = "oscillator"
[model.parameters]
damping = { value = 0.4, unit = "1/s" }
stiffness = { value = -300.0, unit = "1/s^2", fixed = true }
drive_gain = { value = 470.0, unit = "mm/(s^2*A)" }
"""
PERIOD_S = 2e-3
SAMPLES = 1500


def drive_of(seed: int) -> FloatArray:
    """Smooth noise, of up to about 40 Hz."""
    drive = np.convolve(np.random.default_rng(seed).standard_normal(SAMPLES + 16), np.hanning(16), "valid")
    return drive[:SAMPLES]


def response(damping: float, stiffness: float, order: int, drive: FloatArray) -> FloatArray:
    """z, z' or z'' of z'' + damping z' + stiffness z = 300 u, u linear between its samples, by SciPy's lsim."""
    time = PERIOD_S * np.arange(len(drive))
    _, reading, _ = lsim(([300.0] + [0.0] * order, [1.0, damping, stiffness]), drive, time)
    return np.asarray(reading, np.float64)


@pytest.mark.parametrize("name", ["displacement", "velocity", "acceleration"])
@pytest.mark.parametrize(
    ("damping", "stiffness"), [(4.0, 9e3), (150.0, 5e3), pytest.param(900.0, 9e3, id="no oscillation")]
)
def test_its_poles_and_its_gain_are_found_from_any_response(
    name: str, damping: float, stiffness: float
) -> None:
    order = ["displacement", "velocity", "acceleration"].index(name)
    records = []
    for seed in (1, 2):
        drive = drive_of(seed)
        reading = response(damping, stiffness, order, drive)
        noise = 0.01 * reading.std() * np.random.default_rng(seed).standard_normal(SAMPLES)
        stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)
        records.append(FitRecord(name=f"r{seed}", stimulus=stimulus, measured={name: reading + 0.3 + noise}))
    found = fit_linear(records)
    assert found is not None
    assert found.damping == pytest.approx(damping, rel=0.05)
    assert found.stiffness == pytest.approx(stiffness, rel=0.05)
    assert found.drive_gain == pytest.approx(300.0, rel=0.05)
    assert found.residual_share < 0.02


def test_of_a_drive_that_does_not_vary_there_is_none() -> None:
    stimulus = Stimulus(inputs={"drive": np.ones(SAMPLES)}, holds={"drive": "linear"}, period_s=PERIOD_S)
    assert (
        fit_linear([FitRecord(name="r", stimulus=stimulus, measured={"displacement": drive_of(1)})]) is None
    )


def identified(folder: Path, reading_of: object) -> rtctl.Fit:
    records = []
    for seed in (1, 2):
        drive = 1.0 + 0.3 * drive_of(seed)
        noise = np.random.default_rng(seed + 10).standard_normal(SAMPLES)
        reading = reading_of(drive)  # type: ignore[operator]
        reading = reading + 2e-3 * reading.std() * noise
        signals = {"drive": drive, "displacement": reading}
        records.append(rtctl.Record(name=f"r{seed}", period_s=PERIOD_S, signals=signals))
    units = {"drive": "V", "displacement": "um"}
    return rtctl.identify(
        rtctl.write_dataset(
            folder, records, name="stack", plant="oscillator", units=units, holds={"drive": "linear"}
        )
    )


def plays(drive: FloatArray) -> FloatArray:
    """A piezo stack far below its resonance: the drive, and what eight plays of it add."""
    widths, state = np.linspace(0.02, 0.4, 8), np.zeros(8)
    reading = np.empty(len(drive))
    for k, u in enumerate(drive):
        state = np.clip(state, u - widths, u + widths)
        reading[k] = 10.0 * u + 3.0 * state.mean()
    return reading


def test_a_stack_far_below_its_resonance_is_identified_by_its_gain_at_rest(tmp_path: Path) -> None:
    """No weak form starts here: the acceleration is noise."""
    values = identified(tmp_path, plays).parameters
    assert values["drive_gain"].value / values["stiffness"].value == pytest.approx(12.0, rel=0.15)


def test_a_pole_that_is_faster_than_the_samples_show_is_limited_and_told(tmp_path: Path) -> None:
    """A lag of 20 ms alone: the second pole ran off to where a sample took 5,000 steps."""

    def lagging(drive: FloatArray) -> FloatArray:
        time = PERIOD_S * np.arange(len(drive))
        return np.asarray(
            lsim(([12.0], [0.02, 1.0]), drive, time, X0=[12.0 * drive[0] * 0.02])[1], np.float64
        )

    fit = identified(tmp_path, lagging)
    values = fit.parameters
    assert values["damping"].value <= 20.0 / PERIOD_S
    assert values["damping"].value / values["stiffness"].value == pytest.approx(0.02, rel=0.05)
    assert any("beyond which these samples show nothing" in one for one in fit.warnings)


def levitated(seed: int) -> tuple[FloatArray, FloatArray]:
    """Current and place of a mass that a magnet pulls away from its middle and feedback holds; 2 um of noise."""
    draw, samples = np.random.default_rng(seed), 10_000
    system = np.array([[0.0, 1.0, 0.0], [300.0, -0.5, 500.0], [0.0, 0.0, 0.0]])
    step, state = expm(system * PERIOD_S), np.zeros(2)
    wanted = np.convolve(draw.standard_normal(samples + 40), np.ones(40) / 40.0, "valid")[:samples]
    current, place = np.empty(samples), np.empty(samples)
    for k in range(samples):
        place[k] = state[0] + 2e-3 * draw.standard_normal()
        current[k] = -1.6 * state[0] - 0.12 * state[1] + 1.2 * wanted[k]
        state = step[:2, :2] @ state + step[:2, 2] * current[k]
    return current, place


def test_an_unstable_plant_that_feedback_holds_is_identified_and_trusted(tmp_path: Path) -> None:
    """Its free runs run away from every start; its segments leave noise."""
    records = []
    for seed in (1, 2):
        current, place = levitated(seed)
        signals = {"drive": current, "displacement": place}
        records.append(rtctl.Record(name=f"r{seed}", period_s=PERIOD_S, signals=signals))
    units = {"drive": "A", "displacement": "mm"}
    data = rtctl.write_dataset(
        tmp_path, records, name="magnet", plant="oscillator", units=units, holds={"drive": "zero"}
    )
    (tmp_path / "start.toml").write_text(LEVITATED, encoding="utf-8")
    fit = rtctl.identify(data, model=tmp_path / "start.toml")
    assert fit.trusted
    assert fit.parameters["drive_gain"].value == pytest.approx(500.0, rel=0.01)
    assert fit.parameters["damping"].value == pytest.approx(0.5, abs=0.1)


def test_a_model_that_runs_away_is_not_taken_for_chaos_and_not_trusted(tmp_path: Path) -> None:
    """A counter that shows a speed without its sign: no oscillator gives that, least an unstable one."""

    def unsigned(drive: FloatArray) -> FloatArray:
        return np.abs(response(8.0, 400.0, 0, drive - 1.0))

    assert not identified(tmp_path, unsigned).trusted
