"""Samples in compiled blocks: lend the state of a `Sampler` to a block, and complete what is out of the ordinary.

A block lasts at most a thousand samples or a second, so that a request to stop is noticed; a signal ends the sleep of a
live block at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import machine_code
from rtctl.border.records import VO2, Measurement
from rtctl.border.wire.wire_memory import PYTHON, CompiledExchange, wire_memory
from rtctl.loop.compiled.block import SIGNALS, TIMINGS, run_block
from rtctl.loop.compiled.state import GUARD_FIELDS, LOOP, NOTHING, PI, BlockExit
from rtctl.loop.compiled.step import CompiledStep
from rtctl.loop.sampler import Sampler, refuse_interrupted
from rtctl.loop.step import Step
from rtctl.recording.mapped import MappedRecorder
from rtctl.recording.rows import Recorder
from rtctl.timing.clock import MonotonicClock, SimulatedClock, TrackedSpin

MOST_ROWS = 1000
"""Most samples of a block."""
LONGEST_S = 1.0
"""Longest time of a live block [s]."""


class CompiledSampler:
    """Takes the samples of a `Sampler` in compiled blocks."""

    def __init__(
        self,
        sampler: Sampler,
        exchange: CompiledExchange,
        find_exchange: Callable[[], CompiledExchange | None],
    ) -> None:
        """Prepare to take the samples of `sampler`.

        Args:
            sampler: holds what outlives a sample, and completes samples in Python.
            exchange: the driver's exchange.
            find_exchange: returns the driver's exchange again, or None if it no longer has one.
        """
        parts = sampler.parts
        signals, timings = parts.signals, parts.timings
        assert isinstance(signals, MappedRecorder | Recorder)
        assert isinstance(timings, MappedRecorder | Recorder)
        self._sampler, self._parts, self._exchange = sampler, parts, exchange
        self._signals, self._timings = signals, timings
        self._loop = np.zeros(1, dtype=LOOP)
        self._scratch = np.zeros(2, dtype=np.int64)
        self._setpoints = np.ascontiguousarray(sampler.setpoints, dtype=np.float64)
        self._step: Step | None = None
        self._most_rows, self._find_exchange = MOST_ROWS, find_exchange
        self._decision: tuple[FloatArray, FloatArray, FloatArray] = (np.empty(0), np.empty(0), np.empty(0))
        self._set_rules()
        self._run = compiled_block(exchange)

    def run(self) -> None:
        """Take all samples. Raises DriverError."""
        sampler, at = self._sampler, self._sampler.at
        refuse_interrupted(self._parts)  # what came while this was compiled
        self._parts.clock.start(sampler.period_s)
        self._lend_clock()
        while at.index < sampler.last:
            if sampler.step is not self._step:
                self._take_step()
            if not self._decides:
                if not sampler.take():
                    return
                continue
            self._lend()
            self._exchange.lend()
            exit_reason, row = self._run_block()
            self._exchange.give_back()
            self._take_back()
            if exit_reason is BlockExit.LATE:
                return
            self._complete(exit_reason, row)
            if exit_reason is BlockExit.EXCHANGE and self._find_exchange() is None:
                while at.index < sampler.last and sampler.take():  # from here on in Python
                    pass
                return

    def _run_block(self) -> tuple[BlockExit, tuple[float, ...]]:
        """Run one block and advance the recorders by its rows; return why it ended and the row that it left out."""
        signals = self._signals.ahead(self._most_rows)
        timings = self._timings.ahead(len(signals))
        signals = signals[: len(timings)]
        s = self._loop[0]
        s["signal_number"], s["timing_number"] = len(self._signals) + 1, len(self._timings) + 1
        exit_reason = BlockExit(
            self._run(
                self._exchange.function, *self._exchange.memory, self._loop, *self._decision, self._setpoints,
                self._upcoming, self._parts.changes.attention, signals, signals.view(np.int64), timings,
                timings.view(np.int64), self._parts.timing.counts, self._scratch,
            )
        )  # fmt: skip
        rows = int(s["rows"])
        self._signals.advance(rows)
        self._timings.advance(rows)
        row = tuple(signals[rows, :SIGNALS].tolist()) if exit_reason is BlockExit.ENERGY else ()
        return exit_reason, row

    def _complete(self, exit_reason: BlockExit, row: tuple[float, ...]) -> None:
        """Complete the sample in which a block ended. Raises DriverError."""
        sampler, parts, s = self._sampler, self._parts, self._loop[0]
        if s["rows"] or exit_reason in (BlockExit.NOT_FINITE, BlockExit.ENERGY, BlockExit.CONTRADICTED):
            sampler.at.acknowledged = sampler.sent[min(1, sampler.plan.reading_delay)]
        for _ in range(int(s["rows"])):  # `stop_requested` may count the exchanges
            refuse_interrupted(parts)
        if exit_reason in (BlockExit.DONE, BlockExit.SIGNAL):
            refuse_interrupted(parts)
            return
        missed, lateness_s = int(s["missed"]), 1e-9 * int(s["lateness_ns"])
        begun_ns, answered_ns = int(s["begun_ns"]), int(s["answered_ns"])
        index = sampler.at.index + missed + 1
        if exit_reason is BlockExit.MISSED:
            sampler.missed(missed)
            sampler.exchange(index, missed, lateness_s)
        elif exit_reason is BlockExit.EXCHANGE and s["ended"] == PYTHON:
            sampler.exchange(index, missed, lateness_s)
        elif exit_reason in (BlockExit.EXCHANGE, BlockExit.UNLIKELY):
            ended = int(s["ended"]) if exit_reason is BlockExit.EXCHANGE else 0
            new = self._exchange.conclude(ended, sampler.levels)
            sampler.complete(index, missed, lateness_s, new, begun_ns, answered_ns)
        elif exit_reason is BlockExit.CHANGE:
            sampler.acknowledge(sampler.reading)
            sampler.repeats = bool(s["equal"])
            sampler.decide(index, (missed + 1) * sampler.period_s, lateness_s, begun_ns, answered_ns)
        elif exit_reason is BlockExit.NOT_FINITE:
            parts.limits[0].clip(sampler.levels[0], 0.0, sampler.period_s)
        elif exit_reason is BlockExit.CONTRADICTED:
            assert sampler.contradicted is not None
            sampler.contradicted.explain_contradicted(sampler.step.model_reading(), sampler.reading.sensed[0])
        else:
            parts.energy.refuse_too_much(sampler.levels, sampler.period_s)
            sampler.record(row, lateness_s, begun_ns, answered_ns)
            sampler.at.index = index

    def _set_rules(self) -> None:
        """Set the fields of the record that stay the same during a run."""
        sampler, parts, s = self._sampler, self._parts, self._loop[0]
        limit, plausible = parts.limits[0], parts.plausibility
        s["period_s"], s["first"], s["last"] = sampler.period_s, sampler.first, sampler.last
        s["delay"] = sampler.plan.reading_delay
        s["low"], s["high"], s["slew"] = limit.low, limit.high, limit.slew_per_s
        s["rms_squared"] = limit.rms * limit.rms if math.isfinite(limit.rms) else math.inf
        s["rms_window_s"] = limit.rms_window_s
        s["sensed_low"], s["sensed_high"] = plausible.sensed_low[0], plausible.sensed_high[0]
        s["judges_missed"] = parts.timing.judges
        s["decides"], s["reading_error"] = NOTHING, math.inf  # it asks no model
        if parts.guard is not None:
            s["guarded"], s["rate"] = 1, parts.guard.rules.rates[0]
        self._take_step()

    def _take_step(self) -> None:
        """Let blocks decide by the sampler's step; one that took over and is not compiled decides in Python."""
        step, s = self._sampler.step, self._loop[0]
        self._decides = self._step is None or isinstance(step, CompiledStep)
        self._step = step
        self._upcoming = np.ascontiguousarray(self._sampler.upcoming, dtype=np.float64)
        if isinstance(step, CompiledStep):
            *arrays, fit_error = step.kernel_arguments()
            self._decision = (arrays[0], arrays[1], arrays[2])
            s["decides"], s["fit_error"] = PI, fit_error
            s["reading_error"] = step.reading_error if self._sampler.contradicted is not None else math.inf

    def _lend_clock(self) -> None:
        """Set the fields of a live clock once it has started."""
        clock, s = self._parts.clock, self._loop[0]
        if isinstance(clock, MonotonicClock):
            self._most_rows = min(MOST_ROWS, max(1, round(LONGEST_S / self._sampler.period_s)))
            s["live"], s["period_ns"], s["start_ns"] = 1, clock.period_ns, clock.start_ns
            s["most_behind"] = clock.most_behind
            if isinstance(spin := clock.spin, TrackedSpin):
                s["spins"], s["spin_most_ns"] = 1, spin.most_ns
                s["spin_longer_ns"], s["spin_shorter_ns"] = spin.longer_ns, spin.shorter_ns

    def _lend(self) -> None:
        """Set the fields of what outlives a sample, for the next block."""
        sampler, parts, s = self._sampler, self._parts, self._loop[0]
        clock, reading = parts.clock, sampler.reading
        assert isinstance(clock, MonotonicClock | SimulatedClock)
        s["tick"], s["index"], s["setpoint"] = clock.index, sampler.at.index, sampler.at.setpoint
        if isinstance(clock, MonotonicClock):
            s["spin_ns"] = clock.spin.length_ns
        s["level"] = sampler.levels[0]
        s["sent"][: len(sampler.sent)] = [levels[0] for levels in sampler.sent]
        s["sensed"], s["counter"], s["time_us"] = reading.sensed[0], reading.counter, reading.time_us
        s["reference"], s["status"], s["in_force"] = reading.reference, reading.status, reading.sequence
        s["steps"], s["overruns"] = parts.timing.steps, parts.timing.overruns
        if parts.energy.mean_squares:
            s["mean_square"] = parts.energy.mean_squares[0]
        if parts.guard is not None:
            self._loop[GUARD_FIELDS] = parts.guard.memory

    def _take_back(self) -> None:
        """Bring what outlives a sample back to Python after a block."""
        sampler, parts = self._sampler, self._parts
        s: dict[str, Any] = dict(zip(LOOP.names or (), self._loop[0].tolist(), strict=True))
        clock = parts.clock
        assert isinstance(clock, MonotonicClock | SimulatedClock)
        clock.index, sampler.at.index = s["tick"], s["index"]
        if isinstance(clock, MonotonicClock):
            clock.spin.length_ns = s["spin_ns"]
        sampler.levels = (s["level"],)
        sampler.sent.extend((level,) for level in s["sent"][: s["delay"] + 1])
        sampler.reading = Measurement(
            (s["sensed"],), s["reference"], s["counter"], s["time_us"], s["in_force"], s["status"]
        )
        parts.timing.steps, parts.timing.overruns = s["steps"], s["overruns"]
        if parts.energy.mean_squares:
            parts.energy.mean_squares[0] = s["mean_square"]
        if parts.guard is not None:
            parts.guard.memory[:] = self._loop[GUARD_FIELDS]


def compiled_block(exchange: CompiledExchange) -> Any:
    """Return `run_block` for an exchange; call it before a device is armed, since compiling lasts many seconds."""
    numbers, rows = np.zeros(1, dtype=np.int64), np.zeros((1, SIGNALS + 1))
    floats, times = np.zeros(1), np.zeros((1, TIMINGS + 1))
    return machine_code(
        run_block, exchange.function, *wire_memory(VO2), np.zeros(1, dtype=LOOP), floats, floats, floats, floats,
        floats, numbers, rows, rows.view(np.int64), times, times.view(np.int64),
        np.zeros((1, 1), dtype=np.int64), numbers,
    )  # fmt: skip
