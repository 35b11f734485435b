"""Units at the edges: jumps within steps, inputs that are read as soon as they are set, values beyond their limits."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from export.fmu_cases import free_runs
from export.test_fmu_vo2 import CASES, vo2

import rtctl

pytest.importorskip("fmpy")
STEP_S = 1e-3
LAG = """
[model]
kind = "equations"
[model.inputs]
u = { unit = "V" }
[model.states]
x = { unit = "V", rate = "(u - x)/tau" }
[model.outputs]
y = { unit = "V", value = "x" }
direct = { unit = "V", value = "u" }
[model.parameters]
tau = { value = 1.0, unit = "ms" }
"""
DELAY = (
    '\n[[model.mechanisms]]\nid = "input.u.delay"\nparameters = {{ delay = {{ value = {}, unit = "ms" }} }}\n'
)
BACKLASH = (
    '\n[[model.mechanisms]]\nid = "input.u.backlash"\nparameters = { width = { value = 0.1, unit = "V" } }\n'
)
OFFSET = (
    '\n[[model.mechanisms]]\nid = "input.u.offset"\nparameters = { offset = { value = 0.5, unit = "V" } }\n'
)
COUNTED = """
[model.events.passed]
when = "u - 1.05*one"
direction = "rising"
set = { count = "count + 1" }
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "model.toml"
    path.write_text(text)
    return path


def stepped(folder: Path, **more: str) -> rtctl.Dataset:
    """Return a record whose input steps from 0 to 1 V after the first of 30 held samples."""
    signals = {"u": np.r_[0.0, np.ones(29)], "y": np.zeros(30), "direct": np.zeros(30)}
    signals |= {name: np.zeros(30) for name in more}
    record = rtctl.Record(name="a", period_s=STEP_S, use="test", signals=signals)
    units = {"u": "V", "y": "V", "direct": "V", **more}
    return rtctl.write_dataset(
        folder / "data", [record], name="x", plant="equations", units=units, holds={"u": "zero"}
    )


@pytest.mark.parametrize("delay_ms", [3.0, 3.1, 3.5, 3.7, 3.9])
def test_a_late_jump_does_not_go_beyond_its_levels_before_a_backlash(delay_ms: float, tmp_path: Path) -> None:
    model, data = written(tmp_path, LAG + DELAY.format(delay_ms) + BACKLASH), stepped(tmp_path)
    assert rtctl.simulate(model, data).records["a"].simulated["y"][-1] == pytest.approx(0.9, abs=1e-6)
    assert max(free_runs(model, data, tmp_path).values()) < 1e-12


def test_a_late_jump_passes_no_event_beyond_its_levels(tmp_path: Path) -> None:
    text = LAG.replace(
        "[model.outputs]",
        'count = { unit = "1", rate = 0 }\n[model.outputs]\nn = { unit = "1", value = "count" }',
    )
    text = (
        text.replace("[model.parameters]", '[model.parameters]\none = { value = 1.0, unit = "V" }') + COUNTED
    )
    model, data = written(tmp_path, text + DELAY.format(3.7)), stepped(tmp_path, n="1")
    assert rtctl.simulate(model, data).records["a"].simulated["n"][-1] == 0.0


class Driven:
    """A unit of FMI 3.0 that is moved by hand."""

    def __init__(self, path: Path) -> None:
        from fmpy import extract, read_model_description
        from fmpy.fmi3 import FMU3Slave

        told = read_model_description(str(path))
        self._reference = {one.name: one.valueReference for one in told.modelVariables}
        self._unit = FMU3Slave(
            guid=told.guid, unzipDirectory=extract(str(path)), instanceName="a",
            modelIdentifier=told.coSimulation.modelIdentifier,
        )  # fmt: skip
        self._unit.instantiate()
        self._unit.enterInitializationMode()
        self._time_s = 0.0

    def begin(self, **values: float) -> None:
        for name, value in values.items():
            self.set(name, value)
        self._unit.exitInitializationMode()

    def set(self, name: str, value: float) -> None:
        self._unit.setFloat64([self._reference[name]], [value])

    def get(self, name: str) -> float:
        return self._unit.getFloat64([self._reference[name]])[0]

    def step(self, h: float) -> None:
        self._unit.doStep(self._time_s, h)
        self._time_s += h

    def close(self) -> None:
        self._unit.terminate()
        self._unit.freeInstance()


@pytest.fixture
def closing() -> Iterator[list[Driven]]:
    made: list[Driven] = []
    yield made
    for one in made:
        one.close()


def test_an_input_behind_an_offset_is_read_as_soon_as_it_is_set(
    tmp_path: Path, closing: list[Driven]
) -> None:
    unit = Driven(rtctl.export_fmu(written(tmp_path, LAG + OFFSET), tmp_path / "a.fmu", step_s=STEP_S).path)
    closing.append(unit)
    unit.begin(u=2.0)
    assert unit.get("direct") == 2.5
    unit.step(STEP_S)
    unit.set("u", 5.0)
    assert unit.get("direct") == 5.5


@pytest.mark.parametrize("case", ["hysteresis.creep", "structure.resonance"])
def test_a_mechanism_that_is_switched_on_later_begins_where_the_plant_is(
    case: str, tmp_path: Path, closing: list[Driven]
) -> None:
    unit = Driven(rtctl.export_fmu(vo2(tmp_path, case), tmp_path / "a.fmu", step_s=STEP_S).path)
    closing.append(unit)
    size = f"{case}.{next(iter(CASES[case]))}"
    value = CASES[case][size.rpartition(".")[2]]
    unit.begin(current=8.0, **{size: 0.0})
    for _ in range(300):
        unit.step(STEP_S)
    before = [unit.get(name) for name in ("resistance", "deflection")]
    unit.set(size, value)
    unit.step(STEP_S)
    np.testing.assert_allclose([unit.get(name) for name in ("resistance", "deflection")], before, rtol=1e-6)


def test_a_vo2_goes_on_from_the_current_of_its_initialisation(tmp_path: Path, closing: list[Driven]) -> None:
    unit = Driven(rtctl.export_fmu(vo2(tmp_path), tmp_path / "a.fmu", step_s=STEP_S).path)
    closing.append(unit)
    unit.begin(current=4.0)
    assert unit.get("surrogate") == pytest.approx(4.0)
    unit.set("current", 8.0)
    unit.step(1e-4)
    assert 4.0 < unit.get("surrogate") < 4.5


def test_values_beyond_their_limits_are_refused(tmp_path: Path, closing: list[Driven]) -> None:
    unit = Driven(
        rtctl.export_fmu(vo2(tmp_path, "structure.resonance"), tmp_path / "a.fmu", step_s=STEP_S).path
    )
    closing.append(unit)
    unit.begin(current=6.0)
    with pytest.raises(Exception, match="fmi3SetFloat64"):
        unit.set("structure.resonance.damping_ratio", 1.5)
    unit.step(STEP_S)
    assert np.isfinite(unit.get("deflection"))


def test_a_substep_that_nobody_could_wait_for_is_told(tmp_path: Path, closing: list[Driven]) -> None:
    unit = Driven(rtctl.export_fmu(vo2(tmp_path), tmp_path / "a.fmu", step_s=STEP_S).path)
    closing.append(unit)
    unit.begin(current=6.0, longest_step=4e-12)
    with pytest.raises(Exception, match="fmi3DoStep"):
        unit.step(0.01)


def test_a_negative_delay_and_one_that_no_unit_remembers_are_told(tmp_path: Path) -> None:
    early = written(tmp_path, LAG + DELAY.format(-1.0))
    with pytest.raises(rtctl.InputError, match=r"parameter delay = -0\.001 s must lie between 0 and inf s"):
        rtctl.export_fmu(early, tmp_path / "a.fmu")
    long = written(tmp_path, LAG + DELAY.format(1e6))
    with pytest.raises(rtctl.InputError, match=r"input\.u\.delay of 1000 s holds 1e\+06 communication steps"):
        rtctl.export_fmu(long, tmp_path / "a.fmu", step_s=STEP_S)
