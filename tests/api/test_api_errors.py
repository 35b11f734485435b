"""The errors of a run are read by one name in every unit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import rtctl
from rtctl.api.runs.errors import error_figures, errors_of_outputs
from rtctl.evaluation.metrics import NOT_SCORED, score
from rtctl.evaluation.outputs import to_table


@pytest.mark.parametrize("unit", ["um", "V", "degC"])
def test_the_figures_of_a_summary_are_the_same_in_every_unit(unit: str) -> None:
    wanted, reference = np.array([1.0, 2.0, 3.0]), np.array([1.0, 2.5, 4.0])
    figures = error_figures(score(wanted, reference, 10.0).to_dict(unit))
    assert figures.unit == unit
    assert figures.mean_abs == pytest.approx(0.5)
    assert figures.rms == pytest.approx(np.sqrt(1.25 / 3.0))
    assert figures.max_abs == pytest.approx(1.0)
    assert figures.max_abs_percent == pytest.approx(10.0)


@pytest.mark.parametrize("unit", ["um", "V"])
def test_what_no_instrument_measured_is_none(unit: str) -> None:
    figures = error_figures(NOT_SCORED.to_dict(unit))
    assert (figures.mean_abs, figures.rms, figures.max_abs, figures.unit) == (None, None, None, unit)


def test_a_run_tells_how_far_it_was_off_beside_its_summary(model_file: Path) -> None:
    run = rtctl.run("steps", model=model_file, settings={"scenario.duration": "0.05 s"})
    assert run.tracking.unit == run.self_sensing.unit == "um"
    for figures, table in (
        (run.tracking, run.summary["tracking"]),
        (run.self_sensing, run.summary["self_sensing"]),
    ):
        assert figures.mean_abs == table["mean_abs_um"]
        assert figures.rms == table["rms_um"]
        assert figures.max_abs == table["max_abs_um"]
        assert figures.mean_abs_percent == table["mean_abs_percent"]
    error = run.signals["setpoint"] - run.signals["deflection"]
    assert run.tracking.max_abs == pytest.approx(np.abs(error).max())


def test_outputs_of_several_have_errors_in_their_own_units() -> None:
    found = score(np.array([1.0, 2.0]), np.array([1.5, 2.0]), 10.0)
    outputs = errors_of_outputs(
        {"outputs": to_table({"x": ("um", found, NOT_SCORED), "a": ("V", NOT_SCORED, found)})}
    )
    assert (outputs["x"].tracking.max_abs, outputs["x"].tracking.unit) == (0.5, "um")
    assert (outputs["a"].self_sensing.max_abs, outputs["a"].self_sensing.unit) == (0.5, "V")
    assert outputs["x"].self_sensing.rms is None
    assert errors_of_outputs({}) == {}
