"""Holds of a staircase that end before the device has settled are told, with a length that would do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rtctl
from rtctl.identification.vo2.settling import assess_settling, describe_holds, describe_settling

ROOT = Path(__file__).resolve().parents[2]
DEVICE = (ROOT / "plant_sim/vo2/devices/vo2_a.toml").read_text(encoding="utf-8")


def staircase(time_constant_s: float, hold_s: float, period_s: float = 1e-3) -> rtctl.Record:
    """Readings that follow a random staircase of current with one time constant."""
    draw = np.random.default_rng(5)
    current = np.repeat(draw.uniform(4.0, 8.0, 80), round(hold_s / period_s))
    decay, film = np.exp(-period_s / time_constant_s), [current[0]]
    for level in current[:-1]:
        film.append(level + (film[-1] - level) * decay)
    readings = 1e5 - 1e4 * np.array(film) + draw.normal(0.0, 1.0, len(current))
    return rtctl.Record(
        name="r02-random",
        period_s=period_s,
        use="identify",
        signals={"current": current, "resistance": readings},
        conditions={"excitation": "random"},
    )


@pytest.mark.parametrize(
    ("time_constant_s", "hold_s", "short", "useless"),
    [
        (1.8e-3, 10e-3, False, False),
        (4e-3, 12e-3, True, False),
        (0.25, 10e-3, True, True),
        (0.25, 0.1, True, True),
        (0.25, 1.5, False, False),
    ],
)
def test_holds_of_any_device_are_compared_with_its_time_constant(
    time_constant_s: float, hold_s: float, short: bool, useless: bool
) -> None:
    found = assess_settling(staircase(time_constant_s, hold_s), time_constant_s, 0.01 * time_constant_s)
    assert (found.is_short, found.is_useless) == (short, useless)
    assert found.needed_s >= 6.0 * time_constant_s


def test_the_note_says_the_command_and_a_length_that_would_do() -> None:
    record = staircase(0.25, 0.1)
    said = describe_settling(record, assess_settling(record, 0.25, 0.001))
    assert said.startswith(
        "the holds of record r02-random (100 ms) end before the device has settled: 67.0% of a "
    )
    assert '--set "excitation.2.hold=1.5 s"' in said


def test_several_staircases_are_told_the_one_command_for_all() -> None:
    first, other = replace(staircase(0.25, 0.1), name="r00-damped"), staircase(0.25, 0.2)
    *each, command = describe_holds([(one, assess_settling(one, 0.25, 0.001)) for one in (first, other)])
    assert len(each) == 2
    assert 'acquire_vo2 --set "excitation.0.hold=1.5 s" --set "excitation.2.hold=1.5 s"' in command
    settled = staircase(1.8e-3, 20e-3)
    assert describe_holds([(settled, assess_settling(settled, 1.8e-3, 1e-5))]) == []


def test_holds_of_a_record_of_others_are_told_without_a_command_that_does_not_make_it() -> None:
    own = [replace(staircase(0.25, 0.1), name=name, conditions={}) for name in ("steps1", "r01-steps")]
    said = describe_holds([(one, assess_settling(one, 0.25, 0.001)) for one in own])
    assert len(said) == 2
    for one in said:
        assert "rtctl acquire" not in one
        assert one.endswith(
            'with holds of 1.5 s or more; if it is no quasi-static staircase, give it use = "fit"'
        )


def test_where_the_time_constant_is_not_known_the_last_samples_tell() -> None:
    record = staircase(0.25, 10e-3)
    found = assess_settling(record, 1.8e-3, np.inf)
    assert np.isnan(found.to_come)
    assert found.is_useless
    assert "the last sample still brings" in describe_settling(record, found)
    assert found.needed_s == pytest.approx(50e-3)


@pytest.mark.slow
def test_a_slow_device_is_not_run_with_a_model_of_the_way_and_is_identified_with_longer_holds(
    tmp_path: Path,
) -> None:
    slow = tmp_path / "slow.toml"
    slow.write_text(DEVICE.replace('time_constant = "1.8 ms"', 'time_constant = "250 ms"'))
    device = {"driver.device": str(slow)}
    with pytest.raises(
        rtctl.RunError, match=r"not to be trusted, so nothing was run with it: .*the holds of record r"
    ):
        rtctl.run("steps", settings=device)
    longer = {f"excitation.{k}.hold": "1.5 s" for k in range(7)} | {"scenario.period": "50 ms"}
    data = rtctl.acquire("acquire_vo2", tmp_path / "data", settings={**device, **longer})
    fit = rtctl.identify(data, plays=2, starts=2, cells=40)
    assert fit.trusted
    assert not any("settled" in one for one in fit.warnings)
    assert fit.model.content.time_constant_s == pytest.approx(0.25, rel=0.01)
