"""An acceleration that is read just after a held drive jumps, or just before: what the readings show of it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from plant_sim.oscillator.model import oscillator_simulation
from rtctl.border.arrays import FloatArray
from rtctl.border.model_file import ModelFile
from rtctl.border.simulation import Stimulus
from rtctl.measured.dataset import Record
from rtctl.measured.records.instrument import instrument_of
from rtctl.measured.records.jump_reading import find_after_jumps
from rtctl.measured.stimulus import make_stimulus

PERIOD_S, RATE, DAMPING, GAIN = 1e-3, 200.0, 8.0, 30.0
CUBIC = 4e9


def drive(samples: int, highest: float, seed: int = 1) -> FloatArray:
    noise = np.random.default_rng(seed).standard_normal(samples)
    band = sosfilt(butter(2, [0.01, highest], "band", fs=1.0, output="sos"), noise)
    return np.asarray(band / band.std())


def accelerations(u: FloatArray) -> dict[str, FloatArray]:
    """Before and after each jump of the held drive, by steps of a fiftieth of a sample (velocity Verlet)."""
    steps, z, v = 50, 0.0, 0.0
    h, before, after = PERIOD_S / steps, [], []

    def felt(force: float) -> float:
        return GAIN * force - DAMPING * v - RATE**2 * z - CUBIC * z**3

    for k in range(len(u)):
        before.append(felt(u[max(k - 1, 0)]))
        after.append(felt(u[k]))
        for _ in range(steps):
            v += 0.5 * h * felt(u[k])
            z += h * v
            v += 0.5 * h * felt(u[k])
    return {"before": np.array(before), "after": np.array(after)}


def seen(u: FloatArray, a: FloatArray) -> bool:
    """Whether a record shows that its acceleration is read after the jumps."""
    record = Record(name="r", period_s=PERIOD_S, signals={"drive": u, "acceleration": a})
    return "acceleration" in find_after_jumps([record], ["drive"])


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.1])
@pytest.mark.parametrize("highest", [0.06, 0.2, 0.45])
def test_the_readings_show_on_which_side_of_a_jump_they_are(highest: float, noise: float) -> None:
    u = drive(2000, highest)
    for side, a in accelerations(u).items():
        read = a + noise * a.std() * np.random.default_rng(2).standard_normal(len(a))
        assert seen(u, read) == (side == "after")


def test_what_a_drive_leaks_into_a_reading_is_no_reading_after_the_jump() -> None:
    u = drive(2000, 0.3)
    before = accelerations(u)["before"]
    assert not seen(u, before + 0.2 * GAIN * u)


@pytest.mark.parametrize(
    ("u", "a"),
    [
        (np.zeros(500), np.sin(np.arange(500.0))),
        (drive(20, 0.3), drive(20, 0.4)),
        (drive(500, 0.3), np.full(500, np.nan)),
        (drive(500, 0.3), np.zeros(500)),
    ],
    ids=["no drive", "few rows", "no numbers", "no motion"],
)
def test_what_cannot_be_seen_is_taken_for_before_the_jump(u: FloatArray, a: FloatArray) -> None:
    assert not seen(u, a)


def test_records_of_one_instrument_are_read_alike() -> None:
    """A slow drive's record alone cannot tell, and would be simulated otherwise than the others."""
    records = []
    for name, highest, noise in (("fast", 0.3, 0.01), ("slow", 0.02, 0.2)):
        u = drive(2000, highest)
        a = accelerations(u)["after"]
        read = a + noise * a.std() * np.random.default_rng(2).standard_normal(len(a))
        records.append(Record(name=name, period_s=PERIOD_S, signals={"drive": u, "acceleration": read}))
    holds, after = {"drive": "zero"}, frozenset({"acceleration"})
    assert [make_stimulus(one, holds).after_jumps for one in records] == [after, frozenset()]
    instrument = instrument_of(records, "oscillator", holds)
    together = [instrument.applied(one) for one in records]
    assert [make_stimulus(one, holds).after_jumps for one in together] == [after, after]


@pytest.mark.parametrize("side", ["before", "after"])
@pytest.mark.parametrize("corrected", [False, True], ids=["hold of the manifest", "hold of a mechanism"])
def test_a_record_is_simulated_as_it_was_read(side: str, corrected: bool) -> None:
    u = drive(1500, 0.4)
    a = accelerations(u)[side]
    parameters = {
        "damping": {"value": DAMPING, "unit": "1/s"}, "stiffness": {"value": RATE**2, "unit": "1/s^2"},
        "stiffness_cubic": {"value": CUBIC, "unit": "1/(m^2*s^2)"},
        "drive_gain": {"value": GAIN, "unit": "m/(s^2*V)"},
    }  # fmt: skip
    held = {"id": "input.hold", "parameters": {"toward_zero": {"value": 1.0, "unit": "dimensionless"}}}
    model = ModelFile.model_validate(
        {"model": {"kind": "oscillator", "parameters": parameters, "mechanisms": [held] if corrected else []}}
    )
    simulation = oscillator_simulation(model, {"drive": "V", "acceleration": "m/s^2"}, "test")
    record = Record(name="r", period_s=PERIOD_S, signals={"drive": u, "acceleration": a})
    stimulus: Stimulus = make_stimulus(record, {"drive": "linear" if corrected else "zero"})
    assert ("acceleration" in stimulus.after_jumps) == (side == "after")
    values = np.array([one.value for one in simulation.parameters])
    found = simulation.predict(stimulus, values).outputs["acceleration"][0]
    assert np.abs(found - a).max() < 2e-3 * np.abs(a).max()
