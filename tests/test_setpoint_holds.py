"""Settled levels: where a hold begins and ends, how far off it is, how long it took."""

from __future__ import annotations

import numpy as np
import pytest

from rtctl.border.records import ME
from rtctl.evaluation.setpoint_holds import (
    SETTLED_PERCENT,
    Hold,
    hold_error_percent,
    holds_of,
    level_rows,
    settling_ms,
)

SETPOINT = np.repeat([1.0, 2.0], 10)
INDEX = np.arange(20.0)


def test_a_hold_settles_a_while_after_its_setpoint() -> None:
    assert holds_of(INDEX, SETPOINT, 1e-3, 3e-3) == [Hold(0, 3, 10), Hold(10, 13, 20)]
    assert holds_of(INDEX, SETPOINT, 1e-3, 0.0) == [Hold(0, 0, 10), Hold(10, 10, 20)]


def test_missed_periods_count_as_time() -> None:
    kept = np.r_[0:3, 8:20]
    assert holds_of(INDEX[kept], SETPOINT[kept], 1e-3, 5e-3) == [Hold(0, 3, 5), Hold(5, 10, 15)]


def test_the_error_is_of_settled_samples_in_percent_of_their_setpoint() -> None:
    output = SETPOINT.copy()
    output[11] = 0.0  # before it has settled
    output[15] = 1.99
    holds = holds_of(INDEX, SETPOINT, 1e-3, 3e-3)
    assert hold_error_percent(SETPOINT, output, holds) == pytest.approx(0.5)
    assert hold_error_percent(SETPOINT, np.full(20, np.nan), holds) is None
    assert hold_error_percent(0.0 * SETPOINT, output, holds) is None


def test_settling_ends_with_the_last_sample_that_is_outside() -> None:
    output = SETPOINT.copy()
    output[[0, 1]] = 0.0
    output[[10, 14]] = 1.9
    holds = holds_of(INDEX, SETPOINT, 1e-3, 0.0)
    assert settling_ms(INDEX, SETPOINT, output, 1e-3, holds) == pytest.approx(5.0)
    assert settling_ms(INDEX, SETPOINT, SETPOINT, 1e-3, holds) == 0.0


def test_a_row_has_means_of_the_settled_part_and_what_the_model_says() -> None:
    signals = {
        "setpoint": SETPOINT, "amplitude": SETPOINT + np.r_[9.0, np.zeros(19)],
        "coil_current": 10.0 * SETPOINT, "drive_frequency": 7500.0 + SETPOINT,
    }  # fmt: skip
    holds = holds_of(INDEX, SETPOINT, 1e-3, 3e-3)
    rows = level_rows(signals, ME, holds, lambda means: {"twice_Hz": 2.0 * means["drive_frequency"]})
    assert rows == [
        {"setpoint_um": 1.0, "amplitude_um": 1.0, "coil_current_mA": 10.0, "drive_frequency_Hz": 7501.0,
         "twice_Hz": 15002.0},
        {"setpoint_um": 2.0, "amplitude_um": 2.0, "coil_current_mA": 20.0, "drive_frequency_Hz": 7502.0,
         "twice_Hz": 15004.0},
    ]  # fmt: skip


def test_a_hold_that_was_cut_short_has_no_row() -> None:
    holds = holds_of(INDEX[:12], SETPOINT[:12], 1e-3, 3e-3)
    signals = dict.fromkeys(("amplitude", "coil_current", "drive_frequency", "setpoint"), SETPOINT[:12])
    assert len(level_rows(signals, ME, holds, lambda means: {})) == 1


def test_figures_of_many_holds_are_those_of_a_loop_over_them() -> None:
    """Oracle: one hold after the other, as the definitions say."""
    rng = np.random.default_rng(2)
    for k in range(60):
        n = int(rng.integers(1, 200))
        index = np.cumsum(rng.integers(1, 3, n)).astype(np.float64)
        each = 1 if k % 3 == 0 else int(rng.integers(2, 20))
        setpoint = np.repeat(rng.choice([-1.0, 0.0, 1.0, 2.0], n), each)[:n]
        output = setpoint * (1.0 + 0.02 * rng.standard_normal(n)) + 0.01
        if k % 4 == 0:
            output[rng.integers(n)] = np.nan
        settle_s = float(rng.uniform(0.0, 0.05))
        holds = holds_of(index, setpoint, 1e-3, settle_s)
        errors, times = [], []
        for hold in holds:
            own, rows = setpoint[hold.first], range(hold.first, hold.end)
            assert set(setpoint[hold.first : hold.end]) == {own}
            late = [r for r in rows if index[r] >= index[hold.first] + np.ceil(settle_s / 1e-3 - 1e-9)]
            assert hold.settled == (late[0] if late else hold.end)
            off = {r: 100.0 * abs(output[r] - own) / own for r in rows if own > 0.0}
            errors += [off[r] for r in late if own > 0.0 and np.isfinite(output[r])]
            if own > 0.0 and np.isfinite(output[hold.first : hold.end]).all():
                outside = [index[r] + 1.0 - index[hold.first] for r in rows if off[r] > SETTLED_PERCENT]
                times.append(max(outside, default=0.0))
        assert hold_error_percent(setpoint, output, holds) == (max(errors) if errors else None)
        assert settling_ms(index, setpoint, output, 1e-3, holds) == (max(times) if times else None)
