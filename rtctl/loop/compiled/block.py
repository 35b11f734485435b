"""A block of steps as one compiled call: wait, exchange, check, decide, record.

`rtctl.loop.supervisor` is its oracle, to the bit.

It holds no interpreter's lock and allocates nothing. Whatever is out of the ordinary ends the block (`state.Why`) and
is Python's to judge.
"""

from __future__ import annotations

import math
from typing import Any

from rtctl.border.arrays import FloatArray, IntArray
from rtctl.border.compiled_clock import clock_ns, slept_until
from rtctl.border.kernels import background_kernel
from rtctl.border.wire_memory import COUNTER, IN_FORCE, STATUS, TIME_US, ByteArray
from rtctl.loop.compiled.guards import affordable, likely, plausible
from rtctl.loop.compiled.state import (
    CHANGE,
    DONE,
    ENERGY,
    EXCHANGE,
    LATE,
    MISSED,
    NOT_FINITE,
    PI,
    SIGNAL,
    UNLIKELY,
    Loop,
    Record,
)
from rtctl.loop.compiled.step import observer_pi_step
from rtctl.timing.histogram import BITS, BUCKETS

Rows = Any
"""(rows, columns) of float64, or the same memory as int64."""
SIGNALS, TIMINGS = 15, 3
"""Columns of `rtctl.loop.supervisor.signal_columns` for one command and one reading, and of `TIMING_COLUMNS`."""


@background_kernel
def waited(s: Record, scratch: IntArray) -> bool:
    """`MonotonicClock.wait`, or the next step at once. False: a signal came first, and nothing has changed."""
    if s.live == 0:
        s.next_tick, s.lateness_ns = s.tick + 1, 0
        return True
    begun_ns = clock_ns(scratch, 0)
    tick = max(s.tick + 1, (begun_ns - s.start_ns) // s.period_ns - s.most_behind)
    deadline_ns = s.start_ns + tick * s.period_ns
    wake_ns = deadline_ns - int(s.spin_ns)
    if wake_ns > begun_ns:
        if not slept_until(scratch, 0, wake_ns):
            return False
        if s.spins != 0:
            learnt_ns = s.spin_ns - s.spin_shorter_ns
            if clock_ns(scratch, 0) - wake_ns > s.spin_ns:
                learnt_ns = s.spin_ns + s.spin_longer_ns
            s.spin_ns = max(min(learnt_ns, s.spin_most_ns), 0.0)
    woken_ns = clock_ns(scratch, 0)
    while woken_ns < deadline_ns:
        woken_ns = clock_ns(scratch, 0)
    s.next_tick, s.lateness_ns = tick, woken_ns - deadline_ns
    return True


@background_kernel
def decided(
    s: Record,
    memory: FloatArray,
    control: FloatArray,
    forward: FloatArray,
    setpoint: float,
    aimed: float,
    sensed: float,
    elapsed_s: float,
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Estimate, surrogate, its error, status, next level, the level asked for, P, I, feedforward."""
    if s.decides == PI:
        value, surrogate, error, status, allowed, asked, proportional, integral, feedforward = (
            observer_pi_step(memory, control, forward, setpoint, aimed, s.sent[0], s.level, sensed, elapsed_s)
        )
        error = math.sqrt(error * error + s.fit_error * s.fit_error)
        return value, surrogate, error, float(status), allowed, asked, proportional, integral, feedforward
    reach = s.slew * elapsed_s
    allowed = aimed
    if allowed > s.level + reach:
        allowed = s.level + reach
    elif allowed < s.level - reach:
        allowed = s.level - reach
    if allowed < s.low:
        allowed = s.low
    elif allowed > s.high:
        allowed = s.high
    return math.nan, math.nan, math.nan, 0.0, allowed, aimed, 0.0, 0.0, aimed


@background_kernel
def count(counts: IntArray, kind: int, duration_ns: int) -> None:
    """`Histogram.record`: counts (3, BUCKETS) one after the other, then the three largest."""
    duration_ns = max(duration_ns, 0)
    shift, rest = 0, duration_ns >> BITS
    while rest > 0:
        rest >>= 1
        shift += 1
    bucket = duration_ns if shift == 0 else (shift << (BITS - 1)) + (duration_ns >> shift)
    counts[kind * BUCKETS + min(bucket, BUCKETS - 1)] += 1
    largest = 3 * BUCKETS + kind
    counts[largest] = max(counts[largest], duration_ns)


@background_kernel
def run_block(
    exchange: Any,
    levels: FloatArray,
    reading: FloatArray,
    line: IntArray,
    out: ByteArray,
    inbox: ByteArray,
    loop: Loop,
    memory: FloatArray,
    control: FloatArray,
    forward: FloatArray,
    setpoints: FloatArray,
    upcoming: FloatArray,
    attention: IntArray,
    signals: Rows,
    signal_numbers: Rows,
    timings: Rows,
    timing_numbers: Rows,
    counts: IntArray,
    scratch: IntArray,
) -> int:
    """Samples until the rows are full or something is up; a code of `state.Why`.

    A row has its number, if it has one, behind its columns; it is written last.
    """
    s = loop[0]
    s.rows = 0
    while s.rows < signals.shape[0] and s.index < s.last:
        if not waited(s, scratch):
            return SIGNAL
        index = s.first + s.next_tick
        if index > s.last:
            s.tick = s.next_tick
            s.overruns += s.last - s.index
            return LATE
        s.tick, s.missed = s.next_tick, index - s.index - 1
        if s.missed > 0:
            if s.judges_missed != 0 or not affordable(s, s.level, s.missed * s.period_s):
                return MISSED
            s.overruns += s.missed
        levels[0] = s.level
        s.begun_ns = clock_ns(scratch, 0)
        s.ended = exchange(levels, reading, line, out, inbox)
        s.answered_ns = clock_ns(scratch, 0)
        if s.ended != 0:
            return EXCHANGE
        sensed, counter, time_us, status = reading[0], line[COUNTER], line[TIME_US], line[STATUS]
        elapsed_s = (s.missed + 1) * s.period_s
        if not plausible(s, sensed, counter, status):
            return UNLIKELY
        if s.guarded != 0 and not likely(s, sensed, counter, time_us, elapsed_s):
            return UNLIKELY
        s.sensed, s.reference, s.counter, s.time_us = sensed, reading[1], counter, time_us
        s.status, s.in_force = status, line[IN_FORCE]
        if attention[0] != 0:
            return CHANGE
        for k in range(s.delay):
            s.sent[k] = s.sent[k + 1]
        s.sent[s.delay] = s.level
        setpoint, aimed = setpoints[index], upcoming[index]
        if s.setpoint == s.setpoint:
            setpoint = aimed = s.setpoint
        value, surrogate, error, known, allowed, asked, proportional, integral, feedforward = decided(
            s, memory, control, forward, setpoint, aimed, sensed, elapsed_s
        )
        commanded = s.level
        s.level = allowed
        if not math.isfinite(asked):
            return NOT_FINITE
        row = signals[s.rows]
        row[0], row[1], row[2], row[3], row[4] = float(index), setpoint, value, surrogate, error
        row[5], row[6], row[7], row[8] = known, s.reference, sensed, commanded
        row[9], row[10], row[11] = proportional, integral, feedforward
        row[12], row[13], row[14] = float(counter), float(time_us), float(status)
        if not affordable(s, allowed, s.period_s):
            return ENERGY
        recorded_ns = clock_ns(scratch, 0)  # a call: what is above is written before what is below
        if signals.shape[1] > SIGNALS:
            signal_numbers[s.rows, SIGNALS] = s.signal_number + s.rows
        lateness_s = s.lateness_ns * 1e-9
        round_trip_ns, compute_ns = s.answered_ns - s.begun_ns, recorded_ns - s.answered_ns
        timings[s.rows, 0], timings[s.rows, 1] = lateness_s * 1e6, round_trip_ns * 1e-3
        timings[s.rows, 2] = compute_ns * 1e-3
        clock_ns(scratch, 0)
        if timings.shape[1] > TIMINGS:
            timing_numbers[s.rows, TIMINGS] = s.timing_number + s.rows
        count(counts, 0, s.lateness_ns)
        count(counts, 1, round_trip_ns)
        count(counts, 2, compute_ns)
        s.steps += 1
        s.index = index
        s.rows += 1
    return DONE
