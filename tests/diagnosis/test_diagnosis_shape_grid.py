"""Shapes that a search begins with: a tone's frequency between two bins, a well's own excursion, a default or not."""

from __future__ import annotations

import numpy as np
import pytest
from vo2_model_cases import simulation

from plant_sim.oscillator.mechanisms import MECHANISMS
from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.problem.bounds import parameter_bounds
from rtctl.diagnosis.problem.fit import sensitivity_of
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.residual.shape_grid import shape_grid
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales
from rtctl.plants.vo2.log_resistance import LOG_RESISTANCE
from rtctl.simulations.vo2.mechanisms import MECHANISMS as OF_VO2
from rtctl.wiring_models import build_simulation

PERIOD_S = 1e-3
N = 4000


@pytest.mark.parametrize("frequency_Hz", [59.93, 60.0, 60.06, 63.11])
def test_hum_is_found_to_a_hundredth_of_a_bin(frequency_Hz: float) -> None:
    tables = {"damping": {"value": 4.0, "unit": "1/s"}, "stiffness": {"value": 1e4, "unit": "1/s^2"},
              "drive_gain": {"value": 1.0, "unit": "mm/s^2/V"}}  # fmt: skip
    simulation = build_simulation(
        ModelFile.model_validate({"model": {"kind": "oscillator", "parameters": tables}}),
        {"drive": "V", "displacement": "mm"}, "device",
    )  # fmt: skip
    hum = simulation.extended(("sensor.hum",)).mechanisms[-1]
    rng = np.random.default_rng(0)
    time_s = PERIOD_S * np.arange(N)
    residual = np.cos(2.0 * np.pi * frequency_Hz * time_s + 1.0) + 0.01 * rng.standard_normal(N)
    stimulus = Stimulus(inputs={"drive": rng.standard_normal(N)}, holds={"drive": "zero"}, period_s=PERIOD_S)
    records = (FitRecord(name="r", stimulus=stimulus, measured={"displacement": residual}),)
    problem = Problem(subject=subject_of("oscillator"), records=records, scales=estimate_scales(records))
    found = min(
        abs(one.values["frequency"] - frequency_Hz) for one in shape_grid(hum, problem, [residual[None]])
    )
    assert found < 0.01 / (N * PERIOD_S)


@pytest.mark.parametrize(("samples", "tried"), [(N, True), (20, False)], ids=["200 periods", "1 period"])
def test_hum_is_looked_for_only_in_records_that_hold_periods_of_it(samples: int, tried: bool) -> None:
    """With a phase of its own in each record, one period of a hum would be a drift of the reading."""
    drive = np.random.default_rng(0).standard_normal(samples)
    stimulus = Stimulus(inputs={"drive": drive}, holds={"drive": "zero"}, period_s=PERIOD_S)
    records = (FitRecord(name="r", stimulus=stimulus, measured={"displacement": drive}),)
    problem = Problem(subject=subject_of("oscillator"), records=records, scales=estimate_scales(records))
    assert bool(list(shape_grid(MECHANISMS["sensor.hum"], problem, [drive[None]]))) is tried


@pytest.mark.parametrize("well", [0.0, 2.0])
def test_a_spring_that_yields_is_looked_for_within_the_excursion_wherever_the_well_is(well: float) -> None:
    """A beam that stays in one well is far from zero, and yields over a part of its motion all the same."""
    motion = 0.1 * np.sin(np.arange(N) / 10.0)
    stimulus = Stimulus(inputs={"drive": motion}, holds={"drive": "zero"}, period_s=PERIOD_S)
    records = (FitRecord(name="r", stimulus=stimulus, measured={"displacement": well + motion}),)
    scales = estimate_scales(records)
    assert scales.excursion == pytest.approx(0.1 / np.sqrt(2.0), rel=1e-3)
    yields = next(one for one in MECHANISMS["hysteresis.bouc_wen"].parameters if one.name == "displacement")
    assert yields.scale(scales) == scales.excursion


def test_heat_that_the_loops_cannot_hold_is_looked_for_as_if_they_held_none_too() -> None:
    series = np.arange(float(N))
    stimulus = Stimulus(inputs={"current": series}, holds={"current": "zero"}, period_s=PERIOD_S)
    records = (FitRecord(name="r", stimulus=stimulus, measured={"deflection": series}),)
    problem = Problem(
        subject=subject_of("vo2"), records=records, scales=estimate_scales(records, "deflection", "current")
    )
    for identity, expected in (("sensor.self_heating", [1.0, 0.0]), ("thermal.nonlinear_loss", [1.0])):
        grid = list(shape_grid(OF_VO2[identity], problem, [series[None]]))
        assert [one.values["known"] for one in grid] == expected
        assert {one.trials for one in grid} == {1}


def vo2_data(current_mA: float, resistance_ohm: float) -> Problem:
    """Of a current, a deflection and a resistance of that size."""
    series = np.ones(N)
    stimulus = Stimulus(inputs={"current": current_mA * series}, holds={"current": "zero"}, period_s=PERIOD_S)
    measured = {LOG_RESISTANCE: np.log(resistance_ohm * series), "deflection": np.arange(float(N))}
    records = (FitRecord(name="r", stimulus=stimulus, measured=measured),)
    return Problem(subject=subject_of("vo2"), records=records, scales=subject_of("vo2").scales(records))


def test_a_shape_that_is_zero_in_most_devices_is_looked_for_in_multiples_of_its_scale() -> None:
    """Ten times of nothing is nothing: a pure phase that expands was never found."""
    problem = vo2_data(8.0, 5e4)
    made = simulation().extended(("hysteresis.rate_dependence",))
    sensitivity = sensitivity_of(problem, made, frozenset())
    low, high = parameter_bounds(problem, sensitivity)
    names = [sensitivity.simulation.parameters[i].name for i in sensitivity.free]
    for name, scale, signed in (
        ("activation", 1.0 / 64.0, False),
        ("expansion", problem.scales.excursion / 64.0, True),
    ):
        k = names.index(f"hysteresis.rate_dependence.{name}")
        assert high[k] * sensitivity.scale[k] == pytest.approx(10.0 * scale)
        assert low[k] * sensitivity.scale[k] == pytest.approx(-10.0 * scale if signed else 0.0)


def test_what_causes_are_compared_with_is_of_the_records() -> None:
    """A device that takes ten times the current, of a hundredth of the resistance, has other coefficients."""
    small, large = vo2_data(8.0, 5e4).scales, vo2_data(80.0, 5e2).scales
    assert small.sensed == pytest.approx(5e4)
    for identity, name, power in (
        ("thermal.latent_heat", "heat", 100.0), ("heater.tcr", "tcr", 0.01), ("sensor.crosstalk", "leak", 1e-3),
    ):  # fmt: skip
        (declared,) = (one for one in OF_VO2[identity].parameters if one.name == name)
        assert declared.scale(large) == pytest.approx(power * declared.scale(small))


@pytest.mark.parametrize(("frequency_Hz", "found"), [(0.5, []), (7.03, [7.03])])
def test_a_tone_is_looked_for_where_a_line_stands_of_which_each_record_holds_periods(
    frequency_Hz: float, found: list[float]
) -> None:
    """With a phase of its own in each record, one of few periods, or that is no line, would be any force."""
    tables = {"damping": {"value": 0.2, "unit": "1/s"}, "stiffness": {"value": 40.0, "unit": "1/s^2"},
              "drive_gain": {"value": 1.0, "unit": "mm/s^2/V"}}  # fmt: skip
    simulation = build_simulation(
        ModelFile.model_validate({"model": {"kind": "oscillator", "parameters": tables}}),
        {"drive": "V", "displacement": "mm"}, "device",
    )  # fmt: skip
    extended = simulation.extended(("base.motion",))
    rng = np.random.default_rng(0)
    time_s = PERIOD_S * np.arange(N)  # 4 s
    residuals = [
        np.cos(2.0 * np.pi * frequency_Hz * time_s + phase) + 0.1 * rng.standard_normal(N)
        for phase in (0.0, 2.0)
    ]
    stimulus = Stimulus(inputs={"drive": rng.standard_normal(N)}, holds={"drive": "zero"}, period_s=PERIOD_S)
    records = tuple(
        FitRecord(name=f"r{k}", stimulus=stimulus, measured={"displacement": one})
        for k, one in enumerate(residuals)
    )
    problem = Problem(subject=subject_of("oscillator"), records=records, scales=estimate_scales(records))
    mechanism = extended.mechanisms[-1]
    lines = [
        one.values["frequency"] for one in shape_grid(mechanism, problem, [one[None] for one in residuals])
    ]
    assert lines == pytest.approx(found, abs=0.1 / (N * PERIOD_S))
    chirp = np.cos(2.0 * np.pi * (3.0 + 1.5 * time_s) * time_s)
    assert not list(shape_grid(mechanism, problem, [residuals[0][None], chirp[None]]))
    fixed = frozenset(one.name for one in extended.parameters if one.name != "base.motion.frequency")
    sensitivity = sensitivity_of(problem, extended, fixed)
    low, _ = parameter_bounds(problem, sensitivity)
    (index,) = (
        k for k, one in enumerate(sensitivity.free)
        if extended.parameters[one].name == "base.motion.frequency"
    )  # fmt: skip
    assert low[index] * sensitivity.scale[index] == pytest.approx(2.5)
