"""The loop's guards in compiled code: whether a reading or a level passes; what is wrong with it, Python says.

The same comparisons as `rtctl.safety.limits.Plausibility`, `rtctl.safety.guards.ReadingGuard` and `EnergyGuard`.
What does not pass leaves the record as it was, so that they judge it from there.
"""

from __future__ import annotations

import math

from rtctl.border.kernels import background_kernel
from rtctl.border.records import DeviceStatus
from rtctl.loop.compiled.state import Record
from rtctl.safety.guards import ANCHOR_US, COUNTS_PER_US, LARGEST_RATE_ERROR

_UINT32, _HALF = 0xFFFFFFFF, 0x80000000
_ENABLED = int(DeviceStatus.ENABLED)
_JUDGED = int(
    DeviceStatus.ENABLED | DeviceStatus.WATCHDOG_TRIPPED | DeviceStatus.SENSOR_FAULT | DeviceStatus.REFUSED
)


@background_kernel
def plausible(s: Record, sensed: float, counter: int, status: int) -> bool:
    """Of a healthy device, in range, and new."""
    fresh = 0 < ((counter - s.counter) & _UINT32) < _HALF
    return status & _JUDGED == _ENABLED and s.sensed_low <= sensed <= s.sensed_high and fresh


@background_kernel
def in_step(s: Record, counts: int, advance: int) -> bool:
    """In lockstep: one sample period of device time, as many counts as ever."""
    if abs(advance - s.lockstep_us) > 2 or (s.counts >= 0 and counts != s.counts):
        return False
    s.counts = counts
    return True


@background_kernel
def in_time(s: Record, time_us: int, counts: int, advance: int) -> bool:
    """Live: device time between request and answer, on this machine's clock."""
    if not 0 < advance < _HALF or counts > COUNTS_PER_US * advance:
        return False
    if s.anchored != 0:
        device_us = (time_us - s.anchor_us) & _UINT32
        least_us = 1e-3 * (s.begun_ns - s.anchor_answered_ns)
        most_us = 1e-3 * (s.answered_ns - s.anchor_begun_ns)
        if device_us < least_us * (1.0 - LARGEST_RATE_ERROR) - s.tolerance_us:
            return False
        if device_us > most_us * (1.0 + LARGEST_RATE_ERROR) + s.tolerance_us:
            return False
        if least_us <= ANCHOR_US:
            return True
    s.anchored = 1
    s.anchor_us, s.anchor_begun_ns, s.anchor_answered_ns = time_us, s.begun_ns, s.answered_ns
    return True


@background_kernel
def likely(s: Record, sensed: float, counter: int, time_us: int, elapsed_s: float) -> bool:
    """Of a reading that follows on those before it."""
    equal, lowest, highest = 0, s.lowest, s.highest
    if sensed == s.sensed:
        if s.frozen_after > 0:
            equal = s.equal + 1
            lowest = s.level if equal == 1 else min(s.lowest, s.level)
            highest = s.level if equal == 1 else max(s.highest, s.level)
            if equal >= s.frozen_after and highest - lowest >= s.frozen_travel:
                return False
    elif abs(sensed - s.sensed) > s.rate * elapsed_s:
        return False
    if s.timed != 0:
        advance, counts = (time_us - s.time_us) & _UINT32, (counter - s.counter) & _UINT32
        if s.lockstep_us >= 0:
            if not in_step(s, counts, advance):
                return False
        elif not in_time(s, time_us, counts, advance):
            return False
    s.equal, s.lowest, s.highest = equal, lowest, highest
    return True


@background_kernel
def affordable(s: Record, level: float, period_s: float) -> bool:
    """Whether the mean square stays below its limit over so long of this level; then it goes on from there."""
    if not math.isfinite(s.rms_squared):
        return True
    square = level * level
    mean = square + (s.mean_square - square) * math.exp(-period_s / s.rms_window_s)
    if mean > s.rms_squared:
        return False
    s.mean_square = mean
    return True
