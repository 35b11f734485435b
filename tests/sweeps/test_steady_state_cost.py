"""What a steady state costs: few periods a row, in any units; and the rows by which a sweep is screened."""

from __future__ import annotations

import numpy as np
import pytest
from test_steady_state import UNITS, model, simulated, swept

from plant_sim.oscillator.model import simulation_of_data
from plant_sim.oscillator.steady.shooting import largest_multiplier
from rtctl.border.model_file import ModelFile, Value
from rtctl.border.work import metered
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.sweep_record import shorten

NEAR = np.linspace(99.95, 100.05, 41)
"""Frequencies [Hz] about the resonance of a quality factor of 3,000."""


@pytest.mark.parametrize("unit", [1.0, 1e-3, 1e6])
def test_the_largest_multiplier_does_not_depend_on_the_units_of_the_states(unit: float) -> None:
    """Its power 4096 alone did: an orbit of Q = 3,000 was told unstable, and followed for 3,200 periods a row."""
    turn = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
    scaled = 0.9999 * np.array([[1.0, 1.0 / unit], [unit, 1.0]]) * turn
    assert largest_multiplier(scaled.copy()) == pytest.approx(0.9999, abs=1e-7)
    assert largest_multiplier(1.00002 / 0.9999 * scaled) == pytest.approx(1.00002, abs=1e-7)


def narrow(mass_ratio: float, second_hz: float = 300.0) -> ModelFile:
    """The resonator with a quality factor of 3,000 and a small second mass on it, at a frequency of its own."""
    second = {"mass_ratio": (mass_ratio, ""), "frequency": (second_hz, "Hz"), "damping_ratio": (0.01, "")}
    made = model(0.0, mode__second=second)
    parameters = {
        **made.model.parameters,
        "damping": Value(value=2.0 * np.pi * 100.0 / 3000.0, unit="1/s"),
    }
    return made.model_copy(update={"model": made.model.model_copy(update={"parameters": parameters})})


def test_a_row_of_two_modes_costs_a_few_periods() -> None:
    simulation = simulation_of_data(narrow(2e-6, 30.0), UNITS, "model")
    values = np.array([one.value for one in simulation.parameters])
    with metered() as work:
        simulation.predict(swept(NEAR, 1e-3), values)
    assert work.steps / len(NEAR) < 5.0 * 86 * 5  # five periods of 86 steps by five lanes


def test_the_amplitude_of_two_modes_is_the_transfer_function() -> None:
    """A tuned mass: stiffness and damping between the two; the whole moves as one far below the second mode."""
    found = simulated(narrow(1e-3), NEAR, 1e-3)
    alone = simulated(narrow(0.0), NEAR, 1e-3)
    peak, peak_alone = NEAR[np.abs(found).argmax()], NEAR[np.abs(alone).argmax()]
    assert peak - peak_alone == pytest.approx(
        -0.05, abs=0.01
    )  # 1e-3 more mass: half of it lower, 100 Hz * 5e-4


def test_few_rows_of_a_sweep_are_rows_from_the_whole_of_it() -> None:
    """The first ones alone, which a record in time gives, are far from the resonance."""
    frequency = np.linspace(90.0, 110.0, 801)
    z = simulated(model(0.0), frequency, 0.1)
    record = FitRecord(
        name="sweep",
        stimulus=swept(frequency, 0.1),
        measured={"displacement": np.column_stack([z.real, z.imag]).reshape(-1)},
    )
    short = shorten(record, 160)
    rows = short.stimulus.inputs["frequency"][::2]
    assert 70 <= len(rows) <= 80
    assert short.samples == 2 * len(rows)
    assert (rows[0], rows[-1]) == (90.0, 110.0)
    assert (np.diff(rows) > 0.0).all()
    kept = short.measured["displacement"][::2] + 1j * short.measured["displacement"][1::2]
    assert np.abs(kept).max() > 0.999 * np.abs(z).max()
    assert ((rows > 98.0) & (rows < 102.0)).sum() > 30
    assert shorten(record, 5000) is record
