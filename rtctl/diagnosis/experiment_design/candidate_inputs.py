"""Inputs that a plant can take, as tables of a scenario: what is scored are the levels that `rtctl acquire` plays, held
between samples as the records so far are.

Kinds x levels (a quarter, half and all of the largest drive seen) x rates (about the dominant frequency of the motion);
at full level also sampled more slowly.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import butter, sosfiltfilt

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subject import Subject
from rtctl.registry import plant_kind
from rtctl.scenario.schema import checked_scenario

LEVELS = (0.25, 0.5, 1.0)
MOST_SAMPLES = 4096
LEAST_A_PERIOD = 3.0
"""Samples of a slower record in a period of the motion."""
LONGER = 4
"""Times the records so far: where these are so short that they leave names open, a longer one tells more."""
SQUARE_WAVES = (0.5, 0.7, 1.0, 1.4, 2.0, 4.0, 8.0, 16.0)
"""Times the dominant frequency: all of the drive's power at a few lines. A delay and a lag part far above it; what they
are fitted beside is learned near it.
"""
LEAST_HELD = 2
"""Samples of half a square wave."""
MOST_LEVELS = 511
"""Of a telegraph, which is then repeated."""
HIGHEST = 0.45
"""Of the sample rate: no line lies above."""


class Input(NamedTuple):
    """One entry: in words, as a table, as levels (n,) in the drive's unit, one a period."""

    statement: str
    scenario: Mapping[str, Any]
    levels: FloatArray
    period_s: float


class _Setting(NamedTuple):
    """What the tables of one level have in common."""

    level: float
    """Share of the range around its middle."""
    frequency_hz: float
    duration_s: float
    period_s: float
    slower: int
    """Times the period of the records so far."""
    at: str

    @property
    def amplitude(self) -> str:
        """Excursion from the middle."""
        return f"{50.0 * self.level:g} %"

    @property
    def span(self) -> tuple[str, str]:
        """Lowest and highest level."""
        return f"{50.0 - 50.0 * self.level:g} %", f"{50.0 + 50.0 * self.level:g} %"

    def band(self, low: float, high: float) -> tuple[dict[str, str], str]:
        """In multiples of the dominant frequency, as keys and in words; no line beyond what the samples carry."""
        last = min(high * self.frequency_hz, HIGHEST / self.period_s)
        first = min(low * self.frequency_hz, 0.3 * last)
        keys = {"frequency_low": f"{first:.6g} Hz", "frequency_high": f"{last:.6g} Hz"}
        return keys, f"{first:.3g} to {last:.3g} Hz"

    def holds(self, periods: float) -> tuple[float, int]:
        """Length [s] of a hold of so many periods of the motion, and how many there are, two at least."""
        hold = min(max(self.period_s, periods / self.frequency_hz), 0.5 * self.duration_s)
        return hold, max(2, int(self.duration_s / hold))

    def seconds(self, value: float) -> str:
        """As a scenario has it: whole periods, one at least."""
        return f"{max(1, round(value / self.period_s)) * self.period_s:.9g} s"


def drive_range(problem: Problem) -> tuple[float, float]:
    """[drive unit] Largest seen, to both sides where the drive has a sign."""
    drive = problem.subject.drive
    low = min(float(record.stimulus.inputs[drive].min()) for record in problem.records)
    high = max(float(record.stimulus.inputs[drive].max()) for record in problem.records)
    if low < 0.0:
        return -max(-low, high), max(-low, high)
    return low, high


def menu(problem: Problem, units: Mapping[str, str]) -> list[Input]:
    """All entries; none where nothing drove the records or they are too fast for a device's clock."""
    low, high = drive_range(problem)
    period_us = round(1e6 * min(record.period_s for record in problem.records))
    if not (high > low and period_us >= 1):
        return []
    period_s = 1e-6 * period_us
    samples = min(MOST_SAMPLES, LONGER * int(np.median([record.samples for record in problem.records])))
    frequency = problem.scales.rate / (2.0 * np.pi)
    settings = [(level, 1) for level in LEVELS]
    settings += [
        (LEVELS[-1], k) for k in problem.subject.slower if frequency * k * period_s * LEAST_A_PERIOD <= 1.0
    ]
    made = []
    for level, slower in settings:
        at = f"at {level:.0%} of {high:.4g} {units[problem.subject.drive]}"
        if slower > 1:
            at += f", a sample each {slower * period_s:.4g} s"
        setting = _Setting(level, frequency, samples * period_s, slower * period_s, slower, at)
        for statement, table in _tables(setting):
            scenario = _scenario(problem.subject, table, units, low, high, period_us)
            checked = checked_scenario(scenario, "menu")
            try:
                levels = checked.excitation[0].build(low, high, setting.period_s)
            except ValueError:  # records so short that no line of the band fits into one
                continue
            made.append(Input(statement, scenario, levels, setting.period_s))
    return made


def band_limited(levels: FloatArray, period: float) -> FloatArray:
    """`levels` (n,) as a chain carries them that is band-limited between its samples: nothing near half the sample
    rate, and from zero to zero within two periods of the motion, of so many samples each.
    """
    width = min(len(levels) // 4, max(8, int(2.0 * period)))
    rise = 0.5 - 0.5 * np.cos(np.pi * np.arange(width) / max(width, 1))
    window = np.concatenate((rise, np.ones(len(levels) - 2 * width), rise[::-1]))
    smooth: FloatArray = sosfiltfilt(butter(6, 0.5, output="sos"), levels * window)
    return smooth


def _tables(setting: _Setting) -> list[tuple[str, dict[str, Any]]]:
    """In words, and as `[[excitation]]`."""
    own = {"period": f"{round(1e6 * setting.period_s)} us"} if setting.slower > 1 else {}
    made = (*_multisines(setting), *_sweeps(setting), *_levels(setting))
    return [(statement, table | own) for statement, table in made]


def _multisines(s: _Setting) -> Iterator[tuple[str, dict[str, Any]]]:
    for words, low, high in (("narrow", 0.6, 1.6), ("wide", 0.15, 3.0)):
        edges, span = s.band(low, high)
        table: dict[str, Any] = {"kind": "random_multisine", "seed": 1, "amplitude": s.amplitude, **edges}
        table |= {"duration": s.seconds(0.8 * s.duration_s), "ring_down": s.seconds(0.2 * s.duration_s)}
        yield f"{words} multisine, {span}, {s.at}", table


def _sweeps(s: _Setting) -> Iterator[tuple[str, dict[str, Any]]]:
    for words, part in (("slow", 0.8), ("fast", 0.2)):
        edges, span = s.band(0.4, 2.2)
        table: dict[str, Any] = {"kind": "frequency_sweep", "amplitude": s.amplitude, **edges}
        table |= {"duration": s.seconds(part * s.duration_s), "ring_down": s.seconds(0.2 * s.duration_s)}
        yield f"{words} sweep, {span} in {part * s.duration_s:.3g} s, {s.at}", table


def _levels(s: _Setting) -> Iterator[tuple[str, dict[str, Any]]]:
    """Random levels, telegraphs of two, square waves, steps with their ring-down."""
    low, high = s.span
    for words, periods in (("fast", 0.3), ("slow", 4.0)):
        hold, count = s.holds(periods)
        table: dict[str, Any] = {
            "kind": "random_staircase",
            "levels": count,
            "seed": 2,
            "low": low,
            "high": high,
        }
        yield f"{words} random levels, each held {hold:.3g} s, {s.at}", table | {"hold": s.seconds(hold)}
    for words, periods in (("fast ", 0.05), ("", 0.35)):
        hold, count = s.holds(periods)
        signs = np.random.default_rng(3).integers(0, 2, min(count, MOST_LEVELS))
        table = {"kind": "levels", "hold": s.seconds(hold), "levels": [s.span[k] for k in signs]}
        table["times"] = max(1, count // len(signs))
        yield f"{words}random telegraph, shortest hold {hold:.3g} s, {s.at}", table
    yield from _square_waves(s)
    hold, count = s.holds(12.0)
    table = {"kind": "levels", "hold": s.seconds(hold), "levels": [high, "50 %"], "times": max(1, count // 2)}
    yield f"steps and ring-downs, each {hold:.3g} s, {s.at}", table


def _square_waves(s: _Setting) -> Iterator[tuple[str, dict[str, Any]]]:
    """Each once, where halves that are whole periods of the device's clock make two the same."""
    halves = [round(0.5 / (multiple * s.frequency_hz * s.period_s)) for multiple in SQUARE_WAVES]
    for samples in dict.fromkeys(half for half in halves if half >= LEAST_HELD):
        hold = samples * s.period_s
        times = max(1, round(0.5 * s.duration_s / hold))
        table = {"kind": "levels", "hold": s.seconds(hold), "levels": [*s.span], "times": times}
        yield f"square wave of {0.5 / hold:.4g} Hz, {s.at}", table


def _scenario(
    subject: Subject,
    excitation: Mapping[str, Any],
    units: Mapping[str, str],
    low: float,
    high: float,
    period_us: int,
) -> dict[str, Any]:
    """As `rtctl acquire` takes it."""
    unit = units[subject.drive]
    own = {key: units[channels[0]] for key, channels in plant_kind(subject.kind).units_from.items()}
    return {
        "scenario": {
            "title": "next experiment", "plant": subject.kind, **own, "period": f"{period_us} us",
        },
        "driver": {"kind": "inprocess", "device": "model-extended.toml"},
        "limits": {
            "low": f"{low:.9g} {unit}", "high": f"{high:.9g} {unit}", "safe": f"{min(max(0.0, low), high):.9g} {unit}",
        },
        "excitation": [dict(excitation)],
    }  # fmt: skip
