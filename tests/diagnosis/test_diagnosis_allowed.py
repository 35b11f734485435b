"""The misfit that is no gap: what the model's own identification promises, within bounds."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from vo2_model_cases import PERIOD_S, predict, simulation, telegraph

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.nominal_fit.misfit.allowed_misfit import allow_misfit
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subjects import subject_of
from rtctl.diagnosis.thresholds import NominalFitThresholds
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import estimate_scales
from rtctl.measured.dataset import Dataset, Record
from rtctl.plants.vo2.diagnosis import ON_OTHER_LOOPS, ON_OTHER_RECORDS
from rtctl.plants.vo2.log_resistance import LOG_RESISTANCE

SUBJECT = subject_of("vo2")


def problem() -> Problem:
    stimulus = Stimulus(inputs={"current": telegraph(800, 1)}, holds={"current": "zero"}, period_s=PERIOD_S)
    resistance, deflection = predict(simulation(), stimulus)
    readings = {LOG_RESISTANCE: np.log(resistance), "deflection": deflection}
    records = (FitRecord(name="r", stimulus=stimulus, measured=readings, first=0),)
    return Problem(
        subject=SUBJECT,
        records=records,
        scales=estimate_scales(records, "deflection", "current"),
        steps_per_period=8.0,
    )


@pytest.mark.parametrize(
    ("share", "allowed"),
    [
        (0.003, 0.003),
        (1e-6, NominalFitThresholds().min_allowed_misfit),
        (0.3, SUBJECT.allowed_share),
        (None, SUBJECT.allowed_share),
    ],
    ids=["as promised", "no less than tables have", "no more than is no gap", "nothing promised"],
)
def test_a_model_is_allowed_what_its_identification_promises(share: float | None, allowed: float) -> None:
    seen = problem()
    names = (LOG_RESISTANCE, "deflection")
    found = allow_misfit(
        seen, {} if share is None else {name: share * seen.size(name) for name in names}
    ).allowed
    assert set(found) == set(names)
    for name, square in found.items():
        assert np.sqrt(square) == pytest.approx(allowed * seen.size(name))


@pytest.mark.parametrize(
    ("left", "promised"), [(0.01, ON_OTHER_LOOPS * 0.01), (1.0, 0.1)], ids=["what was left", "the noise"]
)
def test_it_promises_what_it_left_but_no_more_than_the_noise(left: float, promised: float) -> None:
    draw = np.random.default_rng(1)
    levels = np.repeat(draw.uniform(4.0, 8.0, 300), 20)
    signals = {
        "current": levels,
        "resistance": np.exp(9.0 - levels + 0.1 * draw.normal(size=len(levels))),
        "deflection": 5.0 * levels + 0.1 * draw.normal(size=len(levels)),
    }
    record = Record(name="s", use="identify", period_s=1e-3, signals=signals)
    staircase = Dataset(
        path=Path("dataset.toml"), name="s", plant="vo2", units={}, holds={}, records=(record,)
    )
    model = replace(simulation().model, reading_error=left, deflection_error=left)
    found = SUBJECT.stated_misfit(model, staircase)
    assert found == pytest.approx({LOG_RESISTANCE: promised, "deflection": promised}, rel=0.05)


def test_it_promises_what_it_predicted_of_other_swings_where_it_did() -> None:
    nothing = Dataset(path=Path("dataset.toml"), name="s", plant="vo2", units={}, holds={}, records=())
    model = replace(simulation().model, reading_error_elsewhere=0.02, deflection_error_elsewhere=0.7)
    found = SUBJECT.stated_misfit(model, nothing)
    assert found == {
        LOG_RESISTANCE: pytest.approx(ON_OTHER_RECORDS * 0.02), "deflection": pytest.approx(ON_OTHER_RECORDS * 0.7),
    }  # fmt: skip


def test_an_oscillator_is_allowed_no_misfit() -> None:
    seen = replace(problem(), subject=subject_of("oscillator"))
    assert allow_misfit(seen, {}) is seen
