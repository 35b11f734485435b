"""Support of compiled blocks: which runs can be taken in them, and the reason for those that cannot."""

from __future__ import annotations

import numpy as np

from rtctl.border.records import DeviceProfile, Driver
from rtctl.border.wire.compiled_clock import AVAILABLE
from rtctl.border.wire.wire_memory import CompiledExchange
from rtctl.controllers.playback import PlaybackController
from rtctl.estimators.none import NoEstimator
from rtctl.interfaces import Clock
from rtctl.loop.compiled.sampler import CompiledSampler, compiled_block
from rtctl.loop.compiled.state import MOST_DELAY
from rtctl.loop.compiled.step import CompiledStep
from rtctl.loop.sampler import LoopParts, Sampler
from rtctl.loop.step import Step
from rtctl.recording.mapped import MappedRecorder
from rtctl.recording.rows import Recorder
from rtctl.safety.guards import GUARD, changes_too_fast, follows, mean_square_after
from rtctl.safety.limits import limit_command
from rtctl.safety.model_reading import contradicts_model
from rtctl.safety.plausibility import is_plausible
from rtctl.timing.clock import (
    MonotonicClock,
    NoSpin,
    SimulatedClock,
    TrackedSpin,
    adapted_spin_ns,
    due_tick,
)
from rtctl.timing.step_timing import StepTiming

BLOCKS = "compiled blocks, without the interpreter's lock"


def compiled_sampler(sampler: Sampler) -> tuple[CompiledSampler | None, str]:
    """Return a sampler in compiled blocks, or None; and how the samples are taken, in words."""
    reason = why_not(sampler.parts, sampler.plan.reading_delay, sampler.step)
    driver = sampler.parts.driver
    exchange = None if reason else compiled_exchange(driver)
    if exchange is None:
        return None, f"Python: {reason or 'this line is exchanged over in Python'}"
    return CompiledSampler(sampler, exchange, lambda: compiled_exchange(driver)), BLOCKS


def compiled_exchange(driver: Driver) -> CompiledExchange | None:
    """Return the driver's compiled exchange, or None; compiling takes seconds, so call it before a device is armed."""
    find = getattr(driver, "compiled_exchange", None)
    exchange: CompiledExchange | None = None if find is None or not AVAILABLE else find()
    return exchange


def compile_kernels() -> None:
    """Compile the kernels of the loop in Python, or load them: before a device is opened, whose watchdog runs then."""
    limit_command(0.0, 0.0, 0.0, 0.0, 0.0)
    is_plausible(0.0, 0.0, 0.0, 0, 0)
    changes_too_fast(0.0, 0.0, 0.0, 0.0)
    follows(np.zeros(1, dtype=GUARD), 0.0, 0.0, 0, 0, 0, 0, 0)
    contradicts_model(np.zeros(1, dtype=GUARD), 0.0, 1.0, 1.0)
    mean_square_after(0.0, 0.0, 0.0, 1.0)
    due_tick(0, 0, 0, 1, 0)
    adapted_spin_ns(0.0, 0, 0.0, 0.0, 0.0)
    StepTiming().step(0, 0, 0)


def prepare(driver: Driver) -> None:
    """Compile the block for a driver before its device is opened."""
    if has_one_of_each(driver.profile) and (exchange := compiled_exchange(driver)) is not None:
        compiled_block(exchange)


def has_one_of_each(profile: DeviceProfile) -> bool:
    """Return whether a device has one command and one reading."""
    return len(profile.commands) == 1 and len(profile.sensed) == 1


def why_not(parts: LoopParts, delay: int, step: Step | None) -> str:
    """Return why samples cannot be taken in compiled blocks, apart from the driver; "": they can."""
    checks = (
        (parts.compiled, "clock.unlocked is false"),
        (AVAILABLE, "this machine's system calls are not those that are compiled"),
        (has_one_of_each(parts.driver.profile), "compiled blocks know one command and one reading"),
        (_decides_compiled(parts, step), "estimator and controller are not one compiled step"),
        (not parts.limits[0].stop, "limits.stop is judged in Python"),
        (delay <= MOST_DELAY, f"a reading is {delay} periods old, compiled blocks know {MOST_DELAY}"),
        (_known_clock(parts.clock), "the clock is another one"),
        (_known_recorders(parts), "the recorder is another one"),
    )
    return next((reason for fits, reason in checks if not fits), "")


def _decides_compiled(parts: LoopParts, step: Step | None) -> bool:
    """Return whether the observer and a PI decide in one call, or levels are played without an estimate."""
    if type(step) is CompiledStep:
        return True
    plays = type(parts.estimator) is NoEstimator and type(parts.controller) is PlaybackController
    return parts.step is None and plays


def _known_clock(clock: Clock) -> bool:
    if type(clock) is not MonotonicClock:
        return type(clock) is SimulatedClock
    return clock.is_the_machines and type(clock.spin) in (NoSpin, TrackedSpin)


def _known_recorders(parts: LoopParts) -> bool:
    return all(isinstance(to, MappedRecorder | Recorder) for to in (parts.signals, parts.timings))
