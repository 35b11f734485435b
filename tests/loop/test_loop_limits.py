"""No command leaves its bounds, whoever asks, and no reading is believed that a healthy device cannot give."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtctl.border.errors import DriverError, Fault
from rtctl.border.records import DeviceStatus, Measurement
from rtctl.safety.limits import CommandLimits
from rtctl.safety.plausibility import Plausibility

LIMITS = CommandLimits(low=4.0, high=8.0, safe=0.5, slew_per_s=100.0)
levels = st.floats(-1e6, 1e6)
inside = st.floats(4.0, 8.0)
ENABLED = int(DeviceStatus.ENABLED)


@settings(deadline=None)  # the first example compiles
@given(levels, st.floats(0.0, 20.0), st.floats(1e-6, 1.0))
def test_bounds_hold_from_wherever_the_command_comes(asked: float, before: float, elapsed_s: float) -> None:
    assert 4.0 <= LIMITS.clip(asked, before, elapsed_s) <= 8.0


@settings(deadline=None)  # the first example compiles
@given(levels, inside, st.floats(1e-6, 1.0))
def test_slew_holds_between_bounds(asked: float, before: float, elapsed_s: float) -> None:
    allowed = LIMITS.clip(asked, before, elapsed_s)
    assert abs(allowed - before) <= 100.0 * elapsed_s * (1 + 1e-9) + 1e-12
    if asked != before:
        assert (allowed - before) * (asked - before) >= 0.0, "never away from what was asked"


@settings(deadline=None)  # the first example compiles
@given(inside, inside)
def test_what_is_allowed_passes_untouched(asked: float, before: float) -> None:
    assert CommandLimits(low=4.0, high=8.0, safe=4.0).clip(asked, before, 1e-3) == asked


def test_slew_by_hand() -> None:
    assert LIMITS.clip(8.0, 5.0, 1e-2) == 6.0
    assert LIMITS.clip(4.0, 5.5, 1e-2) == 4.5
    assert LIMITS.clip(8.0, 0.5, 1e-3) == 4.0, "from a safe level below the bounds it starts at the bound"


@pytest.mark.parametrize("level", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_a_fault_not_a_clip(level: float) -> None:
    with pytest.raises(DriverError, match="no level to command") as caught:
        LIMITS.clip(level, 5.0, 1e-3)
    assert caught.value.fault is Fault.NOT_FINITE


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"low": 8.0}, "low = 8 must be below high = 8"),
        ({"low": math.nan}, "low = nan"),
        ({"safe": 8.1}, "safe = 8.1"),
        ({"safe": -0.1}, "safe = -0.1"),
        ({"slew_per_s": 0.0}, "slew = 0"),
        ({"slew_per_s": math.nan}, "slew = nan"),
    ],
)
def test_limits_that_contradict_are_refused(change: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        CommandLimits(**{"low": 4.0, "high": 8.0, "safe": 4.0, **change})


def judged(value: float = 1e4, counter: int = 2, status: int = ENABLED) -> Fault | None:
    plausible = Plausibility(sensed_low=(100.0,), sensed_high=(1e6,), names=("resistance [ohm]",))
    before = Measurement((1e4,), 1.0, 1, 0, 0, ENABLED)
    found = plausible.judge(before._replace(sensed=(value,), counter=counter, status=status), before)
    return found[0] if found else None


def test_the_ends_of_the_plausible_range_are_believed() -> None:
    assert judged(100.0) is None
    assert judged(1e6) is None
    assert judged(math.nextafter(100.0, 0.0)) is Fault.OUT_OF_RANGE
    assert judged(math.nextafter(1e6, 1e9)) is Fault.OUT_OF_RANGE


def test_a_counter_may_wrap_or_jump_ahead_but_not_stand_or_go_back() -> None:
    assert judged(counter=2) is None
    assert judged(counter=1000) is None
    assert judged(counter=1) is Fault.FROZEN_COUNTER
    assert judged(counter=0) is Fault.FROZEN_COUNTER
    last = Measurement((1e4,), 1.0, 0xFFFFFFFF, 0, 0, ENABLED)
    plausible = Plausibility(sensed_low=(100.0,), sensed_high=(1e6,), names=("resistance [ohm]",))
    assert plausible.judge(last._replace(counter=0), last) is None


def test_the_cause_comes_before_its_consequences() -> None:
    tripped = ENABLED | DeviceStatus.WATCHDOG_TRIPPED | DeviceStatus.REFUSED
    assert judged(status=int(tripped)) is Fault.WATCHDOG_TRIPPED
    assert judged(math.nan, status=int(ENABLED | DeviceStatus.SENSOR_FAULT)) is Fault.SENSOR_FAULT
    assert judged(status=int(ENABLED | DeviceStatus.CLAMPED)) is None
    assert judged(math.nan, status=int(ENABLED | DeviceStatus.CLAMPED)) is Fault.NOT_FINITE
