"""The heating obeys its time constant, its steady state, and does not care how a hold is divided."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

CURRENT = st.floats(0.0, 8.0, width=32)
TAU_S, GAIN, AMBIENT = 1.8e-3, 0.945, 23.0


def test_a_step_has_gone_63_percent_of_its_way_after_one_time_constant(make_device):
    device = make_device()
    device.advance((5.0,), TAU_S)
    assert device.temperature_degC - AMBIENT == pytest.approx((1.0 - math.exp(-1.0)) * GAIN * 25.0, rel=1e-12)


@given(current=CURRENT)
def test_the_steady_state_is_ambient_plus_gain_times_current_squared(make_device, current):
    device = make_device()
    device.advance((current,), 1.0)
    assert device.temperature_degC == pytest.approx(AMBIENT + GAIN * current**2, abs=1e-9)


@given(
    before=CURRENT,
    current=CURRENT,
    parts=st.lists(st.floats(0.0, 4e-3), min_size=1, max_size=8),
)
@pytest.mark.slow
def test_a_hold_divided_is_the_same_hold(make_device, before, current, parts):
    whole, divided = make_device(), make_device()
    for device in (whole, divided):
        device.advance((before,), 5e-3)
    whole.advance((current,), sum(parts))
    for part in parts:
        divided.advance((current,), part)
    assert divided.temperature_degC == pytest.approx(whole.temperature_degC, abs=1e-9)
    one_relay = 1.5 / 8192  # a rounding in the temperature may decide one relay
    assert divided.electrical_fraction == pytest.approx(whole.electrical_fraction, abs=one_relay)
    assert divided.structural_fraction == pytest.approx(whole.structural_fraction, abs=one_relay)


def test_a_hold_never_passes_its_steady_state(make_device):
    device = make_device()
    temperatures = []
    for _ in range(100):
        device.advance((6.0,), 3e-4)
        temperatures.append(device.temperature_degC)
    assert temperatures == sorted(temperatures)
    assert temperatures[-1] <= AMBIENT + GAIN * 36.0
