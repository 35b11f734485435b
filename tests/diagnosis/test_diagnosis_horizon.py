"""Between two wells a model with an error parts from the record; what it follows until then says what is missing."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from diagnosis_cases import PERIOD_S, device, noise_drive

from rtctl.border.simulation import Simulation, Stimulus
from rtctl.diagnosis.approach import FAR, fitted_nominal, misfit
from rtctl.diagnosis.gate import examine
from rtctl.diagnosis.horizon import MOST, _share_after, beginnings
from rtctl.diagnosis.hypothesis import Data, Hypothesis
from rtctl.diagnosis.subjects import SUBJECTS
from rtctl.identification.fit_record import FitRecord
from rtctl.identification.scales import scales_of

DELAY = {"id": "drive.delay", "parameters": {"delay": {"value": 2e-3, "unit": "s"}}}
WELLS = {"stiffness": (-1.6e3, "1/s^2"), "stiffness_cubic": (30.0, "1/(mm^2*s^2)"), "damping": (3.0, "1/s")}
"""At 7.3 mm either way; it rocks in one at 9 Hz."""
SAMPLES = 4000


def record_of(plant: Simulation, seed: int) -> FitRecord:
    drive = noise_drive(seed, level=4.0, samples=SAMPLES)
    stimulus = Stimulus(
        inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S, initial={"displacement": 7.3}
    )
    values = np.array([one.value for one in plant.parameters])
    reading = plant.predict(stimulus, values, np.array([[7.3, 0.0]])).outputs["displacement"][0]
    reading = reading + 0.02 * np.random.default_rng(seed).standard_normal(SAMPLES)
    return FitRecord(name=f"r{seed}", stimulus=stimulus, measured={"displacement": reading}, first=1)


@cache
def hopping() -> tuple[Data, Hypothesis]:
    """Three records of a device whose drive comes late, and the best that a model without knows of them."""
    records = tuple(record_of(device(DELAY, **WELLS), seed) for seed in (1, 2, 3))
    data = Data(
        subject=SUBJECTS["oscillator"], records=records, scales=scales_of(records), steps_per_period=64.0
    )
    nominal = fitted_nominal(data, device(**WELLS), ())
    assert nominal is not None
    return data, nominal


def test_where_it_hops_the_beginnings_show_what_is_missing() -> None:
    data, nominal = hopping()
    assert misfit(data, nominal) > FAR
    found = beginnings(data, nominal)
    assert found is not None
    short, refitted = found
    kept = sum(record.samples for record in short.records)
    assert 0.1 * 3 * SAMPLES < kept < 0.9 * 3 * SAMPLES
    assert misfit(short, refitted) < FAR
    for record in short.records:
        whole = next(one for one in data.records if one.name == record.name)
        np.testing.assert_array_equal(
            record.measured["displacement"], whole.measured["displacement"][: record.samples]
        )
    examined = examine(refitted, short, ("drive.delay", "friction.coulomb", "stiffness.quintic"))
    named = [one.mechanism != "" for one in examined.directions]
    removed = np.where(named, examined.projected.single(), 0.0)
    assert examined.directions[int(np.argmax(removed))].mechanism == "drive.delay"


def test_what_is_followed_to_its_end_and_what_is_never_followed_is_left_alone() -> None:
    data, nominal = hopping()
    noise = np.random.default_rng(0).standard_normal(SAMPLES)
    deaf = tuple(replace(one, measured={"displacement": noise}) for one in data.records)
    assert beginnings(replace(data, records=deaf), nominal) is None
    found = beginnings(data, nominal)
    assert found is not None
    assert beginnings(*found) is None


@pytest.mark.parametrize("hops", [True, False])
def test_one_record_that_hops_is_enough_where_it_holds_most_of_the_error(hops: bool) -> None:
    """However small that is beside the motion of all records."""
    data, nominal = hopping()
    found = beginnings(data, nominal)
    assert found is not None
    short, followed = found
    record = data.records[0]
    line = followed.sensitivity.linearise(record, followed.shared, followed.starts[0], data.steps_per_period)
    assert line is not None
    reading = record.measured["displacement"].copy()
    reading[record.first :] += line.residual[0]
    reading[SAMPLES // 2 :] += 2.0 * float(np.std(reading)) * hops
    records = (*short.records, replace(record, measured={"displacement": reading}))
    more = replace(followed, starts=np.vstack((followed.starts, followed.starts[:1])))
    assert (_share_after(replace(short, records=records), more) > MOST) == hops


@pytest.mark.parametrize("hold", ["band-limited"])
def test_a_drive_that_needs_its_future_is_not_cut(hold: str) -> None:
    data, nominal = hopping()
    held = tuple(replace(one, stimulus=replace(one.stimulus, holds={"drive": hold})) for one in data.records)
    assert beginnings(replace(data, records=held), nominal) is None
