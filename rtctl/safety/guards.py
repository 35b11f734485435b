"""Guards over time: what no healthy device reads in sequence, and more power than the device may take.

`ReadingGuard` holds each reading to the ones before it: its rate of change, a value that stays while the command moves,
a sample counter that jumps, a device clock that stands, jumps or drifts. `EnergyGuard` watches the mean square of each
command,

    m[k] = u^2 + (m[k-1] - u^2) exp(-h / window),   sqrt(m) <= rms

and finds out before the command is sent.

A reading that repeats is a stuck sensor only where a live one would have changed. The guard learns the instrument's
resolution q (the smallest change seen) and the mean change c for a unit of command travel from the changes before:
while the command moves by L, a live sensor moves by about c L. On a plateau, as of a metallic film, that is a few q.
Near the lowest and the highest reading so far a plateau may begin, as abruptly as the last domains of a film switch:
what was learned on the slope before says nothing about it; nor, in open loop, about what follows a reversal, where
nothing switches until the width of the loops is crossed. A film answers late, so the command counts behind a lag of as
many samples as must repeat.

The loop in Python and its compiled blocks call the same kernels; these say only whether a reading passes, and leave
their memory as it was if not, so that Python can explain why.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rtctl.arithmetic.elementary import exp
from rtctl.border.errors import DriverError, Fault
from rtctl.border.kernels import background_kernel, kernel
from rtctl.border.records import Measurement
from rtctl.safety.limits import CommandLimits
from rtctl.safety.model_reading import LEAST_STEPS, contradicts_model, explained
from rtctl.safety.plausibility import HALF_UINT32, UINT32, Finding

ANCHOR_US = 1e6
"""How long host and device clock are compared from one point [us]: a clock that drifts is found within that."""
LARGEST_RATE_ERROR = 0.05
"""Largest relative rate error of a device's clock; that of a quartz is 1e-4."""
LEAST_TIME_TOLERANCE_US = 20_000.0
LOCKSTEP_TOLERANCE_US = 2
"""How far a sample period of device time may be off in lockstep [us]: it is rounded to microseconds."""
END_SHARE = 0.05
"""Of the span of the readings so far: nearer than that to its ends a reading may be on a plateau. A film with one
domain left reads some percent more than the metallic one, and its transition spans a factor of ten and more."""
FORGETTING = 0.125
"""Weight of a new change in the means of changes and of travel between them."""
COUNTS_PER_US = 1
"""Largest sampling rate [samples/us]: no instrument here is faster, so a counter that is has jumped."""

GUARD = np.dtype(
    [
        # rules, as in `ReadingRules`
        ("frozen_after", np.int64),
        ("frozen_travel", np.float64),
        ("plateau_travel", np.float64),
        ("timed", np.int64),
        ("lockstep_us", np.int64),  # -1: not in lockstep
        ("time_tolerance_us", np.float64),
        # memory
        ("equal", np.int64),  # equal readings in a row
        ("lagged", np.float64),  # the level, behind a lag of `frozen_after` samples; NaN: none yet
        ("lowest", np.float64),  # of it, meanwhile
        ("highest", np.float64),
        ("resolution", np.float64),  # smallest change of the reading; 0: none seen yet
        ("mean_change", np.float64),  # of the reading, of those before
        ("mean_travel", np.float64),  # of the command between two changes
        ("travel", np.float64),  # of the command since the last change
        ("model_from", np.float64),  # the model's reading at the last change, as a logarithm
        ("apart", np.int64),  # samples in a row in which it has been far from there
        ("guarded_level", np.float64),  # the level before
        ("place", np.float64),  # of the reading, from the first one
        ("least_place", np.float64),
        ("most_place", np.float64),
        ("counts", np.int64),  # by which a command in lockstep advances the counter; -1: not known yet
        ("anchored", np.int64),
        ("anchor_us", np.int64),  # device time
        ("anchor_begun_ns", np.int64),  # host time before and after that exchange
        ("anchor_answered_ns", np.int64),
    ]
)
"""Rules and memory of a guard as the kernels read them; a compiled block has the same fields in its own record."""

Guarded = NDArray[Any]
"""(1,) of `GUARD`, or of a record that has its fields."""
Record = Any
"""A row of it inside a kernel: numba knows its type, mypy does not."""


@kernel
def changes_too_fast(value: float, previous: float, rate_per_s: float, elapsed_s: float) -> bool:
    """Return whether a reading changed by more than `rate_per_s` [its unit/s] in `elapsed_s` [s]."""
    return abs(value - previous) > rate_per_s * elapsed_s


@background_kernel
def is_stuck(s: Record, equal: int, moved: float) -> bool:
    """Return whether `equal` repetitions, while the command moved by `moved`, show a stuck sensor."""
    if s.frozen_after <= 0 or equal < s.frozen_after or moved < s.frozen_travel:
        return False
    if s.resolution <= 0.0 or s.mean_travel <= 0.0 or moved >= s.plateau_travel:
        return True
    if min(s.place - s.least_place, s.most_place - s.place) <= END_SHARE * (s.most_place - s.least_place):
        return False
    return bool(s.mean_change * moved >= LEAST_STEPS * s.resolution * s.mean_travel)


@background_kernel
def repeated(s: Record, change: float, level: float) -> tuple[int, float, float, float]:
    """Return how often a reading has repeated, the lagged level, and its lowest and highest meanwhile."""
    share = 1.0 / max(s.frozen_after, 1)
    lagged = level if math.isnan(s.lagged) else s.lagged + share * (level - s.lagged)
    equal = s.equal + 1 if change == 0.0 else 0  # a change may be NaN
    if equal <= 1:
        return equal, lagged, lagged, lagged
    return equal, lagged, min(s.lowest, lagged), max(s.highest, lagged)


@background_kernel
def _learn(s: Record, change: float, level: float) -> None:
    """Learn resolution and sensitivity from a reading that moved by `change`; 0: it repeats, NaN: not known."""
    s.travel += abs(level - s.guarded_level)
    s.guarded_level = level
    size = abs(change)
    if size > 0.0:
        s.place += change
        s.least_place, s.most_place = min(s.least_place, s.place), max(s.most_place, s.place)
        s.resolution = size if s.resolution <= 0.0 else min(s.resolution, size)
        s.mean_change += FORGETTING * (size - s.mean_change)
        s.mean_travel += FORGETTING * (s.travel - s.mean_travel)
        s.travel = 0.0


@background_kernel
def _keeps_lockstep(s: Record, counts: int, advance_us: int) -> bool:
    """Return whether one command took one sample period of device time, and as many counts as ever."""
    if abs(advance_us - s.lockstep_us) > LOCKSTEP_TOLERANCE_US or (s.counts >= 0 and counts != s.counts):
        return False
    s.counts = counts
    return True


@background_kernel
def _keeps_time(
    s: Record, counts: int, advance_us: int, time_us: int, begun_ns: int, answered_ns: int
) -> bool:
    """Return whether the device's time lies between the request and its answer, on the host's clock."""
    if not 0 < advance_us < HALF_UINT32 or counts > COUNTS_PER_US * advance_us:
        return False
    if s.anchored != 0:
        device_us = (time_us - s.anchor_us) & UINT32
        least_us = 1e-3 * (begun_ns - s.anchor_answered_ns)
        most_us = 1e-3 * (answered_ns - s.anchor_begun_ns)
        if device_us < least_us * (1.0 - LARGEST_RATE_ERROR) - s.time_tolerance_us:
            return False
        if device_us > most_us * (1.0 + LARGEST_RATE_ERROR) + s.time_tolerance_us:
            return False
        if least_us <= ANCHOR_US:
            return True
    s.anchored = 1
    s.anchor_us, s.anchor_begun_ns, s.anchor_answered_ns = time_us, begun_ns, answered_ns
    return True


# 8 parameters because a call from Python into a kernel costs least with plain numbers
@background_kernel
def follows(  # noqa: PLR0913
    guarded: Guarded,
    change: float,
    level: float,
    counts: int,
    advance_us: int,
    time_us: int,
    begun_ns: int,
    answered_ns: int,
) -> bool:
    """Return whether a reading follows on those before it; its rate is judged apart (`changes_too_fast`).

    Args:
        guarded: rules and memory; the memory advances if the reading follows, and stays as it is if not.
        change: how far the first reading moved [its unit]; 0 where all readings equal those before, to the bit; NaN
            where only others moved.
        level: the first command that it answers [its unit].
        counts: how far the sample counter advanced, modulo 2^32.
        advance_us: how far the device's time advanced, modulo 2^32 [us].
        time_us: the device's time [us].
        begun_ns: host time of the request [ns].
        answered_ns: host time of the answer [ns].
    """
    s = guarded[0]
    equal, lagged, lowest, highest = repeated(s, change, level)
    if is_stuck(s, equal, highest - lowest):
        return False
    if s.timed != 0:
        if s.lockstep_us >= 0:
            if not _keeps_lockstep(s, counts, advance_us):
                return False
        elif not _keeps_time(s, counts, advance_us, time_us, begun_ns, answered_ns):
            return False
    s.equal, s.lagged, s.lowest, s.highest = equal, lagged, lowest, highest
    _learn(s, change, level)
    return True


@kernel
def mean_square_after(mean_square: float, level: float, period_s: float, window_s: float) -> float:
    """Return the mean square of a command after `level` was held for `period_s` [s]: the module's equation."""
    square = level * level
    return square + (mean_square - square) * exp(-period_s / window_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadingRules:
    """Limits of readings over time; infinite or 0 where nothing is known."""

    names: tuple[str, ...]
    """Channel names with units."""
    rates: tuple[float, ...]
    """Largest change of each reading per second [its unit/s]."""
    frozen_after: int = 0
    """Equal readings in a row, to the bit, after which a sensor is stuck if the command moved; 0: never."""
    frozen_travel: float = math.inf
    """How far the first command must have moved meanwhile [its unit]."""
    plateau_travel: float = math.inf
    """How far it must have moved for a reading that repeats to be stuck on any plateau [its unit]."""
    lockstep_us: int | None = None
    """Sample period of a device that each command advances by one sample [us]; None: the device runs freely."""
    time_tolerance_us: float = LEAST_TIME_TOLERANCE_US
    """How old a device's time may be when it answers [us]: the sample of a device with a clock of its own is older."""
    timed: bool = True
    """Whether sample counter and device time are judged."""


class ReadingGuard:
    """Judges each reading against the ones before it; `start` forgets these."""

    def __init__(self, rules: ReadingRules) -> None:
        self.rules = rules
        self._rated = any(math.isfinite(rate) for rate in rules.rates)
        self.memory: Guarded = np.zeros(1, dtype=GUARD)
        """Rules and memory, shared with a compiled block."""
        self.memory["frozen_after"], self.memory["frozen_travel"] = rules.frozen_after, rules.frozen_travel
        self.memory["plateau_travel"] = rules.plateau_travel
        self.memory["lockstep_us"] = -1 if rules.lockstep_us is None else rules.lockstep_us
        self.memory["time_tolerance_us"], self.memory["timed"] = rules.time_tolerance_us, rules.timed
        self.start()

    def start(self) -> None:
        """Forget all readings: at the start of a run, and after a fault."""
        self.memory["counts"] = -1
        self.memory["equal"] = self.memory["anchored"] = 0
        for field in ("resolution", "mean_change", "mean_travel", "travel"):
            self.memory[field] = 0.0
        self.memory["lagged"] = math.nan
        self.forget_model()
        self.memory["place"] = self.memory["least_place"] = self.memory["most_place"] = 0.0

    def forget_model(self) -> None:
        """Forget what the model expected: another one expects something else."""
        self.memory["model_from"], self.memory["apart"] = math.nan, 0

    def judge(
        self,
        new: Measurement,
        previous: Measurement,
        level: float,
        elapsed_s: float,
        begun_ns: int,
        answered_ns: int,
    ) -> Finding | None:
        """Return the fault of a reading and its explanation, or None.

        Args:
            new: the reading.
            previous: the reading before it.
            level: the first command that `new` answers [its unit].
            elapsed_s: time since `previous` [s].
            begun_ns: host time of the request [ns].
            answered_ns: host time of the answer [ns].
        """
        is_equal = new.sensed == previous.sensed
        if self._rated and not is_equal:
            for value, before, rate in zip(new.sensed, previous.sensed, self.rules.rates, strict=True):
                if changes_too_fast(value, before, rate, elapsed_s):
                    return self._explain_rate(new, previous, elapsed_s)
        counts = (new.counter - previous.counter) & UINT32
        advance_us = (new.time_us - previous.time_us) & UINT32
        change = 0.0 if is_equal else new.sensed[0] - previous.sensed[0] or math.nan
        if follows(self.memory, change, level, counts, advance_us, new.time_us, begun_ns, answered_ns):
            return None
        if is_equal and (finding := self._explain_stuck(new, level)) is not None:
            return finding
        if self.rules.lockstep_us is not None:
            return self._explain_lockstep(counts, advance_us, self.rules.lockstep_us)
        if not 0 < advance_us < HALF_UINT32:
            return Fault.DEVICE_TIME, (
                f"the device's time went from {previous.time_us} to {new.time_us} us with a new sample: its clock "
                "stands or was set back"
            )
        if counts > COUNTS_PER_US * advance_us:
            return Fault.COUNTER_JUMP, (
                f"the sample counter went on by {counts} in {advance_us} us of device time: it has jumped"
            )
        return self._explain_drift(new.time_us, begun_ns, answered_ns)

    def refuse_contradicted(self, expected: float, sensed: float, error: float) -> None:
        """Raise DriverError for a reading that stays while its model's moves; see `contradicts_model`."""
        if contradicts_model(self.memory, expected, sensed, error):
            self.explain_contradicted(expected, sensed)

    def explain_contradicted(self, expected: float, sensed: float) -> None:
        """Raise DriverError for a reading that `contradicts_model` has refused."""
        s = self.memory[0]
        change, repeats = abs(expected - float(s["model_from"])), int(s["equal"]) + 1
        raise DriverError(Fault.FROZEN_VALUE, explained(self.rules.names[0], sensed, repeats, change))

    def _explain_rate(self, new: Measurement, previous: Measurement, elapsed_s: float) -> Finding:
        names, rates = self.rules.names, self.rules.rates
        changes = zip(names, new.sensed, previous.sensed, rates, strict=True)
        name, value, before, rate = next(
            change for change in changes if changes_too_fast(change[1], change[2], change[3], elapsed_s)
        )
        return Fault.RATE, (
            f"{name} went from {before:.6g} to {value:.6g} in {1e3 * elapsed_s:.4g} ms, faster than the "
            f"plausible {rate:.4g} a second (limits.sensed_rate)"
        )

    def _explain_stuck(self, new: Measurement, level: float) -> Finding | None:
        s, rules = self.memory[0], self.rules
        equal, _, lowest, highest = repeated(s, 0.0, level)
        if not is_stuck(s, equal, highest - lowest):
            return None
        return Fault.FROZEN_VALUE, (
            f"{rules.names[0]} has read {new.sensed[0]!r} {equal + 1} times in a row while the command "
            f"moved by {highest - lowest:.4g}: the sensor is stuck; if it is healthy and only coarse, "
            "--set safety.frozen_after=0 leaves this check out"
        )

    def _explain_lockstep(self, counts: int, advance_us: int, period_us: int) -> Finding:
        if abs(advance_us - period_us) > LOCKSTEP_TOLERANCE_US:
            return Fault.DEVICE_TIME, (
                f"one command in lockstep advanced the device's time by {advance_us} us, its sample period is "
                f"{period_us} us"
            )
        return Fault.COUNTER_JUMP, (
            f"the sample counter went on by {counts}, until now each command advanced it by "
            f"{int(self.memory[0]['counts'])}: samples are missing, or another client drives this device"
        )

    def _explain_drift(self, time_us: int, begun_ns: int, answered_ns: int) -> Finding:
        s = self.memory[0]
        device_us = (time_us - int(s["anchor_us"])) & UINT32
        least_us = 1e-3 * (begun_ns - int(s["anchor_answered_ns"]))
        most_us = 1e-3 * (answered_ns - int(s["anchor_begun_ns"]))
        is_slow = device_us < least_us
        host_us, direction = (least_us, "slow") if is_slow else (most_us, "fast")
        return Fault.DEVICE_TIME, (
            f"the device's clock runs {direction}: {1e-3 * device_us:.4g} ms of its time in {1e-3 * host_us:.4g} ms of "
            "this machine's"
        )


class EnergyGuard:
    """Watches the mean square of each command that has a limit; `start` sets it to that of the applied levels."""

    def __init__(self, limits: Sequence[CommandLimits], names: Sequence[str]) -> None:
        """Watch the commands with these limits; `names`: theirs, with units."""
        self._watched = [
            (index, limit.rms * limit.rms, limit.rms_window_s, names[index])
            for index, limit in enumerate(limits)
            if math.isfinite(limit.rms)
        ]
        self.mean_squares = [0.0] * len(self._watched)
        """Mean square of each command that has a limit, in their order [its unit^2]."""

    def start(self, levels: Sequence[float]) -> None:
        """Take `levels` as applied for long."""
        self.mean_squares = [levels[index] ** 2 for index, *_ in self._watched]

    def hold(self, levels: Sequence[float], held_s: float) -> None:
        """Account for `levels` that are applied for `held_s` [s], whatever they amount to."""
        for k, (index, _, window_s, _) in enumerate(self._watched):
            self.mean_squares[k] = mean_square_after(self.mean_squares[k], levels[index], held_s, window_s)

    def refuse_too_much(self, levels: Sequence[float], period_s: float) -> None:
        """Raise DriverError if `levels`, held for `period_s` [s], exceed a limit; else account for them."""
        for k, (index, most, window_s, name) in enumerate(self._watched):
            mean = mean_square_after(self.mean_squares[k], levels[index], period_s, window_s)
            if mean > most:
                raise DriverError(
                    Fault.ENERGY_LIMIT,
                    f"the next {name}, {levels[index]:.4g}, would bring its root mean square over {window_s:g} s to "
                    f"{math.sqrt(mean):.4g}, at most {math.sqrt(most):.4g} is allowed (limits.rms)",
                )
            self.mean_squares[k] = mean
