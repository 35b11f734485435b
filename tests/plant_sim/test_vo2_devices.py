"""The bundled devices behave as the paper says of its own: ranges, branches, loops, speed of the loops."""

from __future__ import annotations

import math

import numpy as np
import pytest

from plant_sim.catalogue import bundled_plant
from rtctl.wiring import load_plant

DEVICES = {"vo2_a": (3.68, 8.49), "vo2_b": (4.0, 9.2), "vo2_l2p": (3.68, 8.49)}


def sweep(low: float, high: float, holds: int = 1000) -> np.ndarray:
    return np.linspace(low, high, holds)


@pytest.fixture(scope="module", params=DEVICES)
def branches(request, make_device, quasi_static):
    """(name, heating currents, its (R, D), cooling currents, its (R, D)) between the ends of use."""
    low, high = DEVICES[request.param]
    device = make_device(request.param)
    up = sweep(low, high)
    return request.param, up, quasi_static(device, up), up[::-1], quasi_static(device, up[::-1])


def test_device_a_spans_the_papers_ranges(make_device, quasi_static):
    device = make_device("vo2_a")
    there_and_back = np.append(sweep(3.68, 8.49), sweep(8.49, 3.68))
    resistance, deflection = quasi_static(device, there_and_back)
    assert resistance.min() == pytest.approx(11.19e3, rel=1e-3)
    assert resistance.max() == pytest.approx(130e3, rel=1e-2)
    assert deflection.min() == pytest.approx(1.62, abs=0.05)
    assert deflection.max() == pytest.approx(58.65, abs=0.05)


def test_device_a_switches_near_7_2_mA_heating_and_6_6_mA_cooling(make_device):
    device = make_device("vo2_a")

    def crossing(currents) -> float:
        was = device.electrical_fraction
        for current in currents:
            device.advance((float(current),), 0.01)
            if (device.electrical_fraction - 0.5) * (was - 0.5) <= 0.0 and device.electrical_fraction != was:
                return float(current)
            was = device.electrical_fraction
        raise AssertionError("never half transformed")

    device.advance((3.68,), 0.01)
    assert crossing(sweep(3.68, 8.49)) == pytest.approx(7.2, abs=0.05)
    device.advance((8.49,), 0.1)
    assert crossing(sweep(8.49, 3.68)) == pytest.approx(6.6, abs=0.05)


def test_deflection_is_not_monotone_but_resistance_is(branches):
    """Fig. 4: expansion bends down, the transition up, expansion down again."""
    _, currents, (resistance, deflection), _, _ = branches
    assert (np.diff(resistance) <= 0.0).all()
    lowest, highest = deflection.argmin(), deflection.argmax()
    assert 0 < lowest < highest < currents.size - 1
    assert deflection[0] > deflection[lowest] + 5.0
    assert deflection[-1] < deflection[highest] - 1.0


def test_cooling_lies_beyond_heating(branches):
    """Less resistance and more deflection at the same current while the film is still warm."""
    name, up, (R_up, D_up), _, (R_down, D_down) = branches
    middle = (up > 6.0) & (up < 7.0)
    assert (R_down[::-1][middle] < R_up[middle]).all(), name
    assert (D_down[::-1][middle] > D_up[middle]).all(), name


@pytest.mark.parametrize(("name", "low", "high"), [("vo2_a", 6.6, 7.4), ("vo2_b", 6.6, 7.4)])
def test_minor_loops_of_deflection_against_resistance_leave_the_major_loop(
    name, low, high, make_device, quasi_static
):
    """Fig. 5c: not nested, so no Preisach operator with non-negative weights from R to D can follow."""
    device = make_device(name)
    bottom, top = DEVICES[name]
    heating = quasi_static(device, sweep(bottom, top))
    cooling = quasi_static(device, sweep(top, bottom))
    quasi_static(device, np.append(bottom, sweep(bottom, high)))
    R, D = quasi_static(device, np.append(sweep(high, low), sweep(low, high)))
    on_heating = np.interp(R, heating[0][::-1], heating[1][::-1])
    on_cooling = np.interp(R, *cooling)
    outside = np.maximum(D - np.maximum(on_heating, on_cooling), np.minimum(on_heating, on_cooling) - D)
    assert 1.0 < outside.max() < 4.0


def test_one_transition_for_both_read_outs_would_nest_exactly(make_device):
    keys = {f"hysteresis.structural_{key}": f"0 {unit}" for key, unit in [("offset", "K"), ("scatter", "K")]}
    device = make_device("vo2_a", keys | {"hysteresis.structural_width_ratio": 1.0})
    for current in [*sweep(3.68, 7.2, 100), *sweep(7.2, 6.6, 100)]:
        device.advance((float(current),), 0.01)
        assert device.structural_fraction == device.electrical_fraction


def dynamic_loop(device, low: float, high: float, frequency_Hz: float) -> np.ndarray:
    """(I, R, D) over the heating half of the third period of a sine."""
    phase = np.linspace(0.0, 6.0 * math.pi, 6001)
    current = 0.5 * (low + high) - 0.5 * (high - low) * np.cos(phase)
    rows = []
    for i in current:
        device.advance((float(i),), 1.0 / (2000.0 * frequency_Hz))
        rows.append((i, device.resistance_ohm, device.deflection_um))
    return np.array(rows)[4000:5000].T


@pytest.mark.parametrize("name", DEVICES)
def test_frequency_changes_deflection_against_current_but_not_against_resistance(name, make_device):
    """Fig. 6: 1 Hz against 30 Hz; the heating lags, both read-outs follow one temperature."""
    low, high = DEVICES[name]
    slow, fast = (dynamic_loop(make_device(name), low, high, f) for f in (1.0, 30.0))
    grid = np.linspace(low + 0.5, high - 0.5, 200)
    by_current = np.interp(grid, slow[0], slow[2]) - np.interp(grid, fast[0], fast[2])
    kilohms = np.linspace(15e3, 90e3, 200)
    by_resistance = np.interp(kilohms, *slow[1:, ::-1]) - np.interp(kilohms, *fast[1:, ::-1])
    assert np.abs(by_current).max() > 25.0
    assert np.abs(by_resistance).max() < 0.5


@pytest.mark.parametrize("name", DEVICES)
def test_a_cycle_through_both_ends_returns_to_the_cold_branch(name, make_device, quasi_static):
    low, high = DEVICES[name]
    device = make_device(name)
    quasi_static(device, np.array([low]))
    cold = device.deflection_um
    quasi_static(device, np.array([high, low, 0.0, low]))
    assert device.deflection_um == pytest.approx(cold, abs=0.06)


@pytest.mark.parametrize("seed", [1, 2])
def test_the_film_is_fine_grained(seed, make_device, quasi_static):
    """Against eight times as many domains; independent draws of 8192 would be off by a few times as much."""
    currents = np.append(sweep(3.68, 7.3, 300), sweep(7.3, 6.6, 150))
    curves = [
        quasi_static(make_device("vo2_a", {"hysteresis.seed": seed, "hysteresis.count": count}), currents)[1]
        for count in (8192, 65536)
    ]
    off = curves[0] - curves[1]
    assert off.std() < 1e-3 * 57.03
    assert 0.0 < np.abs(off).max() < 4e-3 * 57.03


def test_devices_share_the_layout_of_their_parameters(make_device):
    """Numba recognises a dtype object at once, an equal one only in microseconds a call."""
    assert make_device("vo2_a")._parameters.dtype is make_device("vo2_b")._parameters.dtype


def test_devices_a_and_b_are_clearly_different(make_device, quasi_static):
    currents = np.append(sweep(4.0, 8.4, 200), sweep(8.4, 4.0, 200))
    (R_a, D_a), (R_b, D_b) = (quasi_static(make_device(name), currents) for name in ("vo2_a", "vo2_b"))
    assert np.abs(D_a - D_b).max() > 10.0
    assert np.abs(np.log(R_a / R_b)).max() > 0.3


@pytest.mark.parametrize("current", [math.nan, math.inf, -math.inf])
def test_a_current_that_is_not_finite_is_refused_and_changes_nothing(make_device, current):
    device = make_device()
    device.advance((5.0,), 1e-3)
    before = device.temperature_degC
    with pytest.raises(ValueError, match="finite current"):
        device.step((current,), 1e-3)
    assert device.temperature_degC == before


def test_a_negative_time_is_refused(make_device):
    with pytest.raises(ValueError, match="time >= 0"):
        make_device().advance((5.0,), -1e-3)


def test_the_accepted_current_is_a_float32(make_device):
    double, single = make_device(), make_device()
    assert double.step((6.7,), 1e-3) == single.step((float(np.float32(6.7)),), 1e-3)
    assert double.temperature_degC == single.temperature_degC


@pytest.mark.parametrize("name", DEVICES)
def test_a_bundled_device_can_be_put_on_a_wire(name):
    plant = load_plant(bundled_plant(name))
    assert 1 <= len(plant.identity.encode("ascii")) <= 16
    assert plant.profile.kind == "vo2"
    assert plant.low <= plant.safe < plant.high
    low, high = DEVICES[name]
    assert plant.low[0] <= low < high <= plant.high[0]
    plant.step(plant.safe, 0.1)
    assert plant.measure()[0][0] * 21e-6 < 10.0
