"""Output stays within level, slew and energy, and lies are not believed: in every state of a grid, and in any run."""

from __future__ import annotations

import limit_states
from hypothesis import given, settings
from hypothesis import strategies as st
from limit_states import ENABLED, LIMITS, PERIOD_S, check_level, guarded_parts, healthy, mean_square
from loop_cases import FIRST, WrittenEstimator

from rtctl.border.records import Measurement
from rtctl.controllers.pi import NoFeedforward, PiController, PiGains
from rtctl.interfaces import Estimate
from rtctl.loop.supervisor import run_loop


def test_every_state_of_a_coarse_grid_keeps_the_limits() -> None:
    grid = len(limit_states.asked_levels(5)) * len(limit_states.readings(FIRST))
    assert limit_states.steps(5, 3) == 6 * 4 * 3 * grid
    assert limit_states.memories(3) == 12**3 * 8 * 4


def test_every_sequence_of_two_readings_and_levels_ends_safe_or_goes_on_within_the_limits() -> None:
    symbols = len(limit_states.readings(FIRST)) * len(limit_states.SEQUENCE_ASKS)
    survivors = 4 * 4 - 1  # four good readings, three finite levels; the lowest reading alone is no lie
    assert limit_states.sequences(2) >= symbols + symbols * (survivors - 4)


any_number = st.floats(allow_nan=True, allow_infinity=True)
any_reading = st.builds(
    lambda value, reference, counts, advance_us, status: (value, reference, counts, advance_us, status),
    st.one_of(any_number, st.floats(100.0, 10e6)),
    any_number,
    st.sampled_from([0, 1, 1, 1, 1, 2, 0x80000000]),
    st.sampled_from([1000, 1000, 1000, 1000, 0, 999, 5000]),
    st.sampled_from([ENABLED, ENABLED, ENABLED, 0, 3, 9, 0xFFFF]),
)


class Believing(WrittenEstimator):
    """An estimator that says any number."""

    def __init__(self, said: list[float]) -> None:
        super().__init__()
        self._said = said

    def step(self, levels: object, sensed: object, elapsed_s: float) -> Estimate:  # type: ignore[override]
        return Estimate(self._said.pop(0), 5.0, 0.1, 0)


class Lying(limit_states.Played):
    """A device that reads anything."""

    def __init__(self, read: list[tuple[float, float, int, int, int]], settle: int) -> None:
        super().__init__([], settle)
        self._read = read

    def exchange(self, levels: object) -> Measurement:
        at = len(self.commands) - self._settle
        self.commands.append(levels[0])  # type: ignore[index]
        made = healthy(self._before)
        if at >= 0:
            value, reference, counts, advance_us, status = self._read[at]
            made = Measurement(
                (value,), reference, (self._before.counter + counts) & 0xFFFFFFFF,
                (self._before.time_us + advance_us) & 0xFFFFFFFF, 0, status,
            )  # fmt: skip
        self._before = made
        return made


@settings(deadline=None, max_examples=200)
@given(
    st.lists(any_reading, min_size=1, max_size=12),
    st.lists(any_number, min_size=12, max_size=12),
    st.floats(0.0, 1e6),
    st.floats(1e-6, 1e9),
)
def test_whatever_controller_estimator_and_device_do(
    read: list[tuple[float, float, int, int, int]], said: list[float], kp: float, ki: float
) -> None:
    driver = Lying(read, settle=3)
    controller = PiController(PiGains(kp=kp, ki=ki), NoFeedforward(), deadband=0.0)
    parts, plan = guarded_parts(driver, controller, len(read))  # type: ignore[arg-type]
    object.__setattr__(parts, "estimator", Believing(list(said)))
    outcome = run_loop(parts, plan, FIRST)  # type: ignore[arg-type]
    assert driver.closed_with == [(LIMITS.safe,)]
    before, square = LIMITS.safe, LIMITS.safe**2
    for level in driver.commands[3:]:
        check_level(level, before, PERIOD_S)
        square = mean_square(square, level, PERIOD_S)
        assert square <= LIMITS.rms**2 * (1.0 + 1e-9)
        before = level
    lied = any(not 100.0 <= value <= 10e6 for value, *_ in read[: outcome.steps])
    assert not lied, "a reading that no sensor gives was believed"
