"""A block of the loop's samples as one compiled call: wait, exchange, check, decide, record.

It holds no interpreter lock and allocates nothing. It calls the same kernels as the loop in Python
(`rtctl.loop.sampler`) and gives the same bits; whatever is out of the ordinary ends the block (`state.BlockExit`), and
Python completes the sample.
"""

from __future__ import annotations

import math
from typing import Any

from rtctl.border.arrays import FloatArray, IntArray
from rtctl.border.kernels import background_kernel
from rtctl.border.wire.compiled_clock import clock_ns, slept_until
from rtctl.border.wire.wire_memory import COUNTER, IN_FORCE, STATUS, TIME_US, ByteArray
from rtctl.estimators.observer import EXPECTED
from rtctl.hysteresis.packing import array_at
from rtctl.loop.compiled.state import (
    CHANGE,
    CONTRADICTED,
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
from rtctl.safety.guards import changes_too_fast, follows, mean_square_after
from rtctl.safety.limits import limit_command
from rtctl.safety.model_reading import contradicts_model
from rtctl.safety.plausibility import UINT32, is_plausible
from rtctl.timing.clock import adapted_spin_ns, due_tick
from rtctl.timing.step_timing import count_step

Rows = Any
"""(rows, columns) of float64, or the same memory as int64."""
SIGNALS, TIMINGS = 15, 3
"""Columns of `rtctl.loop.supervisor.signal_columns` for one command and one reading, and of `TIMING_COLUMNS`."""


@background_kernel
def wait(s: Record, scratch: IntArray) -> bool:
    """Wait for the next deadline as `MonotonicClock.wait` does; in lockstep, go on at once.

    Returns:
        False if a signal ended the sleep; nothing has changed then.
    """
    if s.live == 0:
        s.next_tick, s.lateness_ns = s.tick + 1, 0
        return True
    begun_ns = clock_ns(scratch, 0)
    tick = due_tick(s.tick, begun_ns, s.start_ns, s.period_ns, s.most_behind)
    deadline_ns = s.start_ns + tick * s.period_ns
    wake_ns = deadline_ns - int(s.spin_ns)
    if wake_ns > begun_ns:
        if not slept_until(scratch, 0, wake_ns):
            return False
        if s.spins != 0:
            late_ns = clock_ns(scratch, 0) - wake_ns
            s.spin_ns = adapted_spin_ns(
                s.spin_ns, late_ns, s.spin_longer_ns, s.spin_shorter_ns, s.spin_most_ns
            )
    woken_ns = clock_ns(scratch, 0)
    while woken_ns < deadline_ns:
        woken_ns = clock_ns(scratch, 0)
    s.next_tick, s.lateness_ns = tick, woken_ns - deadline_ns
    return True


@background_kernel
def is_affordable(s: Record, level: float, period_s: float) -> bool:
    """Return whether `level`, held for `period_s` [s], keeps the mean square within its limit; if so, advance it."""
    if not math.isfinite(s.rms_squared):
        return True
    mean = mean_square_after(s.mean_square, level, period_s, s.rms_window_s)
    if mean > s.rms_squared:
        return False
    s.mean_square = mean
    return True


@background_kernel
def is_accepted(loop: Loop, sensed: float, counter: int, time_us: int, status: int, elapsed_s: float) -> bool:
    """Return whether a reading is plausible and follows on the one before, `elapsed_s` [s] ago."""
    s = loop[0]
    counts = (counter - s.counter) & UINT32
    if not is_plausible(sensed, s.sensed_low, s.sensed_high, status, counts):
        return False
    if s.guarded == 0:
        return True
    change = sensed - s.sensed
    if change != 0.0 and changes_too_fast(sensed, s.sensed, s.rate, elapsed_s):
        return False
    advance_us = (time_us - s.time_us) & UINT32
    return follows(loop, change, s.level, counts, advance_us, time_us, s.begun_ns, s.answered_ns)


# 8 parameters because a kernel takes its arrays one by one
@background_kernel
def decide(  # noqa: PLR0913
    s: Record,
    memory: FloatArray,
    control: FloatArray,
    forward: FloatArray,
    setpoint: float,
    aimed: float,
    sensed: float,
    elapsed_s: float,
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Return what estimator and controller make of a reading, within the limits.

    Args:
        s: the loop's record.
        memory: the observer's memory.
        control: the controller's memory.
        forward: the feedforward's memory; empty: there is none.
        setpoint: the setpoint of this sample [controlled unit].
        aimed: the setpoint that the next command aims at [controlled unit].
        sensed: the reading [its unit].
        elapsed_s: time since the reading before [s].

    Returns:
        Estimate, surrogate, standard error and status of the estimate; the next level, the level that was asked for,
        and its proportional, integral and feedforward terms.
    """
    if s.decides == PI:
        value, surrogate, error, status, allowed, asked, proportional, integral, feedforward = (
            observer_pi_step(memory, control, forward, setpoint, aimed, s.sent[0], s.level, sensed, elapsed_s)
        )
        error = math.sqrt(error * error + s.fit_error * s.fit_error)
        return value, surrogate, error, float(status), allowed, asked, proportional, integral, feedforward
    allowed = limit_command(aimed, s.level, s.slew * elapsed_s, s.low, s.high)
    return math.nan, math.nan, math.nan, 0.0, allowed, aimed, 0.0, 0.0, aimed


@background_kernel
def record_timing(
    s: Record, timings: Rows, timing_numbers: Rows, counts: IntArray, scratch: IntArray, recorded_ns: int
) -> None:
    """Write the row of times of a sample and count them.

    Args:
        s: the loop's record.
        timings: rows of lateness, round trip and compute time [us].
        timing_numbers: the same memory as int64.
        counts: the histograms of `StepTiming`.
        scratch: two integers for the clock.
        recorded_ns: when the row of signals was written [ns].
    """
    lateness_s = s.lateness_ns * 1e-9
    round_trip_ns, compute_ns = s.answered_ns - s.begun_ns, recorded_ns - s.answered_ns
    timings[s.rows, 0], timings[s.rows, 1] = lateness_s * 1e6, round_trip_ns * 1e-3
    timings[s.rows, 2] = compute_ns * 1e-3
    clock_ns(scratch, 0)  # a call: the row is written before its number
    if timings.shape[1] > TIMINGS:
        timing_numbers[s.rows, TIMINGS] = s.timing_number + s.rows
    count_step(counts, s.lateness_ns, round_trip_ns, compute_ns)


# 19 parameters because a compiled function takes its arrays one by one, and a tuple of them costs a count of references
# each; long because splitting the sample's sequence, with its nine exits, would pass all of them on again
@background_kernel
def run_block(  # noqa: C901, PLR0913
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
    """Take samples until the rows are full or something is out of the ordinary.

    A row that has a number has it behind its columns; the number is written last, so that a reader of the mapped file
    never sees half a row.

    Args:
        exchange: the driver's exchange.
        levels: in `WireMemory`, as the four that follow.
        reading: see there.
        line: see there.
        out: see there.
        inbox: see there.
        loop: the shared state, (1,) of `LOOP`.
        memory: the observer's memory.
        control: the controller's memory.
        forward: the feedforward's memory.
        setpoints: the setpoint of each sample (n,) [controlled unit].
        upcoming: the setpoint that each sample's command aims at (n,) [controlled unit].
        attention: not 0 if a parameter is to change.
        signals: rows of signals.
        signal_numbers: the same memory as int64.
        timings: rows of times [us].
        timing_numbers: the same memory as int64.
        counts: the histograms of `StepTiming`.
        scratch: two integers for the clock.

    Returns:
        A code of `BlockExit`.
    """
    s = loop[0]
    s.rows = 0
    while s.rows < signals.shape[0] and s.index < s.last:
        if not wait(s, scratch):
            return SIGNAL
        index = s.first + s.next_tick
        if index > s.last:
            s.tick = s.next_tick
            s.overruns += s.last - s.index
            return LATE
        s.tick, s.missed = s.next_tick, index - s.index - 1
        if s.missed > 0:
            if s.judges_missed != 0 or not is_affordable(s, s.level, s.missed * s.period_s):
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
        if not is_accepted(loop, sensed, counter, time_us, status, elapsed_s):
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
        value, surrogate, error, known, allowed, asked, proportional, integral, feedforward = decide(
            s, memory, control, forward, setpoint, aimed, sensed, elapsed_s
        )
        commanded = s.level
        s.level = allowed
        if not math.isfinite(asked):
            return NOT_FINITE
        if s.reading_error < math.inf and contradicts_model(
            loop, array_at(memory, 0)[EXPECTED], sensed, s.reading_error
        ):
            return CONTRADICTED
        row = signals[s.rows]
        row[0], row[1], row[2], row[3], row[4] = float(index), setpoint, value, surrogate, error
        row[5], row[6], row[7], row[8] = known, s.reference, sensed, commanded
        row[9], row[10], row[11] = proportional, integral, feedforward
        row[12], row[13], row[14] = float(counter), float(time_us), float(status)
        if not is_affordable(s, allowed, s.period_s):
            return ENERGY
        recorded_ns = clock_ns(scratch, 0)  # a call: what is above is written before what is below
        if signals.shape[1] > SIGNALS:
            signal_numbers[s.rows, SIGNALS] = s.signal_number + s.rows
        record_timing(s, timings, timing_numbers, counts, scratch, recorded_ns)
        s.steps += 1
        s.index = index
        s.rows += 1
    return DONE
