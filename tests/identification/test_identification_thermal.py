"""The heating: its solution, and its time constant back from a device that is written here, relay by relay."""

from __future__ import annotations

import math
from dataclasses import replace

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from rtctl.identification.vo2 import heating as thermal
from rtctl.identification.vo2.heating import (
    SCALES,
    SEARCH_FACTOR,
    answers_own_current,
    find_time_constant,
    fit_time_constant,
    simulate_heating,
)
from rtctl.identification.vo2.lateness import find_late_rows
from rtctl.measured.dataset import Record

claim = settings(deadline=None, max_examples=60, derandomize=True)
NOMINAL_S = 1.8e-3
currents = st.lists(st.floats(0.0, 9.0), min_size=2, max_size=20).map(np.array)
constants = st.floats(2e-4, 2e-2)


@claim
@given(low=st.floats(0.0, 9.0), high=st.floats(0.0, 9.0), period_s=st.floats(1e-5, 1e-2), tau_s=constants)
def test_a_step_of_current_is_the_exponential(low, high, period_s, tau_s):
    v = simulate_heating(np.array([low] + [high] * 30), period_s, tau_s)
    time_s = period_s * np.arange(31) - period_s  # the step acts from sample 1 on
    exact = high**2 + (low**2 - high**2) * np.exp(-np.maximum(time_s, 0.0) / tau_s)
    np.testing.assert_allclose(v**2, exact, rtol=1e-9, atol=1e-9)


@claim
@given(current=currents, tau_s=constants)
def test_heating_is_that_of_an_integrator(current, tau_s):
    period_s, s = 1e-3, [current[0] ** 2]
    for held in current[:-1]:
        rise = solve_ivp(
            lambda _, x, held=held: (held**2 - x) / tau_s,
            (0.0, period_s),
            s[-1:],
            method="LSODA",
            rtol=1e-9,
            atol=1e-9,
        )
        s.append(float(rise.y[0, -1]))
    np.testing.assert_allclose(simulate_heating(current, period_s, tau_s) ** 2, s, rtol=1e-6, atol=1e-6)


@claim
@given(current=currents, tau_s=constants)
def test_two_half_periods_are_one_period(current, tau_s):
    whole, halves = (
        simulate_heating(current, 1e-3, tau_s),
        simulate_heating(np.repeat(current, 2), 5e-4, tau_s),
    )
    np.testing.assert_allclose(halves[::2], whole, rtol=1e-9, atol=1e-9)


def test_nothing_in_nothing_out_and_a_held_current_is_rest():
    assert simulate_heating(np.empty(0), 1e-3, NOMINAL_S).shape == (0,)
    np.testing.assert_allclose(simulate_heating(np.full(50, 6.1), 1e-3, NOMINAL_S), 6.1, rtol=1e-12)


class Relays:
    """-ln R or deflection of a population of relays: on above one v, off below another."""

    def __init__(self, seed, gain):
        draw = np.random.default_rng(seed)
        centre, half = draw.normal(6.2, 0.5, 500), 0.5 * np.abs(draw.normal(0.6, 0.2, 500))
        self.up, self.down, self.gain = centre + half, centre - half, gain

    def simulate(self, v):
        return self.gain * (switched_on(np.asarray(v), self.up, self.down) / 500 + 0.05 * np.asarray(v))


@numba.njit(cache=True)
def switched_on(v, up, down):
    """Return how many relays are on at each v, all off before the first."""
    on, count = np.zeros(len(up)), np.zeros(len(v))
    for i in range(len(v)):
        for k in range(len(up)):
            if v[i] >= up[k]:
                on[k] = 1.0
            elif v[i] <= down[k]:
                on[k] = 0.0
            count[i] += on[k]
    return count


RESISTANCE, DEFLECTION = Relays(1, 2.4), Relays(2, 50.0)
NOISE = 0.003  # ln ohm; and of the deflection, in um, ten times that


def measured(tau_s, seed, *, levels=60, samples_a_hold=12, period_s=1e-3, use="fit", deflection=True):
    """A record of random levels as that device gives it; the heating is integrated here in 50 substeps a sample."""
    draw = np.random.default_rng(seed)
    current = np.repeat(draw.uniform(4.5, 8.4, levels), samples_a_hold)
    s, temperature = current[0] ** 2, []
    for held in current:
        temperature.append(math.sqrt(s))
        for _ in range(50):
            k1 = (held**2 - s) / tau_s
            s += period_s / 50 * (held**2 - s - 0.5 * period_s / 50 * k1) / tau_s
    v = np.array(temperature)
    signals = {
        "current": current,
        "resistance": np.exp(-RESISTANCE.simulate(v) + draw.normal(0.0, NOISE, len(v))),
    }
    if deflection:
        signals["deflection"] = DEFLECTION.simulate(v) + draw.normal(0.0, 10.0 * NOISE, len(v))
    return Record(name=f"r{seed}", period_s=period_s, signals=signals, use=use)


@pytest.mark.parametrize("tau_s", [1.0e-3, 1.8e-3, 4.0e-3])
@pytest.mark.parametrize("deflection", [True, False])
def test_the_true_time_constant_is_within_three_standard_errors(tau_s, deflection):
    found = fit_time_constant(
        [measured(tau_s, 3, deflection=deflection)], RESISTANCE, DEFLECTION if deflection else None, NOMINAL_S
    )
    assert found is not None
    assert abs(found.value_s - tau_s) < 3.0 * found.standard_error_s
    assert found.standard_error_s < 0.01 * tau_s, "and the interval says something"
    assert found.samples == 59 * 9


def test_the_standard_error_is_the_scatter_of_repeated_experiments(monkeypatch):
    monkeypatch.setattr(thermal, "READ_OUT_SHARE", 0.0)  # these read-outs are exact: chance alone is left
    fits = [
        fit_time_constant([measured(NOMINAL_S, seed, levels=30)], RESISTANCE, DEFLECTION, NOMINAL_S)
        for seed in range(20)
    ]
    normalised = [(fit.value_s - NOMINAL_S) / fit.standard_error_s for fit in fits if fit is not None]
    assert len(normalised) == 20
    # 20 squares of standard normals: the sum is within 7.4 and 40 in 99 of 100 experiments
    # (chi-square, 20 degrees), 29 holds widen its tails: 5 to 60
    assert 5.0 < float(np.sum(np.square(normalised))) < 60.0


def test_errors_that_stay_for_a_hold_do_not_count_as_many_samples(monkeypatch):
    """The same errors repeated in each hold must not give a smaller standard error than they deserve."""
    monkeypatch.setattr(thermal, "READ_OUT_SHARE", 0.0)
    draw, normalised = np.random.default_rng(8), []
    for seed in range(20):
        record = measured(NOMINAL_S, seed, levels=30, deflection=False)
        offsets = np.repeat(draw.normal(0.0, 0.1, 30), 12)  # thirty times the noise, one a hold
        record.signals["resistance"][:] *= np.exp(offsets)
        fit = fit_time_constant([record], RESISTANCE, None, NOMINAL_S)
        assert fit is not None
        normalised.append((fit.value_s - NOMINAL_S) / fit.standard_error_s)
    assert float(np.sqrt(np.mean(np.square(normalised)))) < 2.0  # naive samples: near 3


def test_a_read_out_on_a_grid_is_never_more_certain_than_its_cells():
    found = fit_time_constant([measured(NOMINAL_S, 3)], RESISTANCE, DEFLECTION, NOMINAL_S)
    assert found is not None
    assert found.standard_error_s >= thermal.READ_OUT_SHARE * found.value_s


@pytest.mark.parametrize("why", ["sampled slowly", "at rest", "one edge", "off the scale"])
def test_none_where_the_time_constant_cannot_be_seen(why):
    record = {
        "sampled slowly": lambda: measured(NOMINAL_S, 3, period_s=10e-3, samples_a_hold=1, levels=300),
        "at rest": lambda: measured(NOMINAL_S, 3, levels=1, samples_a_hold=100),
        "one edge": lambda: measured(NOMINAL_S, 3, levels=2),
        "off the scale": lambda: measured(0.06, 3, levels=40),
    }[why]()
    assert fit_time_constant([record], RESISTANCE, DEFLECTION, NOMINAL_S) is None


@pytest.mark.parametrize(
    ("tau_s", "period_s", "samples_a_hold"),
    [(0.06, 1e-3, 100), (0.25, 10e-3, 50), (8.0, 0.2, 150), (60e-6, 20e-6, 12), (1.8e-3, 1e-3, 12)],
)
def test_a_device_of_another_speed_is_found_as_well(tau_s, period_s, samples_a_hold):
    record = measured(tau_s, 3, levels=40, period_s=period_s, samples_a_hold=samples_a_hold)
    found = find_time_constant([record], RESISTANCE, DEFLECTION, NOMINAL_S)
    assert found is not None
    assert abs(found.value_s - tau_s) < 4.0 * found.standard_error_s
    assert found.standard_error_s < 0.02 * tau_s


@pytest.mark.parametrize("why", ["sampled slowly", "at rest", "one edge"])
def test_no_speed_is_found_where_none_is_to_be_seen(why):
    record = {
        "sampled slowly": lambda: measured(NOMINAL_S, 3, period_s=30e-3, samples_a_hold=1, levels=300),
        "at rest": lambda: measured(NOMINAL_S, 3, levels=1, samples_a_hold=100),
        "one edge": lambda: measured(NOMINAL_S, 3, levels=2),
    }[why]()
    assert find_time_constant([record], RESISTANCE, DEFLECTION, NOMINAL_S) is None


def test_a_slow_record_beside_a_fast_one_changes_nothing():
    fast, slow = measured(NOMINAL_S, 3), measured(NOMINAL_S, 4, period_s=10e-3)
    alone = fit_time_constant([fast], RESISTANCE, DEFLECTION, NOMINAL_S)
    assert fit_time_constant([slow, fast], RESISTANCE, DEFLECTION, NOMINAL_S) == alone


def test_samples_that_the_manifest_ignores_have_no_say():
    good = measured(NOMINAL_S, 3)
    spoilt = good.signals["resistance"].copy()
    spoilt[:100] *= 3.0
    damaged = Record(
        name="r", period_s=1e-3, signals={**good.signals, "resistance": spoilt}, ignore_first=100
    )
    found = fit_time_constant([damaged], RESISTANCE, None, NOMINAL_S)
    assert found is not None
    assert found.value_s == pytest.approx(NOMINAL_S, rel=0.01)


def read_after(record):
    """The same measurement by a bench that takes a row's readings at the end of its period."""
    later = {name: values[1:] for name, values in record.signals.items() if name != "current"}
    return Record(
        name=record.name, period_s=record.period_s, use=record.use,
        signals={"current": record.signals["current"][:-1], **later},
    )  # fmt: skip


@pytest.mark.parametrize("tau_s", [0.8e-3, 1.8e-3, 4.0e-3])
def test_readings_at_the_end_of_a_period_are_recognised_and_make_the_film_no_faster(tau_s):
    usual = measured(tau_s, 3)
    found = fit_time_constant([read_after(usual)], RESISTANCE, DEFLECTION, NOMINAL_S)
    assert found is not None
    assert found.reads_after
    assert abs(found.value_s - tau_s) < 4.0 * found.standard_error_s
    at_start = fit_time_constant([usual], RESISTANCE, DEFLECTION, NOMINAL_S)
    assert at_start is not None
    assert not at_start.reads_after


@pytest.mark.parametrize("of_range", [0.97, 0.995, 1.02])
def test_readings_at_the_end_are_recognised_of_a_film_at_the_end_of_a_range_of_the_search_too(of_range):
    """Readings at the start had a minimum in that range, 0.43 s: no more than the one that was looked at."""
    tau_s = of_range * NOMINAL_S * SCALES[1] * SEARCH_FACTOR
    record = read_after(measured(tau_s, 3, period_s=0.1, samples_a_hold=45))
    found = find_time_constant([record], RESISTANCE, DEFLECTION, NOMINAL_S)
    assert found is not None
    assert found.reads_after
    assert abs(found.value_s - tau_s) < 4.0 * found.standard_error_s


def test_when_rows_are_read_is_what_the_staircases_say_of_a_device_that_is_delayed_later():
    """The delay of a period, and readings at its end, are as readings at its start of a device without."""
    staircase = read_after(measured(NOMINAL_S, 3, levels=40, use="identify"))
    delayed = [measured(NOMINAL_S, seed, levels=80) for seed in (4, 5)]
    found = fit_time_constant([staircase, *delayed], RESISTANCE, DEFLECTION, NOMINAL_S)
    assert found is not None
    assert found.reads_after
    alone = fit_time_constant(delayed, RESISTANCE, DEFLECTION, NOMINAL_S)
    assert alone is not None
    assert not alone.reads_after


def read_late(record):
    """The same measurement by a device whose readings answer the current one row late."""
    current = record.signals["current"]
    return replace(record, signals={**record.signals, "current": np.append(current[1:], current[-1])})


@pytest.mark.parametrize("tau_s", [1.8e-3, 4.0e-3])
def test_readings_that_come_late_are_told_and_others_are_not(tau_s):
    usual = measured(tau_s, 3)
    for record, low, high in ((usual, 0.0, 0.0), (read_late(usual), 0.25, 1.2)):
        found = fit_time_constant([record], RESISTANCE, DEFLECTION, NOMINAL_S)
        assert found is not None
        assert low <= find_late_rows([record], RESISTANCE, DEFLECTION, found.value_s) <= high


def test_a_record_that_begins_cold_does_not_change_the_speed():
    record = measured(NOMINAL_S, 3, samples_a_hold=30, levels=20)
    warm = record.signals["current"].copy()
    cold = {name: values.copy() for name, values in record.signals.items()}
    s, v = 0.0, []
    for held in warm:
        v.append(math.sqrt(s))
        s = held**2 + (s - held**2) * math.exp(-1e-3 / NOMINAL_S)
    cold["resistance"], cold["deflection"] = np.exp(-RESISTANCE.simulate(v)), DEFLECTION.simulate(v)
    found = fit_time_constant(
        [Record(name="cold", period_s=1e-3, signals=cold)], RESISTANCE, DEFLECTION, NOMINAL_S
    )
    assert found is not None
    assert found.value_s == pytest.approx(NOMINAL_S, rel=0.01)


def two_speeds(slow_share: float, *, reads_after: bool, noise: float = 2e-3) -> Record:
    """Steps from rest of a film of which a share follows in 12 ms, read before a row's current acts or after it."""
    random = np.random.default_rng(4)
    current = np.repeat(random.uniform(2.0, 9.0, 40), 80)
    parts = np.full(2, current[0] ** 2)
    v = np.empty(len(current))
    for k, held in enumerate(current):
        before = parts.copy()
        parts = held**2 + (parts - held**2) * np.exp(-1e-3 / np.array([NOMINAL_S, 12e-3]))
        seen = parts if reads_after else before
        v[k] = math.sqrt((1.0 - slow_share) * seen[0] + slow_share * seen[1])
    reading = np.array(RESISTANCE.simulate(v)) + noise * random.standard_normal(len(v))
    return Record(name="r", period_s=1e-3, signals={"current": current, "resistance": np.exp(-reading)})


@pytest.mark.parametrize("slow_share", [0.0, 0.2, 0.4])
def test_nothing_that_a_film_does_later_looks_like_a_late_reading(slow_share):
    for reads_after in (False, True):
        record = two_speeds(slow_share, reads_after=reads_after)
        for tau_s in (1.5e-3, 4e-3):  # which a fit of one time constant may end at
            assert answers_own_current([record], RESISTANCE, None, tau_s) == reads_after
        found = fit_time_constant([record], RESISTANCE, None, NOMINAL_S)
        assert found is not None
        assert found.reads_after == reads_after
    few = record.signals["current"][:400]
    short = Record(name="r", period_s=1e-3, signals={k: s[: len(few)] for k, s in record.signals.items()})
    assert answers_own_current([short], RESISTANCE, None, NOMINAL_S)  # five steps tell nothing
