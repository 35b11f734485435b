"""A parameter whose value is known may still not be constant; the extended model begins where the records do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rtctl
from rtctl import Record

HEATER = """[model]
kind = "equations"
[model.inputs]
U = {{ unit = "V" }}
[model.states]
heater = {{ unit = "K", rate = "(U^2/R - loss*(heater - room))/C", initial = {start} }}
[model.outputs]
T = {{ unit = "K", value = "heater" }}
[model.parameters]
R = {{ value = 12.0, unit = "ohm", fixed = true }}
loss = {{ value = 1.6, unit = "W/K", low = 0 }}
C = {{ value = 50.0, unit = "J/K", low = 0.1 }}
room = {{ value = 293.15, unit = "K", fixed = true }}
"""
NOISE_K = 0.02


def records_of(by_temperature: float) -> list[Record]:
    """Return three records of C T' = U^2 / (12 ohm (1 + k (T - 293.15 K))) - 1.6 W/K (T - 293.15 K), by RK4."""
    found = []
    for seed, use in ((1, "fit"), (2, "fit"), (3, "test")):
        rng = np.random.default_rng(seed)
        voltage = np.repeat(rng.uniform(0.0, 24.0, 15), 20)
        rise = np.zeros(300)

        def rate(x: float, u: float) -> float:
            return (u**2 / (12.0 * (1.0 + by_temperature * x)) - 1.6 * x) / 50.0

        for k in range(299):
            x, u = rise[k], voltage[k]
            a = rate(x, u)
            b = rate(x + 0.5 * a, u)
            c = rate(x + 0.5 * b, u)
            rise[k + 1] = x + (a + 2.0 * b + 2.0 * c + rate(x + c, u)) / 6.0
        reading = 293.15 + rise + NOISE_K * rng.standard_normal(300)
        found.append(Record(name=f"r{seed}", period_s=1.0, use=use, signals={"U": voltage, "T": reading}))
    return found


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> tuple[rtctl.Diagnosis, Path]:
    """Diagnosis of a heater whose known resistance grows with temperature, from a model that starts 2 K too high."""
    folder = tmp_path_factory.mktemp("heater")
    model = folder / "heater.toml"
    model.write_text(HEATER.format(start=295.15), encoding="utf-8")
    data = rtctl.write_dataset(
        folder / "data", records_of(0.0039), name="heater", plant="equations",
        units={"U": "V", "T": "K"}, holds={"U": "zero"},
    )  # fmt: skip
    candidates = ["parameter.R.dependence", "state.heater.quadratic", "output.T.saturation"]
    return rtctl.diagnose(data, model, mechanisms=candidates), folder


def test_a_fixed_parameter_that_depends_on_a_state_is_named(found: tuple[rtctl.Diagnosis, Path]) -> None:
    diagnosis, _ = found
    (cause,) = diagnosis.causes
    assert (diagnosis.verdict, cause.id) == ("explained", "parameter.R.dependence")
    assert cause.parameters["heater"].low < 0.0039 < cause.parameters["heater"].high


@pytest.mark.parametrize(
    ("moved", "offset", "told"),
    [(-273.15, None, "is said to be in K and lies between"), (-273.15, -273.15, "leads to temperatures below 0 K"),
     (-273.15, 273.15, ""), (0.0, None, "")],
)  # fmt: skip
def test_celsius_that_is_said_to_be_kelvin_is_told_once(
    tmp_path: Path, moved: float, offset: float | None, told: str
) -> None:
    model = tmp_path / "heater.toml"
    model.write_text(HEATER.format(start=293.15), encoding="utf-8")
    records = [
        replace(one, signals={**one.signals, "T": one.signals["T"] + moved}) for one in records_of(0.0)
    ]
    data = rtctl.write_dataset(
        tmp_path, records, name="h", plant="equations", units={"U": "V", "T": "K"}, holds={"U": "zero"}
    )
    if offset is not None:
        text = data.path.read_text(encoding="utf-8")
        data.path.write_text(text.replace("[signals.T]", f"[signals.T]\noffset = {offset}"), encoding="utf-8")
    read = rtctl.read_dataset(data.path)
    fit = rtctl.identify(read, model=model, starts=1)
    said = {*read.remarks, *fit.warnings}
    wanted = ["is said to be in K and lies between", "leads to temperatures below 0 K"]
    assert [sum(one in text for text in said) for one in wanted] == [int(one == told) for one in wanted]


def test_the_extended_model_is_as_good_in_simulate_as_diagnose_told(
    found: tuple[rtctl.Diagnosis, Path],
) -> None:
    diagnosis, folder = found
    assert diagnosis.gain is not None
    diagnosis.save(folder / "answer")
    scores = rtctl.simulate(folder / "answer" / "model-extended.toml", diagnosis.dataset).scores
    (test,) = [one.rms_error for one in scores if one.use == "test"]
    assert test == pytest.approx(diagnosis.gain.after, rel=0.02)
    assert test < 1.2 * NOISE_K
