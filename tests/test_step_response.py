"""Settling time, overshoot and settled error of a second-order response are those of the textbook."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rtctl.evaluation.setpoint_holds import holds_of
from rtctl.evaluation.step_response import step_responses, summarise_steps
from rtctl.evaluation.summary import verdict_in_words

PERIOD_S = 1e-3


def responses(output: np.ndarray, setpoint: np.ndarray) -> list:
    index = np.arange(len(setpoint), dtype=float)
    return step_responses(index, setpoint, output, PERIOD_S, holds_of(index, setpoint, PERIOD_S, 0.0))


def second_order(zeta: float, rate: float, time_s: np.ndarray) -> np.ndarray:
    root = math.sqrt(1.0 - zeta**2)
    return 1.0 - np.exp(-zeta * rate * time_s) * (
        np.cos(rate * root * time_s) + zeta / root * np.sin(rate * root * time_s)
    )


@pytest.mark.parametrize("height", [10.0, -4.0])
def test_a_second_order_step_has_its_overshoot_and_settles_within_its_envelope(height: float) -> None:
    zeta, rate = 0.4, 60.0
    time_s = PERIOD_S * np.arange(1000)
    setpoint = np.repeat([30.0, 30.0 + height], 1000)
    output = np.concatenate([np.full(1000, 30.0), 30.0 + height * second_order(zeta, rate, time_s)])
    (one,) = responses(output, setpoint)
    assert one.overshoot == pytest.approx(math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta**2)), rel=1e-3)
    envelope_s = -math.log(0.02 * math.sqrt(1.0 - zeta**2)) / (zeta * rate)
    assert one.settling_s is not None
    assert 0.6 * envelope_s < one.settling_s <= envelope_s + PERIOD_S
    assert one.settled_error == pytest.approx(0.0, abs=1e-6)


def test_what_stays_off_is_not_settled_and_its_error_is_told() -> None:
    setpoint = np.repeat([0.0, 10.0, 20.0], 100)
    output = setpoint.copy()
    output[100:200] = 9.5
    output[200:] = 20.0
    off, good = responses(output, setpoint)
    assert (off.settling_s, off.overshoot, off.settled_error) == (None, 0.0, 0.5)
    assert (good.settling_s, good.settled_error) == (0.0, 0.0)
    figures = summarise_steps([off, good], 1.0, "um")
    assert (figures["steps"], figures["settled"]) == (2, 1)
    assert figures["settled_error"] == {"median": 0.25, "max": 0.5, "unit": "um"}


def test_without_an_instrument_or_steps_there_are_no_figures() -> None:
    setpoint = np.repeat([0.0, 10.0], 100)
    assert responses(np.full(200, np.nan), setpoint) == []
    assert responses(np.zeros(200), np.zeros(200)) == []
    assert summarise_steps([], 1.0, "um") == {}


def test_pass_is_said_only_where_something_was_checked() -> None:
    met, unmeasured = {"met": True}, {"met": None}
    assert verdict_in_words({"verdict": "pass", "checks": [met, unmeasured]}) == "pass"
    assert verdict_in_words({"verdict": "pass", "checks": [unmeasured]}) == "nothing was checked"
    assert verdict_in_words({"verdict": "pass", "checks": []}) == "nothing was checked"
    assert verdict_in_words({"verdict": "fault", "checks": []}) == "fault"
