"""One sample of an exported resonator's loop: two readings, two commands; the order is that of `sample`."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from rtctl.controllers.agc_pll import agc_pll_applied, agc_pll_step
from rtctl.estimators.lock_in import lock_in_step
from rtctl.export.c.laws.sample import (
    IMPLAUSIBLE,
    NOT_A_LEVEL,
    TOO_FAST,
    TOO_MUCH_ENERGY,
    UNLIKELY,
    Record,
    counted,
)
from rtctl.loop.compiled.block import is_affordable
from rtctl.models.resonator import straightened
from rtctl.safety.guards import changes_too_fast, follows
from rtctl.safety.limits import limit_command
from rtctl.safety.plausibility import UINT32, is_plausible


def plausible(s: Record, i: Record) -> bool:
    """Return whether both readings are in range and new, and the device healthy."""
    counts = counted(s, i)
    return is_plausible(i.sensed, s.sensed_low, s.sensed_high, i.status, counts) and is_plausible(
        i.sensed_2, s.sensed_low_2, s.sensed_high_2, i.status, counts
    )


def too_fast(s: Record, i: Record) -> bool:
    """Return whether a reading changes faster than it can."""
    return changes_too_fast(i.sensed, s.sensed, s.rate, s.elapsed_s) or changes_too_fast(
        i.sensed_2, s.sensed_2, s.rate_2, s.elapsed_s
    )


def accepts(state: Record, i: Record) -> bool:
    """Return whether readings are plausible and follow on those before them."""
    s = state[0]
    s.begun_ns, s.answered_ns = i.begun_ns, i.answered_ns
    if not plausible(s, i):
        return False
    if s.known == 0 or s.guarded == 0:
        return True
    is_equal = i.sensed == s.sensed and i.sensed_2 == s.sensed_2
    change = i.sensed - s.sensed
    if not is_equal and too_fast(s, i):
        return False
    if not is_equal and change == 0.0:
        change = math.nan
    counts, advance_us = (i.counter - s.counter) & UINT32, (i.time_us - s.time_us) & UINT32
    return follows(state, change, s.level, counts, advance_us, i.time_us, s.begun_ns, s.answered_ns)


def refusal(s: Record, i: Record) -> int:
    """Return why readings are refused."""
    if not plausible(s, i):
        return IMPLAUSIBLE
    return TOO_FAST if too_fast(s, i) else UNLIKELY


def command(s: Record, i: Record, o: Record, c: Record, elapsed_s: float) -> int:
    """Set the next levels by the estimate, within the limits; return a fault."""
    terms = agc_pll_step(
        s,
        c.resonator,
        c.loops,
        i.setpoint,
        o.estimate,
        o.surrogate,
        o.standard_error,
        o.estimate_status,
        elapsed_s,
    )
    o.current_proportional, o.current_integral = terms.current_proportional, terms.current_integral
    o.frequency_proportional, o.frequency_integral = terms.frequency_proportional, terms.frequency_integral
    o.state = terms.state
    if not (math.isfinite(s.asked) and math.isfinite(s.asked_hz)):
        return NOT_A_LEVEL
    reach, reach_hz = c.current.slew_per_s * elapsed_s, c.frequency.slew_per_s * elapsed_s
    s.level = limit_command(s.asked, s.level, reach, c.current.low, c.current.high)
    s.level_2 = limit_command(s.asked_hz, s.level_2, reach_hz, c.frequency.low, c.frequency.high)
    agc_pll_applied(s, c.resonator, s.level, s.level_2)
    if not is_affordable(s, s.level, c.rules.period_s):
        return TOO_MUCH_ENERGY
    return 0


def resonator_sample_of(delay: int) -> Callable[..., Any]:
    """Return the function of one sample; `delay`: age of the command in force at a reading, in commands."""
    oldest = delay

    def estimate(s: Record, i: Record, o: Record, c: Record) -> None:
        """Set what is known of the resonator."""
        x, y = straightened(i.sensed, i.sensed_2, s.sent_2[0], c.resonator)
        o.estimate, o.surrogate, o.standard_error, o.estimate_status = lock_in_step(s, x, y)

    def begin(s: Record, i: Record, o: Record, c: Record) -> int:
        """Start estimator and controller at rest at the safe levels."""
        for k in range(oldest + 1):
            s.sent[k] = s.level
            s.sent_2[k] = s.level_2
        estimate(s, i, o, c)
        return command(s, i, o, c, c.rules.period_s)

    def take(state: Record, i: Record, o: Record, c: Record) -> int:
        """Take a sample; return a fault, 0 if there is none."""
        s = state[0]
        s.elapsed_s = i.periods * c.rules.period_s
        held_s = (i.periods - 1) * c.rules.period_s
        if s.settle_left == 0 and i.periods > 1 and not is_affordable(s, s.level, held_s):
            return TOO_MUCH_ENERGY
        if not accepts(state, i):
            return refusal(s, i)
        s.known, s.sensed, s.sensed_2, s.counter, s.time_us = 1, i.sensed, i.sensed_2, i.counter, i.time_us
        if s.settle_left > 0:
            s.settle_left -= 1
            return begin(s, i, o, c) if s.settle_left == 0 else 0
        for k in range(oldest):
            s.sent[k] = s.sent[k + 1]
            s.sent_2[k] = s.sent_2[k + 1]
        s.sent[oldest] = s.level
        s.sent_2[oldest] = s.level_2
        estimate(s, i, o, c)
        return command(s, i, o, c, s.elapsed_s)

    def sample(state: Record, i: Record, o: Record, c: Record) -> None:
        """Take a sample: from two readings and a setpoint to the next levels."""
        s = state[0]
        o.estimate = o.surrogate = o.standard_error = math.nan
        o.current_proportional = o.current_integral = o.frequency_proportional = o.frequency_integral = 0.0
        o.state = 0.0
        o.estimate_status = 0
        if s.fault == 0:
            s.fault = take(state, i, o, c)
        if s.fault != 0:
            s.level, s.level_2 = c.rules.safe, c.safe_hz
        o.level, o.level_2, o.fault = s.level, s.level_2, s.fault

    return sample
