"""Candidate inputs of the next experiment, as excitation tables of a scenario.

The inputs are scored by the levels that `rtctl acquire` plays, held between samples as in the records so far. They are
kinds of excitation x levels (fractions of the largest drive in the data) x frequencies (around the dominant frequency
of the motion); at full level they are also sampled more slowly.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import butter, sosfiltfilt

from rtctl.border.arrays import FloatArray
from rtctl.diagnosis.problem.problem import Problem
from rtctl.diagnosis.problem.subject import Subject
from rtctl.diagnosis.thresholds import ExperimentThresholds
from rtctl.registry import plant_kind
from rtctl.scenario.schema import checked_scenario


class CandidateInput(NamedTuple):
    """An input that the plant can take: in words, as a scenario, and as levels."""

    statement: str
    """Description for a person."""
    scenario: Mapping[str, Any]
    """Scenario with one excitation table, as `rtctl acquire` reads it."""
    levels: FloatArray
    """Levels (n,), one a sample period, in the drive's unit."""
    period_s: float
    """Sample period [s]."""


class _Setting(NamedTuple):
    """What the candidate inputs of one level and one sample period have in common."""

    level: float
    """Excursion as a fraction of half the drive's range."""
    frequency_hz: float
    """Dominant frequency of the motion [Hz]."""
    duration_s: float
    """Length of a record [s]."""
    period_s: float
    """Sample period [s]."""
    slower: int
    """Sample period over that of the records so far."""
    suffix: str
    """Level and sample period in words, the end of each statement."""
    limits: ExperimentThresholds
    """Thresholds of the design."""

    @property
    def amplitude(self) -> str:
        """Excursion from the middle of the drive's range, as a scenario states it."""
        return f"{50.0 * self.level:g} %"

    @property
    def span(self) -> tuple[str, str]:
        """Lowest and highest level, as a scenario states them."""
        return f"{50.0 - 50.0 * self.level:g} %", f"{50.0 + 50.0 * self.level:g} %"

    def band(self, low: float, high: float) -> tuple[dict[str, str], str]:
        """Return a frequency band below the highest frequency that the samples carry.

        Args:
            low: Lower edge over the dominant frequency.
            high: Upper edge over the dominant frequency.

        Returns:
            The keys of an excitation table, and the band in words.
        """
        last = min(high * self.frequency_hz, self.limits.max_frequency_share / self.period_s)
        first = min(low * self.frequency_hz, 0.3 * last)
        keys = {"frequency_low": f"{first:.6g} Hz", "frequency_high": f"{last:.6g} Hz"}
        return keys, f"{first:.3g} to {last:.3g} Hz"

    def holds(self, periods: float) -> tuple[float, int]:
        """Return the length [s] of a hold of so many periods of the motion, and the number of holds (two at least)."""
        hold = min(max(self.period_s, periods / self.frequency_hz), 0.5 * self.duration_s)
        return hold, max(2, int(self.duration_s / hold))

    def seconds(self, value: float) -> str:
        """Return a time [s] as a scenario states it: whole sample periods, one at least."""
        return f"{max(1, round(value / self.period_s)) * self.period_s:.9g} s"


def find_drive_range(problem: Problem) -> tuple[float, float]:
    """Return the lowest and highest drive in the data [drive unit]; symmetric about zero where the drive has a sign."""
    drive = problem.subject.drive
    low = min(float(record.stimulus.inputs[drive].min()) for record in problem.records)
    high = max(float(record.stimulus.inputs[drive].max()) for record in problem.records)
    if low < 0.0:
        return -max(-low, high), max(-low, high)
    return low, high


def list_candidate_inputs(problem: Problem, units: Mapping[str, str]) -> list[CandidateInput]:
    """Return all candidate inputs.

    The list is empty where nothing drove the records, or where their sample period is too short for a device's clock
    (1 us).
    """
    low, high = find_drive_range(problem)
    period_us = round(1e6 * min(record.period_s for record in problem.records))
    if not (high > low and period_us >= 1):
        return []
    candidates = []
    for setting in _list_settings(problem, 1e-6 * period_us, f"{high:.4g} {units[problem.subject.drive]}"):
        for statement, table in _list_excitations(setting):
            scenario = _make_scenario(problem.subject, table, units, (low, high), period_us)
            checked = checked_scenario(scenario, "menu")
            try:
                levels = checked.excitation[0].build(low, high, setting.period_s)
            except ValueError:  # records so short that no line of the band fits into one
                continue
            candidates.append(CandidateInput(statement, scenario, levels, setting.period_s))
    return candidates


def _list_settings(problem: Problem, period_s: float, largest: str) -> list[_Setting]:
    """Return the settings: each level at the sample period of the data, and full level sampled more slowly.

    Args:
        problem: Records, their scales and the thresholds.
        period_s: Sample period of the data [s], in whole microseconds.
        largest: Largest drive in the data with its unit, in words.
    """
    limits = problem.thresholds.experiment
    median_length = int(np.median([record.samples for record in problem.records]))
    samples = min(limits.max_samples, limits.length_ratio * median_length)
    frequency = problem.scales.rate / (2.0 * np.pi)
    pairs = [(level, 1) for level in limits.drive_levels]
    pairs += [
        (limits.drive_levels[-1], slower)
        for slower in problem.subject.slower_sampling
        if frequency * slower * period_s * limits.min_samples_per_period <= 1.0
    ]
    settings = []
    for level, slower in pairs:
        suffix = f"at {level:.0%} of {largest}"
        if slower > 1:
            suffix += f", a sample each {slower * period_s:.4g} s"
        settings.append(
            _Setting(level, frequency, samples * period_s, slower * period_s, slower, suffix, limits)
        )
    return settings


def limit_band(levels: FloatArray, period: float) -> FloatArray:
    """Return levels as a chain carries them that is band-limited between its samples.

    They hold no power near half the sample rate, and rise from zero and fall to zero within two periods of the motion.

    Args:
        levels: Levels (n,), in the drive's unit.
        period: Period of the motion [samples].
    """
    width = min(len(levels) // 4, max(8, int(2.0 * period)))
    rise = 0.5 - 0.5 * np.cos(np.pi * np.arange(width) / max(width, 1))
    window = np.concatenate((rise, np.ones(len(levels) - 2 * width), rise[::-1]))
    smooth: FloatArray = sosfiltfilt(butter(6, 0.5, output="sos"), levels * window)
    return smooth


def _list_excitations(setting: _Setting) -> list[tuple[str, dict[str, Any]]]:
    """Return the excitations of one setting: in words, and as `[[excitation]]` tables."""
    own = {"period": f"{round(1e6 * setting.period_s)} us"} if setting.slower > 1 else {}
    excitations = (*_yield_multisines(setting), *_yield_sweeps(setting), *_yield_levels(setting))
    return [(statement, table | own) for statement, table in excitations]


def _yield_multisines(s: _Setting) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield a narrow and a wide random multisine, each with a ring-down."""
    for words, low, high in (("narrow", 0.6, 1.6), ("wide", 0.15, 3.0)):
        edges, span = s.band(low, high)
        table: dict[str, Any] = {"kind": "random_multisine", "seed": 1, "amplitude": s.amplitude, **edges}
        table |= {"duration": s.seconds(0.8 * s.duration_s), "ring_down": s.seconds(0.2 * s.duration_s)}
        yield f"{words} multisine, {span}, {s.suffix}", table


def _yield_sweeps(s: _Setting) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield a slow and a fast frequency sweep, each with a ring-down."""
    for words, part in (("slow", 0.8), ("fast", 0.2)):
        edges, span = s.band(0.4, 2.2)
        table: dict[str, Any] = {"kind": "frequency_sweep", "amplitude": s.amplitude, **edges}
        table |= {"duration": s.seconds(part * s.duration_s), "ring_down": s.seconds(0.2 * s.duration_s)}
        yield f"{words} sweep, {span} in {part * s.duration_s:.3g} s, {s.suffix}", table


def _yield_levels(s: _Setting) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield random levels, random telegraphs of two levels, square waves, and steps with their ring-downs."""
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
        yield f"{words} random levels, each held {hold:.3g} s, {s.suffix}", table | {"hold": s.seconds(hold)}
    for words, periods in (("fast ", 0.05), ("", 0.35)):
        hold, count = s.holds(periods)
        signs = np.random.default_rng(3).integers(0, 2, min(count, s.limits.max_telegraph_levels))
        table = {"kind": "levels", "hold": s.seconds(hold), "levels": [s.span[k] for k in signs]}
        table["times"] = max(1, count // len(signs))
        yield f"{words}random telegraph, shortest hold {hold:.3g} s, {s.suffix}", table
    yield from _yield_square_waves(s)
    hold, count = s.holds(12.0)
    table = {"kind": "levels", "hold": s.seconds(hold), "levels": [high, "50 %"], "times": max(1, count // 2)}
    yield f"steps and ring-downs, each {hold:.3g} s, {s.suffix}", table


def _yield_square_waves(s: _Setting) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield square waves, each once: with halves of whole sample periods two frequencies may give the same wave."""
    multiples = s.limits.square_wave_frequencies
    halves = [round(0.5 / (multiple * s.frequency_hz * s.period_s)) for multiple in multiples]
    for samples in dict.fromkeys(half for half in halves if half >= s.limits.min_half_wave_samples):
        hold = samples * s.period_s
        times = max(1, round(0.5 * s.duration_s / hold))
        table = {"kind": "levels", "hold": s.seconds(hold), "levels": [*s.span], "times": times}
        yield f"square wave of {0.5 / hold:.4g} Hz, {s.suffix}", table


def _make_scenario(
    subject: Subject,
    excitation: Mapping[str, Any],
    units: Mapping[str, str],
    drive_range: tuple[float, float],
    period_us: int,
) -> dict[str, Any]:
    """Return a scenario as `rtctl acquire` reads it.

    Args:
        subject: Kind of plant.
        excitation: One `[[excitation]]` table.
        units: Units of the dataset's channels, by name.
        drive_range: Lowest and highest drive, in the drive's unit.
        period_us: Sample period [us].
    """
    unit, (low, high) = units[subject.drive], drive_range
    own: dict[str, Any] = {
        key: units[channels[0]] for key, channels in plant_kind(subject.kind).units_from.items()
    }
    if plant_kind(subject.kind).free_signals:  # until the file of the model is written, which names them
        sensed = {name: one for name, one in units.items() if name != subject.drive}
        output = {"name": f"reference_{subject.output}", "unit": units[subject.output]}
        own["channels"] = {"commands": {subject.drive: unit}, "sensed": sensed, "reference": output}
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
