"""Samples in compiled blocks: `Sampling` lends what outlives a sample, and completes what is out of the ordinary.

A block lasts a thousand samples or a second at most, so that whoever asks to stop is heard; a signal ends the sleep of
a live block at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.kernels import machine_code
from rtctl.border.records import VO2, Measurement
from rtctl.border.wire_memory import PYTHON, CompiledExchange, wire_memory
from rtctl.loop.compiled.block import SIGNALS, TIMINGS, run_block
from rtctl.loop.compiled.state import LOOP, NOTHING, PI, BlockExit
from rtctl.loop.compiled.step import CompiledStep
from rtctl.loop.sampler import Sampler, refuse_interrupted
from rtctl.recording.mapped import MappedRecorder
from rtctl.recording.rows import Recorder
from rtctl.safety.guards import GuardMemory
from rtctl.timing.clock import MonotonicClock, SimulatedClock, TrackedSpin
from rtctl.timing.histogram import BUCKETS

MOST_ROWS = 1000
LONGEST_S = 1.0


class CompiledSampler:
    """Takes the samples of a `Sampling`."""

    def __init__(
        self,
        sampling: Sampler,
        exchange: CompiledExchange,
        find_exchange: Callable[[], CompiledExchange | None],
    ) -> None:
        """`find_exchange` gives the driver's again, if it still has one."""
        parts = sampling.parts
        signals, timings = parts.signals, parts.timings
        assert isinstance(signals, MappedRecorder | Recorder)
        assert isinstance(timings, MappedRecorder | Recorder)
        self._sampling, self._parts, self._exchange = sampling, parts, exchange
        self._signals, self._timings = signals, timings
        self._loop = np.zeros(1, dtype=LOOP)
        self._scratch = np.zeros(2, dtype=np.int64)
        self._counts = np.zeros(3 * BUCKETS + 3, dtype=np.int64)
        self._setpoints = np.ascontiguousarray(sampling.setpoints, dtype=np.float64)
        self._upcoming = np.ascontiguousarray(sampling.upcoming, dtype=np.float64)
        self._most_rows, self._find_exchange = MOST_ROWS, find_exchange
        self._decision: tuple[FloatArray, FloatArray, FloatArray] = (np.empty(0), np.empty(0), np.empty(0))
        self._settle_rules()
        self._run = compiled_block(exchange)

    def run(self) -> None:
        """All of them. Raises DriverError."""
        sampling, at = self._sampling, self._sampling.at
        refuse_interrupted(self._parts)  # what came while this was compiled
        self._parts.clock.start(sampling.period_s)
        self._take_over_clock()
        try:
            while at.index < sampling.last:
                self._lend()
                self._exchange.lend()
                exit_reason, row = self._block()
                self._exchange.give_back()
                self._give_back()
                if exit_reason is BlockExit.LATE:
                    break
                self._complete(exit_reason, row)
                if (
                    exit_reason is BlockExit.EXCHANGE and self._find_exchange() is None
                ):  # from here on only Python's way is left
                    while at.index < sampling.last and sampling.take():
                        pass
                    break
        finally:
            timing = self._parts.timing
            for k, histogram in enumerate((timing.lateness, timing.round_trip, timing.compute)):
                begin = k * BUCKETS
                histogram.add(self._counts[begin : begin + BUCKETS], int(self._counts[3 * BUCKETS + k]))

    def _block(self) -> tuple[BlockExit, tuple[float, ...]]:
        """Samples until something is up, and the row that was not recorded; the recorders are as far as it is."""
        signals = self._signals.ahead(self._most_rows)
        timings = self._timings.ahead(len(signals))
        signals = signals[: len(timings)]
        s = self._loop[0]
        s["signal_number"], s["timing_number"] = len(self._signals) + 1, len(self._timings) + 1
        exit_reason = BlockExit(
            self._run(
                self._exchange.function, *self._exchange.memory, self._loop, *self._decision, self._setpoints,
                self._upcoming, self._parts.changes.attention, signals, signals.view(np.int64), timings,
                timings.view(np.int64), self._counts, self._scratch,
            )
        )  # fmt: skip
        rows = int(s["rows"])
        self._signals.advance(rows)
        self._timings.advance(rows)
        row = tuple(signals[rows, :SIGNALS].tolist()) if exit_reason is BlockExit.ENERGY else ()
        return exit_reason, row

    def _complete(self, exit_reason: BlockExit, row: tuple[float, ...]) -> None:
        """What a block has left to Python. Raises DriverError."""
        sampling, parts, s = self._sampling, self._parts, self._loop[0]
        for _ in range(int(s["rows"])):  # who asks whether to stop also counts the exchanges
            refuse_interrupted(parts)
        if exit_reason in (BlockExit.DONE, BlockExit.SIGNAL):
            refuse_interrupted(parts)
            return
        missed, lateness_s = int(s["missed"]), 1e-9 * int(s["lateness_ns"])
        begun_ns, answered_ns = int(s["begun_ns"]), int(s["answered_ns"])
        index = sampling.at.index + missed + 1
        if exit_reason is BlockExit.MISSED:
            sampling.missed(missed)
            sampling.exchange(index, missed, lateness_s)
        elif exit_reason is BlockExit.EXCHANGE and s["ended"] == PYTHON:
            sampling.exchange(index, missed, lateness_s)
        elif exit_reason is BlockExit.EXCHANGE:
            new = self._exchange.conclude(int(s["ended"]), sampling.levels)
            sampling.complete(index, missed, lateness_s, new, begun_ns, answered_ns)
        elif exit_reason is BlockExit.UNLIKELY:
            new = self._exchange.conclude(0, sampling.levels)
            sampling.complete(index, missed, lateness_s, new, begun_ns, answered_ns)
        elif exit_reason is BlockExit.CHANGE:
            sampling.decide(index, (missed + 1) * sampling.period_s, lateness_s, begun_ns, answered_ns)
        elif exit_reason is BlockExit.NOT_FINITE:
            parts.limits[0].clip(sampling.levels[0], 0.0, sampling.period_s)
        else:
            parts.energy.refuse_too_much(sampling.levels, sampling.period_s)
            sampling.record(row, lateness_s, begun_ns, answered_ns)
            sampling.at.index = index

    def _settle_rules(self) -> None:
        """What does not change during a run."""
        sampling, parts, s = self._sampling, self._parts, self._loop[0]
        limit, believed = parts.limits[0], parts.plausibility
        s["period_s"], s["first"], s["last"] = sampling.period_s, sampling.first, sampling.last
        s["delay"] = sampling.plan.reading_delay
        s["low"], s["high"], s["slew"] = limit.low, limit.high, limit.slew_per_s
        s["rms_squared"] = limit.rms * limit.rms if math.isfinite(limit.rms) else math.inf
        s["rms_window_s"] = limit.rms_window_s
        s["sensed_low"], s["sensed_high"] = believed.sensed_low[0], believed.sensed_high[0]
        s["judges_missed"] = parts.timing.judges
        s["lockstep_us"], s["decides"] = -1, NOTHING
        if parts.guard is not None:
            rules = parts.guard.rules
            s["guarded"], s["timed"], s["rate"] = 1, rules.timed, rules.rates[0]
            s["frozen_after"], s["frozen_travel"] = rules.frozen_after, rules.frozen_travel
            s["lockstep_us"] = -1 if rules.lockstep_us is None else rules.lockstep_us
            s["tolerance_us"] = rules.time_tolerance_us
        if isinstance(sampling.step, CompiledStep):
            *arrays, fit_error = sampling.step.kernel_arguments()
            self._decision = (arrays[0], arrays[1], arrays[2])
            s["decides"], s["fit_error"] = PI, fit_error

    def _take_over_clock(self) -> None:
        clock, s = self._parts.clock, self._loop[0]
        if isinstance(clock, MonotonicClock):
            self._most_rows = min(MOST_ROWS, max(1, round(LONGEST_S / self._sampling.period_s)))
            s["live"], s["period_ns"], s["start_ns"] = 1, clock.period_ns, clock.start_ns
            s["most_behind"] = clock.most_behind
            if isinstance(spin := clock.spin, TrackedSpin):
                s["spins"], s["spin_most_ns"] = 1, spin.most_ns
                s["spin_longer_ns"], s["spin_shorter_ns"] = spin.longer_ns, spin.shorter_ns

    def _lend(self) -> None:
        """What outlives a sample, to the block."""
        sampling, parts, s = self._sampling, self._parts, self._loop[0]
        clock, reading = parts.clock, sampling.reading
        assert isinstance(clock, MonotonicClock | SimulatedClock)
        s["tick"], s["index"], s["setpoint"] = clock.index, sampling.at.index, sampling.at.setpoint
        if isinstance(clock, MonotonicClock):
            s["spin_ns"] = clock.spin.length_ns
        s["level"] = sampling.levels[0]
        s["sent"][: len(sampling.sent)] = [levels[0] for levels in sampling.sent]
        s["sensed"], s["counter"], s["time_us"] = reading.sensed[0], reading.counter, reading.time_us
        s["reference"], s["status"], s["in_force"] = reading.reference, reading.status, reading.sequence
        s["steps"], s["overruns"] = parts.timing.steps, parts.timing.overruns
        if parts.energy.mean_squares:
            s["mean_square"] = parts.energy.mean_squares[0]
        if parts.guard is not None:
            memory = parts.guard.memory()
            s["counts"] = -1 if memory.counts is None else memory.counts
            s["equal"], s["lowest"], s["highest"] = memory.equal, memory.lowest, memory.highest
            s["anchored"] = memory.anchor is not None
            s["anchor_us"], s["anchor_begun_ns"], s["anchor_answered_ns"] = memory.anchor or (0, 0, 0)

    def _give_back(self) -> None:
        """The same, to Python."""
        sampling, parts = self._sampling, self._parts
        s: dict[str, Any] = dict(zip(LOOP.names or (), self._loop[0].tolist(), strict=True))
        clock = parts.clock
        assert isinstance(clock, MonotonicClock | SimulatedClock)
        clock.index, sampling.at.index = s["tick"], s["index"]
        if isinstance(clock, MonotonicClock):
            clock.spin.length_ns = s["spin_ns"]
        sampling.levels = (s["level"],)
        sampling.sent.extend((level,) for level in s["sent"][: s["delay"] + 1])
        sampling.reading = Measurement(
            (s["sensed"],), s["reference"], s["counter"], s["time_us"], s["in_force"], s["status"]
        )
        parts.timing.steps, parts.timing.overruns = s["steps"], s["overruns"]
        if parts.energy.mean_squares:
            parts.energy.mean_squares[0] = s["mean_square"]
        if parts.guard is not None:
            anchor = (
                (s["anchor_us"], s["anchor_begun_ns"], s["anchor_answered_ns"]) if s["anchored"] else None
            )
            counts = None if s["counts"] < 0 else s["counts"]
            parts.guard.resume(GuardMemory(counts, s["equal"], s["lowest"], s["highest"], anchor))


def compiled_block(exchange: CompiledExchange) -> Any:
    """`run_block` for an exchange; made, or taken from the disk, before a device is armed: it may last many seconds."""
    numbers, rows = np.zeros(1, dtype=np.int64), np.zeros((1, SIGNALS + 1))
    floats, times = np.zeros(1), np.zeros((1, TIMINGS + 1))
    return machine_code(
        run_block, exchange.function, *wire_memory(VO2), np.zeros(1, dtype=LOOP), floats, floats, floats, floats,
        floats, numbers, rows, rows.view(np.int64), times, times.view(np.int64), numbers, numbers,
    )  # fmt: skip
