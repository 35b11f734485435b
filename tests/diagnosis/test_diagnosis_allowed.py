"""The misfit that is no gap: what the model's own identification promises, within bounds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from vo2_model_cases import PERIOD_S, predict, simulation, telegraph

from rtctl.border.simulation import Stimulus
from rtctl.diagnosis.diagnose import LEAST_ALLOWED, ON_OTHER_LOOPS, allowing
from rtctl.diagnosis.hypothesis import Data
from rtctl.diagnosis.subjects import SUBJECTS
from rtctl.diagnosis.subjects.log_reading import LOG_RESISTANCE
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import scales_of

SUBJECT = SUBJECTS["vo2"]


def data() -> Data:
    stimulus = Stimulus(inputs={"current": telegraph(800, 1)}, holds={"current": "zero"}, period_s=PERIOD_S)
    resistance, deflection = predict(simulation(), stimulus)
    readings = {LOG_RESISTANCE: np.log(resistance), "deflection": deflection}
    records = (FitRecord(name="r", stimulus=stimulus, measured=readings, first=0),)
    return Data(
        subject=SUBJECT,
        records=records,
        scales=scales_of(records, "deflection", "current"),
        steps_per_period=8.0,
    )


@pytest.mark.parametrize(
    ("share", "allowed"),
    [(0.001, ON_OTHER_LOOPS * 0.001), (1e-6, LEAST_ALLOWED), (0.3, SUBJECT.allowed_share)],
    ids=["as promised", "no less than tables have", "no more than is no gap"],
)
def test_a_model_is_allowed_what_its_identification_left(share: float, allowed: float) -> None:
    seen = data()
    model = replace(
        simulation().model,
        reading_error=share * seen.size(LOG_RESISTANCE),
        deflection_error=share * seen.size("deflection"),
    )
    found = allowing(seen, model).allowed
    assert set(found) == {LOG_RESISTANCE, "deflection"}
    for name, square in found.items():
        assert np.sqrt(square) == pytest.approx(allowed * seen.size(name))


def test_an_oscillator_is_allowed_no_misfit() -> None:
    seen = replace(data(), subject=SUBJECTS["oscillator"])
    assert allowing(seen, None) is seen
