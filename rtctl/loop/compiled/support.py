"""Which runs can be taken in compiled blocks; a reason, in words, for those that cannot."""

from __future__ import annotations

from rtctl.border.compiled_clock import AVAILABLE
from rtctl.border.records import DeviceProfile, Driver
from rtctl.border.wire_memory import CompiledExchange
from rtctl.controllers.playback import PlaybackController
from rtctl.estimators.none import NoEstimator
from rtctl.interfaces import Clock
from rtctl.loop.compiled.sampler import CompiledSampler, compiled_block
from rtctl.loop.compiled.state import MOST_DELAY
from rtctl.loop.compiled.step import CompiledStep
from rtctl.loop.sampler import LoopParts, Sampler
from rtctl.recording.mapped import MappedRecorder
from rtctl.recording.rows import Recorder
from rtctl.timing.clock import MonotonicClock, NoSpin, SimulatedClock, TrackedSpin

BLOCKS = "compiled blocks, without the interpreter's lock"


def compiled_sampler(sampling: Sampler) -> tuple[CompiledSampler | None, str]:
    """The samples of a run in compiled blocks, or None; and what is said of that."""
    reason = why_not(sampling.parts, sampling.plan.reading_delay)
    driver = sampling.parts.driver
    exchange = None if reason else compiled_exchange(driver)
    if exchange is None:
        return None, f"Python: {reason or 'this line is exchanged over in Python'}"
    return CompiledSampler(sampling, exchange, lambda: compiled_exchange(driver)), BLOCKS


def compiled_exchange(driver: Driver) -> CompiledExchange | None:
    """Of a driver that has one; made, or taken from the disk: before a device is armed, for it may last seconds."""
    find = getattr(driver, "compiled_exchange", None)
    found: CompiledExchange | None = None if find is None or not AVAILABLE else find()
    return found


def prepare(driver: Driver) -> None:
    """Compile before the device is opened."""
    if has_one_of_each(driver.profile) and (exchange := compiled_exchange(driver)) is not None:
        compiled_block(exchange)


def has_one_of_each(profile: DeviceProfile) -> bool:
    """One command and one reading."""
    return len(profile.commands) == 1 and len(profile.sensed) == 1


def why_not(parts: LoopParts, delay: int) -> str:
    """Why the samples cannot be taken in compiled blocks, where the driver does not matter; "": they can."""
    checks = (
        (parts.compiled, "clock.unlocked is false"),
        (AVAILABLE, "this machine's system calls are not those that are compiled"),
        (has_one_of_each(parts.driver.profile), "compiled blocks know one command and one reading"),
        (_decides_compiled(parts), "estimator and controller are not one compiled step"),
        (not parts.limits[0].stop, "limits.stop is judged in Python"),
        (delay <= MOST_DELAY, f"a reading is {delay} periods old, compiled blocks know {MOST_DELAY}"),
        (_known_clock(parts.clock), "the clock is another one"),
        (_known_recorders(parts), "the recorder is another one"),
    )
    return next((reason for fits, reason in checks if not fits), "")


def _decides_compiled(parts: LoopParts) -> bool:
    """The observer under a PI in one call, or levels played without an estimate."""
    if type(parts.step) is CompiledStep:
        return True
    plays = type(parts.estimator) is NoEstimator and type(parts.controller) is PlaybackController
    return parts.step is None and plays


def _known_clock(clock: Clock) -> bool:
    if type(clock) is not MonotonicClock:
        return type(clock) is SimulatedClock
    return clock.is_the_machines and type(clock.spin) in (NoSpin, TrackedSpin)


def _known_recorders(parts: LoopParts) -> bool:
    return all(isinstance(to, MappedRecorder | Recorder) for to in (parts.signals, parts.timings))
