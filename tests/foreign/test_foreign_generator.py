"""The foreign generator itself: its files repeat, its conventions and effects are what they say."""

from __future__ import annotations

import json
from dataclasses import replace
from math import exp
from pathlib import Path

import foreign_campaign
import numpy as np
import pytest
from foreign_common import flicker
from foreign_device import EFFECTS, Device, Effect, Readings, lagged, simulate
from foreign_excitations import multisine
from foreign_generate import generate
from foreign_loops import DomainLoop, LimitingLoop
from foreign_sizes import LARGEST, SMALLEST, draw_id, share_changed, sized_effect
from foreign_styles import STYLES, draw_bench

PERIOD_S, TAU_S = 1e-3, 4e-3
BESIDE = {
    "thermal.second_time_constant": {"tau2_s": 0.05},
    "thermal.ambient_drift": {"settling_s": 0.2, "sign": -1.0},
    "actuation.deadband": {"form": "hold"},
    "sensor.ageing": {"exponent": 1.0},
    "structure.resonance": {"quality": 8.0},
}


def loop_at(centre: float) -> DomainLoop:
    """Nine domains from 4 K below to 4 K above `centre` [°C], each 6 K wide."""
    middle = centre + np.arange(-4.0, 5.0)
    return DomainLoop(middle + 3.0, middle - 3.0, np.ones(9), np.ones(9))


def device_at(centre: float, convention: str = "end") -> Device:
    """A device of round numbers; with its transition at 500 °C it is a heated bimorph and nothing else."""
    return Device(
        ambient_C=20.0,
        gain_C_per_mA2=1.0,
        tau_s=TAU_S,
        period_s=PERIOD_S,
        convention=convention,
        new_loop=lambda: loop_at(centre),
        mixing="lichtenecker",
        mixing_number=3.0,
        semiconductor_ohm=1e5,
        activation_K=3000.0,
        metal_ohm=1e3,
        deflection_um=100.0,
        bimorph_um_per_K=-0.5,
    )


def moving(samples: int = 300) -> np.ndarray:
    """Current [mA] of random levels through the transition at 65 °C."""
    return np.repeat(np.random.default_rng(4).uniform(4.0, 8.5, samples // 20), 20)


def effect(name: str, size: float, **values: float | str) -> Effect:
    return Effect(id=name, size=size, unit="", values=values)


def temperature(current: np.ndarray, hidden: Effect | None = None) -> np.ndarray:
    """Temperature [°C] at the end of each period, far below the transition."""
    return simulate(device_at(500.0), current, hidden).temperature


def test_same_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("once", "twice"):
        generate("few_domains", 3, tmp_path / name, None)
    once = {path.name: path.read_bytes() for path in (tmp_path / "once").iterdir()}
    twice = {path.name: path.read_bytes() for path in (tmp_path / "twice").iterdir()}
    assert once == twice
    assert {"dataset.toml", "truth.json", "staircase.csv", "test.csv"} <= set(once)
    assert json.loads(once["truth.json"])["effect"] is None


@pytest.mark.parametrize("style", STYLES)
def test_an_effect_changes_the_readings_by_the_share_that_it_states(style: str) -> None:
    bench = draw_bench(style, 1)
    tau = bench.device.tau_s / bench.device.period_s
    current = multisine(bench, 500, tau, np.random.default_rng(1))
    hidden, told = sized_effect(bench, 1, "actuation.delay", [current], share=0.08)
    without, with_it = simulate(bench.device, current), simulate(bench.device, current, hidden)
    change = np.log(with_it.resistance / without.resistance)
    seen = np.sqrt(np.mean(change**2)) / np.std(np.log(without.resistance))
    assert seen == pytest.approx(told["resistance"])
    assert max(told.values()) == pytest.approx(0.08, rel=0.2)
    assert SMALLEST <= max(told.values()) <= LARGEST


def test_the_two_conventions_are_one_row_of_the_exact_first_order_response_apart() -> None:
    current = moving()
    exact, film = [20.0], 20.0
    for level in current:
        film += (20.0 + level**2 - film) * (1.0 - exp(-PERIOD_S / TAU_S))
        exact.append(film)
    late = simulate(device_at(500.0, "end"), current)
    early = simulate(device_at(500.0, "start"), current)
    np.testing.assert_allclose(late.temperature, exact[1:], rtol=1e-12)
    np.testing.assert_allclose(early.temperature, exact[:-1], rtol=1e-12)
    np.testing.assert_allclose(early.deflection[1:], late.deflection[:-1], atol=1e-12)
    np.testing.assert_allclose(early.resistance[1:], late.resistance[:-1], rtol=1e-12)


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_of_size_zero_is_the_null_and_one_of_some_size_is_not(name: str) -> None:
    device, current = device_at(65.0), moving()
    null = simulate(device, current)
    zero = simulate(device, current, effect(name, 0.0, **BESIDE.get(name, {})))
    for before, after in zip(null, zero, strict=True):
        np.testing.assert_allclose(after, before, rtol=1e-12, atol=1e-12)
    sizes = {"heater.tcr": 1e-3, "actuation.deadband": 1.0, "thermal.latent_heat": 5.0}
    sizes |= {"sensor.self_heating": 1.0, "sensor.crosstalk": 10.0}
    some = simulate(device, current, effect(name, sizes.get(name, 0.02), **BESIDE.get(name, {})))
    assert max(share_changed([null], [some]).values()) > 1e-4


def test_a_delay_of_whole_samples_shifts_and_one_of_half_a_sample_mixes_the_powers() -> None:
    current = moving()
    shifted = np.concatenate([[0.0, 0.0], current[:-2]])
    np.testing.assert_allclose(
        temperature(current, effect("actuation.delay", 2 * PERIOD_S)), temperature(shifted), rtol=1e-12
    )
    keep = exp(-0.5 * PERIOD_S / TAU_S)  # one level: heated for the second half of the first period
    first = temperature(np.full(5, 6.0), effect("actuation.delay", 0.5 * PERIOD_S))[0]
    assert first == pytest.approx(20.0 + 36.0 * (1.0 - keep))


def test_a_share_of_the_heating_comes_with_the_second_time_constant() -> None:
    hidden = effect("thermal.second_time_constant", 0.3, tau2_s=0.05)
    t = PERIOD_S * np.arange(1, 201)
    fast, slow = 1.0 - np.exp(-t / TAU_S), 1.0 - np.exp(-t / 0.05)
    expected = 20.0 + 36.0 * (0.7 * fast + 0.3 * slow)
    np.testing.assert_allclose(temperature(np.full(200, 6.0), hidden), expected, rtol=1e-12)


def test_a_heater_with_tcr_settles_at_the_fixed_point_of_its_power() -> None:
    alpha, power = 2e-3, 36.0
    settled = temperature(np.full(200, 6.0), effect("heater.tcr", alpha))[-1]
    assert settled == pytest.approx(20.0 + power / (1.0 - alpha * power), rel=1e-9)


def test_the_sense_current_heats_as_much_as_the_resistance_that_is_left() -> None:
    device = device_at(500.0)
    read = simulate(device, np.full(300, 6.0), effect("sensor.self_heating", 5.0))
    cold = float(device.resistance(20.0, 0.0))
    assert read.temperature[-1] == pytest.approx(56.0 + 5.0 * read.resistance[-1] / cold, rel=1e-9)


def test_the_ambient_drifts_by_its_whole_size_where_it_has_settled() -> None:
    hidden = effect("thermal.ambient_drift", 3.0, settling_s=0.02, sign=-1.0)
    assert temperature(np.full(600, 6.0), hidden)[-1] == pytest.approx(53.0, abs=1e-6)


def test_latent_heat_is_taken_from_the_film_once_for_each_domain() -> None:
    loop = loop_at(65.0)
    loop.move(20.0)
    left = loop.move(90.0, latent=9.0)
    assert (left, loop.fractions[0]) == (pytest.approx(81.0), pytest.approx(1.0))
    assert loop.move(20.0, latent=9.0) == pytest.approx(29.0)
    # 1 K each, thresholds 64, 65, ... : at 66.5 °C the first takes it to 65.5, the second to 64.5
    assert loop.move(66.5, latent=9.0) == pytest.approx(64.5)
    assert loop.fractions[0] == pytest.approx(2 / 9)


def test_the_transition_lags_by_its_own_time_constant() -> None:
    device, current = device_at(65.0), moving()
    hidden = effect("hysteresis.rate_dependence", 3e-3)
    expected, loop = [], loop_at(65.0)
    fine = replace(device, period_s=PERIOD_S / 4)
    film = simulate(fine, np.repeat(current, 4)).temperature
    seen = lagged(np.concatenate([[20.0], film]), 3e-3, PERIOD_S / 4)[1:]
    for degrees in seen:
        loop.move(float(degrees))
        expected.append(loop.fractions[0])
    read = simulate(device, current, hidden)
    metallic = (read.deflection + 0.5 * (read.temperature - 20.0)) / 100.0
    assert np.mean(np.abs(metallic - np.array(expected)[3::4])) < 0.01
    null = simulate(device, current)
    np.testing.assert_allclose(read.temperature, null.temperature)


def test_creep_goes_on_for_decades_after_a_step_and_ends_where_the_null_is() -> None:
    device, current = device_at(65.0), np.full(12000, 7.0)
    null, read = simulate(device, current), simulate(device, current, effect("hysteresis.creep", 0.2))
    missing = (null.deflection - read.deflection) / 100.0
    assert missing[50] > 0.05
    assert missing[50] > missing[500] > missing[2000] > missing[-1] > 0.0
    assert missing[-1] < 1e-4


def test_the_meter_lags_in_resistance_by_first_order_and_the_deflection_does_not() -> None:
    device, current = device_at(65.0, "start"), moving()
    lag = 6e-3
    null, read = simulate(device, current), simulate(device, current, effect("sensor.lag", lag))
    np.testing.assert_array_equal(read.deflection, null.deflection)
    fine = simulate(replace(device, period_s=PERIOD_S / 4), np.repeat(current, 4)).resistance
    # the mean of a first-order lag is that of its input, lag seconds before, less what is still on the way
    dt = PERIOD_S / 4
    balance = np.sum(fine[1:] - lagged(fine, lag, dt)[1:]) * dt
    assert balance == pytest.approx(lag * (lagged(fine, lag, dt)[-1] - fine[0]), rel=0.05)
    np.testing.assert_allclose(read.resistance, lagged(fine, lag, dt)[::4], rtol=2e-2)


def test_ageing_grows_to_its_size_and_crosstalk_adds_the_current_in_force() -> None:
    current = moving()
    for convention in ("start", "end"):
        device = device_at(65.0, convention)
        null = simulate(device, current).resistance
        aged = simulate(device, current, effect("sensor.ageing", 0.1, exponent=1.0)).resistance
        leaked = simulate(device, current, effect("sensor.crosstalk", 7.0)).resistance
        assert aged[-1] / null[-1] == pytest.approx(1.1, abs=1e-3)
        shift = 1 if convention == "start" else 0
        in_force = np.concatenate([np.zeros(shift), current[: current.size - shift]])
        np.testing.assert_allclose(leaked - null, 7.0 * in_force, rtol=1e-6, atol=1e-6)


def test_dead_bands_at_zero_subtract_and_those_that_hold_ignore_small_changes() -> None:
    current = moving()
    zero = effect("actuation.deadband", 0.5, form="zero")
    np.testing.assert_allclose(temperature(current, zero), temperature(current - 0.5))
    small = 6.0 + 0.3 * np.sin(np.arange(200.0))
    hold = effect("actuation.deadband", 0.7, form="hold")
    np.testing.assert_allclose(temperature(small, hold), temperature(np.full(200, 6.0)))


def test_the_mode_rings_at_its_frequency_and_settles_on_the_bending() -> None:
    hidden = effect("structure.resonance", 8e-3, quality=20.0)
    current = np.full(2000, 6.0)
    null, read = simulate(device_at(500.0), current), simulate(device_at(500.0), current, hidden)
    ring = read.deflection - null.deflection
    assert abs(ring[-1]) < 1e-3
    spectrum = np.abs(np.fft.rfft(ring[50:]))
    assert np.argmax(spectrum) / (1950 * PERIOD_S) == pytest.approx(125.0, rel=0.02)


def test_a_limiting_loop_is_continuous_at_reversals_and_cooling_lies_below() -> None:
    loop = LimitingLoop(65.0, 7.0, 0.3, 0.95, 20.0)
    heating = {}
    for degrees in np.arange(20.0, 66.0, 0.01):
        loop.commit(degrees)
        heating[round(degrees, 2)] = loop.metallic(degrees)
    turned = loop.metallic(degrees)
    assert loop.metallic(degrees - 1e-6) == pytest.approx(turned, abs=1e-6)
    assert loop.metallic(63.0) > heating[63.0] + 0.05


def test_effects_come_equally_often_and_a_quarter_is_null() -> None:
    for style in STYLES:
        for seeds in (range(208), range(STYLES.index(style), 832, 4)):
            drawn = [draw_id(style, seed) for seed in seeds]
            assert drawn.count(None) == 52
            assert {drawn.count(name) for name in EFFECTS} <= {11, 12, 13}


def test_flicker_has_unit_variance_and_most_power_at_low_frequency() -> None:
    rng = np.random.default_rng(2)
    ratios = []
    for _ in range(40):
        noise = flicker(4096, rng)
        assert noise.std() == pytest.approx(1.0)
        power = np.abs(np.fft.rfft(noise)) ** 2
        ratios.append(power[1:65].sum() / power[65:].sum())
    harmonic = np.cumsum(1.0 / np.arange(1, 2049))
    assert np.mean(ratios) == pytest.approx(harmonic[63] / (harmonic[-1] - harmonic[63]), rel=0.2)


@pytest.mark.parametrize(
    ("truth", "causes", "outcome"),
    [
        (None, [], "right"),
        (None, [("sensor.lag", [])], "wrong"),
        ("sensor.lag", [], "missed"),
        ("sensor.lag", [("sensor.lag", [])], "right"),
        ("sensor.lag", [("heater.tcr", ["sensor.lag"])], "right"),
        ("sensor.lag", [("heater.tcr", ["a", "b", "sensor.lag"])], "missed"),
        ("sensor.lag", [("heater.tcr", [])], "wrong"),
    ],
)
def test_answers_are_judged_by_the_first_cause_and_a_short_set(
    truth: str | None, causes: list[tuple[str, list[str]]], outcome: str
) -> None:
    told = [{"id": name, "indistinguishable_from": others} for name, others in causes]
    assert (
        foreign_campaign.judge(truth, {"verdict": "explained" if told else "adequate", "causes": told})
        == outcome
    )


def test_wilson_intervals_are_the_published_ones() -> None:
    assert foreign_campaign.wilson(0, 10) == pytest.approx((0.0, 0.2775), abs=1e-4)
    assert foreign_campaign.wilson(5, 10) == pytest.approx((0.2366, 0.7634), abs=1e-4)


def test_share_is_the_larger_change_over_the_variation() -> None:
    before = Readings(np.exp([0.0, 2.0]), np.array([0.0, 10.0]), np.zeros(2))
    after = Readings(np.exp([0.1, 2.1]), np.array([1.0, 11.0]), np.zeros(2))
    assert share_changed([before], [after]) == pytest.approx({"resistance": 0.1, "deflection": 0.2})
