"""References are what a person computes by hand, in um, whatever unit or percentage the file used."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from rtctl.signals.levels import Level, hold, parse_level, samples_in
from rtctl.signals.references import Multisine, Steps

LOW, HIGH = 10.0, 60.0  # um
TIME = 1e-3 * np.arange(1000)


def steps(**tables: object) -> Steps:
    return Steps.model_validate({"hold": "0.1 s", "levels": ["0 %", "100 %", "30 um", "0.02 mm"], **tables})


def test_steps_are_held_and_start_over() -> None:
    reference = steps().build(TIME, LOW, HIGH)
    assert reference.shape == TIME.shape
    wanted = [[10.0, 60.0, 30.0, 20.0][k // 100 % 4] for k in range(1000)]
    assert reference.tolist() == pytest.approx(wanted)


def test_a_hold_shorter_than_a_period_is_refused() -> None:
    with pytest.raises(
        ValueError, match=r"reference.hold = 0.0001 s is shorter than the loop's period 0.001 s"
    ):
        steps(hold="0.1 ms").build(TIME, LOW, HIGH)


def test_a_multisine_by_hand() -> None:
    reference = Multisine.model_validate(
        {
            "offset": "30 um",
            "sines": [
                {"amplitude": "4 um", "frequency": "1 Hz"},
                {"amplitude": "10 %", "frequency": "600 1/min", "phase": "90 deg"},
            ],
        }
    )
    wanted = 30.0 + 4.0 * np.sin(2 * np.pi * TIME) + 5.0 * np.cos(2 * np.pi * 10.0 * TIME)
    np.testing.assert_allclose(reference.build(TIME, LOW, HIGH), wanted, atol=1e-10)


def test_percent_of_an_amplitude_knows_no_offset_of_a_level_does() -> None:
    assert Level(50.0, True).resolve(LOW, HIGH) == 35.0
    assert Level(50.0, True).resolve_width(LOW, HIGH) == 25.0
    assert Level(50.0, False).resolve(LOW, HIGH) == Level(50.0, False).resolve_width(LOW, HIGH) == 50.0


@pytest.mark.parametrize(
    ("raw", "level"),
    [("30 um", (30.0, False)), ("0.03 mm", (30.0, False)), (" 12.5 % ", (12.5, True)), ("-1%", (-1.0, True))],
)
def test_levels_of_a_file(raw: str, level: tuple[float, bool]) -> None:
    parsed = parse_level(raw, "um")
    assert parsed.value == pytest.approx(level[0])
    assert parsed.relative is level[1]


@pytest.mark.parametrize("raw", ["5", 5, "5 mA", "x %", "%", "nan %", "inf um", "1e400 um", True, None, []])
def test_what_is_no_level_is_refused(raw: object) -> None:
    with pytest.raises(ValueError, match=r"um|finite"):
        parse_level(raw, "um")


@pytest.mark.parametrize(
    "tables",
    [
        {"levels": []},
        {"hold": "0 s"},
        {"hold": "inf s"},
        {"hold": "1 um"},
        {"levels": ["1 mA"]},
        {"holds": "1 s"},
    ],
)
def test_steps_that_cannot_be_are_refused(tables: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        steps(**tables)


def test_hold_and_samples() -> None:
    assert hold([1.0, 2.0], 3).tolist() == [1.0, 1.0, 1.0, 2.0, 2.0, 2.0]
    assert samples_in(0.3, 0.1, "key") == 3, "0.3 / 0.1 is a little less than 3"
    with pytest.raises(ValueError, match="key = 0"):
        samples_in(0.0, 0.1, "key")
