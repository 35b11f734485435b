"""The page on mechanisms: its example runs and does what its sentence says, its table is the registry."""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from plant_sim.oscillator import mechanisms
from plant_sim.oscillator.mechanism import OscillatorMechanism
from plant_sim.oscillator.mechanisms import MECHANISMS
from plant_sim.oscillator.model import oscillator_simulation
from rtctl.border.mechanisms import Parameter
from rtctl.border.model_file import read_model_file
from rtctl.border.simulation import Stimulus

PAGE = Path(__file__).resolve().parents[2] / "docs" / "mechanisms.md"
TEXT = PAGE.read_text(encoding="utf-8")
NOMINAL = """
[model]
kind = "oscillator"
[model.parameters]
damping = { value = 2.0, unit = "1/s" }
stiffness = { value = 8882.6, unit = "1/s^2" }
drive_gain = { value = 300.0, unit = "mm/s^2/V" }
"""
PERIOD_S = 1.0 / 900.0


def block(language: str) -> str:
    """The only one of that language on the page."""
    (found,) = re.findall(rf"```{language}\n(.*?)```", TEXT, flags=re.DOTALL)
    return str(found)


@pytest.fixture
def example(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """The page's module, imported as if its file stood where the page says."""
    (tmp_path / "stiffness_thermal.py").write_text(block("python"), encoding="utf-8")
    monkeypatch.setattr(mechanisms, "__path__", [*mechanisms.__path__, str(tmp_path)])
    name = f"{mechanisms.__name__}.stiffness_thermal"
    yield importlib.import_module(name)
    del sys.modules[name]
    del mechanisms.stiffness_thermal


def simulated(model: Path, drive: NDArray[np.float64]) -> NDArray[np.float64]:
    bound = oscillator_simulation(
        read_model_file(model, "oscillator"), {"drive": "V", "displacement": "mm"}, "page"
    )
    record = Stimulus(inputs={"drive": drive}, holds={"drive": "linear"}, period_s=PERIOD_S)
    values = np.array([parameter.value for parameter in bound.parameters])
    found: NDArray[np.float64] = bound.predict(record, values).outputs["displacement"][0]
    return found


def test_the_example_runs_from_a_model_file_and_does_what_its_sentence_says(
    example: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(MECHANISMS, example.MECHANISM.id, example.MECHANISM)
    nominal, extended = tmp_path / "nominal.toml", tmp_path / "extended.toml"
    nominal.write_text(NOMINAL)
    extended.write_text(NOMINAL + block("toml"))
    t = PERIOD_S * np.arange(700)
    drive = np.cos(90.0 * t)

    def rate(at: float, y: NDArray[np.float64]) -> list[float]:
        force = 300.0 * np.interp(at, t, drive) - 2.0 * y[1] - 8882.6 * y[0]
        return [y[1], force + 0.3 * y[2] * y[0], (y[1] ** 2 - y[2]) / 2.0]

    oracle = solve_ivp(
        rate, (0.0, t[-1]), [0.0] * 3, method="DOP853", rtol=1e-9, atol=1e-9, t_eval=t, max_step=PERIOD_S
    )  # fmt: skip
    found = simulated(extended, drive)
    peak = np.abs(oracle.y[0]).max()
    assert np.abs(found - simulated(nominal, drive)).max() > 0.05 * peak
    assert np.abs(found - oracle.y[0]).max() < 1e-5 * peak


def unit(declared: Parameter) -> str:
    bare = re.sub(r"\(\{(\w)\}\)", r"\1", declared.unit)
    return bare.format(z="z", u="u", y="y")


def row(mechanism: OscillatorMechanism) -> str:
    """Of the page's table."""
    sentence = re.sub(r"\{(\w+)\}", r"*\1*", mechanism.statement)
    parameters = "; ".join(
        f"`{declared.name}` [{unit(declared)}] {declared.meaning}{' (shape)' if declared.is_shape else ''}"
        for declared in mechanism.parameters
    )
    return f"| `{mechanism.id}` | {sentence} | {parameters} |".replace("|z'| z'", r"\|z'\| z'")


def test_the_table_is_the_registry() -> None:
    table = [line for line in TEXT.splitlines() if re.match(r"\| `\w+\.\w+` \|", line)]
    expected = [row(mechanism) for mechanism in MECHANISMS.values()]
    assert table == expected, "the table of docs/mechanisms.md must be\n" + "\n".join(expected)


def test_the_files_that_the_page_points_to_exist() -> None:
    package = PAGE.parents[1] / "plant_sim" / "oscillator"
    for name in re.findall(r"`([\w/]+\.py)`", TEXT):
        assert any(
            (folder / name).exists() for folder in (PAGE.parents[1], package, package / "mechanisms")
        ), name
