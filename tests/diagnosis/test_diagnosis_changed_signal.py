"""A dead zone that every current exceeds is an offset of the current: it is told, and what else it may be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from vo2_model_cases import PERIOD_S, UNITS, predict, simulation, small_model, telegraph

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.diagnose import diagnose
from rtctl.diagnosis.report.changed_signal import differs_from_file
from rtctl.diagnosis.result import Diagnosis
from rtctl.diagnosis.search.holdout_error import simulate_free_run
from rtctl.diagnosis.search.request import DiagnosisOptions
from rtctl.diagnosis.thresholds import ReportThresholds, SearchThresholds, Thresholds
from rtctl.measured.dataset import Dataset, Record
from rtctl.simulations.vo2 import vo2_simulation

IDS = ("actuation.deadband", "actuation.delay")


def answer(
    offset_mA: float,
    ids: tuple[str, ...] = IDS,
    in_test_mA: float | None = None,
    thresholds: Thresholds | None = None,
    **hidden: dict[str, float],
) -> Diagnosis:
    """Diagnose the small model, its current off by an offset (another one in the test record), with hidden effects."""
    device, records = simulation(**hidden), []
    for seed, use in ((1, "fit"), (2, "fit"), (3, "test")):
        levels = telegraph(500, seed)
        offset = offset_mA if use == "fit" or in_test_mA is None else in_test_mA
        acting = Stimulus(inputs={"current": levels + offset}, holds={"current": "zero"}, period_s=PERIOD_S)
        resistance, deflection = predict(device, acting)
        draw = np.random.default_rng([seed, 1])
        signals = {
            "current": levels,
            "resistance": resistance * np.exp(2e-3 * draw.normal(size=len(levels))),
            "deflection": deflection + 0.05 * draw.normal(size=len(levels)),
        }
        records.append(Record(name=f"r{seed}", use=use, period_s=PERIOD_S, signals=signals))
    data = Dataset(
        path=Path("dataset.toml"), name="offset", plant="vo2", units=UNITS, holds={"current": "zero"},
        records=tuple(records),
    )  # fmt: skip
    return diagnose(
        data,
        small_model(),
        simulation(),
        ids,
        DiagnosisOptions(threads=1, thresholds=thresholds or Thresholds()),
    )


@pytest.mark.parametrize(
    ("offset_mA", "same"), [(-0.6, ("actuation.deadband",)), (0.6, ())], ids=["below zero", "above zero"]
)
def test_an_offset_without_which_the_error_returns_is_a_cause(
    offset_mA: float, same: tuple[str, ...]
) -> None:
    found = answer(offset_mA)
    assert found.verdict == "explained"
    cause = found.causes[0]
    assert (cause.id, cause.kind) == ("parameter.current_offset", "parameter")
    assert cause.parameters["current_offset"].value == pytest.approx(offset_mA, abs=0.03)
    assert cause.indistinguishable_from == same
    assert found.gain is not None
    assert found.gain.ratio_low > 2.0
    assert found.model.corrections["current_offset"].value == pytest.approx(offset_mA, abs=0.03)
    assert not any("the re-fit changed current_offset" in warning for warning in found.warnings)


def test_an_offset_of_the_size_of_identification_errors_is_none() -> None:
    assert answer(-0.003).verdict == "adequate"


@pytest.mark.parametrize("offset_mA", [0.0, -0.6])
def test_a_value_whose_interval_holds_that_of_the_file_has_not_changed(offset_mA: float) -> None:
    """Where the fit without a correction ended in another minimum, the correction seems to matter and is none."""
    tested = answer(offset_mA, ("actuation.delay",)).fits.after
    assert differs_from_file("parameter.current_offset", simulation(), tested) == (offset_mA != 0.0)


@pytest.mark.slow
def test_beside_another_cause_both_are_told_and_are_in_the_model() -> None:
    found = answer(-0.6, actuation__delay={"delay": 3e-3})
    assert found.verdict == "explained"
    assert {cause.id for cause in found.causes} == {"parameter.current_offset", "actuation.delay"}
    assert found.model.corrections["current_offset"].value == pytest.approx(-0.6, abs=0.03)
    assert [one.id for one in found.model.mechanisms] == ["actuation.delay"]


def test_a_heater_whose_resistance_grows_since_is_told_as_that_and_is_in_the_model() -> None:
    found = answer(0.0, (*IDS, "heater.tcr"), heater__tcr={"tcr": 4e-3, "known": 0.0})
    assert found.verdict == "explained"
    assert found.causes[0].id == "heater.tcr"
    assert found.causes[0].parameters["tcr"].value == pytest.approx(4e-3, rel=0.1)
    assert [one.id for one in found.model.mechanisms] == ["heater.tcr"]
    assert not found.warnings


def test_where_something_else_is_left_it_is_the_part_that_is_known() -> None:
    found = answer(-1.2, ("actuation.delay",), sensor__lag={"time_constant": 3e-3})
    assert found.verdict == "partly_explained"
    assert found.causes[0].id == "parameter.current_offset"
    assert found.causes[0].probability is None


@pytest.mark.parametrize("in_test_mA", [None, 0.0], ids=["shifted as well", "without an offset"])
def test_a_part_that_the_test_records_contradict_is_not_named(in_test_mA: float | None) -> None:
    found = answer(-1.2, ("actuation.delay",), in_test_mA, sensor__lag={"time_constant": 3e-3})
    assert (found.verdict == "partly_explained") == bool(found.causes) == (in_test_mA is None)
    assert any("does not fall with certainty" in text for text in found.warnings) == (in_test_mA is not None)


def test_of_parts_that_do_the_same_the_simplest_leads_and_of_many_none_is_named() -> None:
    """Beside a lag that is not in the catalogue, the cost of each says nothing of which one it is."""
    ids = ("actuation.deadband", "heater.tcr", "thermal.nonlinear_loss")
    limits = ReportThresholds(changed_signal_cost_ratio=1e6)
    for rivals, named in ((9, ["parameter.current_offset"]), (1, [])):
        thresholds = Thresholds(report=limits, search=SearchThresholds(most_part_rivals=rivals))
        found = answer(-1.2, ids, thresholds=thresholds, sensor__lag={"time_constant": 3e-3})
        assert [cause.id for cause in found.causes][:1] == named
        assert any("do not decide between them" in text for text in found.warnings) == (not named)


def test_a_current_that_leaks_into_the_reading_since_is_told_as_that() -> None:
    """Gain and offset of the resistance would take up most of it, in silence."""
    found = answer(
        0.0, ("actuation.delay", "sensor.crosstalk"), sensor__crosstalk={"leak": 900.0, "known": 0.0}
    )
    assert found.verdict == "explained"
    (cause,) = found.causes
    assert cause.id == "sensor.crosstalk"
    assert cause.parameters["leak"].value == pytest.approx(900.0, rel=0.1)
    assert [one.id for one in found.model.mechanisms] == ["sensor.crosstalk"]


@pytest.mark.parametrize("in_test_mA", [0.0, -0.003], ids=["left out", "kept"])
def test_the_error_that_is_told_is_that_of_the_model_that_is_handed_out(in_test_mA: float) -> None:
    """The fitted records have an offset of 3 uA; where the test record has none, the model leaves it out."""
    found = answer(-0.003, ("actuation.delay",), in_test_mA, actuation__delay={"delay": 3e-3})
    assert found.gain is not None
    assert found.loop is not None
    assert (found.loop.with_corrections is not None) == (not found.model.corrections) == (in_test_mA == 0.0)
    (test,) = found.tests
    made = vo2_simulation(found.model, UNITS, "handed out")
    off = simulate_free_run(made, test, "deflection").outputs["deflection"][0] - test.measured["deflection"]
    assert found.gain.after == pytest.approx(np.sqrt(np.mean(off[test.first :] ** 2)), rel=1e-3)


def test_an_offset_that_is_told_is_in_the_model_also_where_the_test_record_has_none() -> None:
    found = answer(-0.6, ("actuation.delay",), 0.0, actuation__delay={"delay": 3e-3})
    assert "parameter.current_offset" in {cause.id for cause in found.causes}
    assert found.model.corrections["current_offset"].value == pytest.approx(-0.6, abs=0.03)
