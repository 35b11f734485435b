"""The styles that run only where asked for: films of grains, the panel, the microscope's cantilever."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import foreign_campaign
import foreign_grain_generate
import foreign_grain_sizes
import foreign_response_sizes
import numpy as np
import pytest
from foreign_checks import (
    DEVICE,
    NATURAL,
    RECORD,
    WAVE,
    change,
    check_delay_and_tcr,
    check_null_and_middling,
    check_turns,
)
from foreign_device import EFFECTS, Readings
from foreign_grain_device import EQUATIONS, SUBSTEPS, GrainDevice, make_grains, simulate
from foreign_grain_excitations import walk
from foreign_grain_motion import Film, mixed
from foreign_grain_styles import STYLES as GRAINS
from foreign_grain_styles import draw_bench as grain_bench
from foreign_oscillator_device import EFFECTS as OSCILLATOR_EFFECTS
from foreign_oscillator_device import Effect as OscillatorEffect
from foreign_oscillator_generate import generate
from foreign_oscillator_sizes import draw_names
from foreign_response_device import follow
from foreign_response_device import simulate as respond
from foreign_response_generate import _write_uff
from foreign_response_styles import STYLES as RESPONSES
from foreign_response_styles import draw_bench as response_bench
from scipy.integrate import solve_ivp
from test_foreign_oscillators import COEFFICIENT, VALUES

from rtctl.measured import read_dataset

pytestmark = pytest.mark.slow  # the cases are made by hand and weekly, and so is what makes them checked


@cache
def bench_of(style: str) -> tuple[foreign_grain_generate.Bench, np.ndarray, Readings]:
    """A bench, a short walk of its current [mA], and what it reads."""
    bench = grain_bench(style, 1)
    tau = bench.device.tau_s / bench.device.period_s
    current = walk(bench, 400, tau, np.random.default_rng(3))
    return bench, current, simulate(bench.device, current)


def heated_plate(convention: str) -> GrainDevice:
    """A device whose grains turn at 500 °C: two thermal layers and nothing else."""
    grains = make_grains(
        20.0, *np.full((2, 3), 500.0), np.ones(1), np.zeros(3, np.int64), np.ones(3), np.ones(3)
    )
    return replace(
        grain_bench("buckled_bridge", 0).device,
        ambient_C=20.0,
        gain_C_per_mA2=1.0,
        tau_s=4e-3,
        layer_s=1e-3,
        period_s=1e-3,
        convention=convention,
        grains=grains,
    )


def test_the_film_behind_its_layer_is_the_cascade_of_two_lags() -> None:
    t = 1e-3 * np.arange(1, 60)
    expected = 20.0 + 36.0 * (1.0 - (4e-3 * np.exp(-t / 4e-3) - 1e-3 * np.exp(-t / 1e-3)) / 3e-3)
    late = simulate(heated_plate("end"), np.full(59, 6.0))
    early = simulate(heated_plate("start"), np.full(59, 6.0))
    np.testing.assert_allclose(late.temperature, expected, rtol=1e-12)
    np.testing.assert_allclose(early.temperature[1:], late.temperature[:-1], rtol=1e-12)


def test_a_delay_of_whole_samples_shifts_and_a_heater_with_tcr_settles_at_its_fixed_point() -> None:
    check_delay_and_tcr(simulate, heated_plate("end"))


def test_a_mixture_is_between_its_phases_and_percolates_at_its_threshold() -> None:
    film = Film(1e4, 0.0, 10.0, 0.3, 0.9, 1.7)
    seen = [mixed(1e-4, 1e-1, m, film) for m in np.linspace(0.0, 1.0, 21)]
    assert (seen[0], seen[-1]) == (1e-4, 1e-1)
    assert np.all(np.diff(seen) > 0.0)
    assert np.all(np.array(seen) <= np.linspace(1e-4, 1e-1, 21) * (1.0 + 1e-9))
    even = film._replace(low_exponent=1.0, high_exponent=1.0, critical=1 / 3)
    equal = [mixed(1e-4, 1e-1, m, even) for m in (0.2, 0.6)]
    for m, value in zip((0.2, 0.6), equal, strict=True):  # Bruggeman in three dimensions
        left = m * (0.1 - value) / (0.1 + 2 * value) + (1 - m) * (1e-4 - value) / (1e-4 + 2 * value)
        assert left == pytest.approx(0.0, abs=1e-9)


def test_grains_and_avalanches_are_those_of_a_loop_that_looks_at_every_grain() -> None:
    bench, current, seen = bench_of("buckled_bridge")
    device, grains = bench.device, bench.device.grains
    fine = simulate(
        replace(device, period_s=device.period_s / SUBSTEPS), np.repeat(current, SUBSTEPS)
    ).temperature
    metal = np.zeros(grains.up.size, dtype=bool)
    expected = []
    for degrees in fine:
        for _ in range(99):
            helped = degrees + device.coupling_K * grains.electrical[metal].sum()
            turned = np.where(metal, helped >= grains.down, helped >= grains.up)
            if np.array_equal(turned, metal):
                break
            metal = turned
        expected.append(grains.bends[metal].sum())
    first = SUBSTEPS - 1 if device.convention == "end" else 0
    bent = device.bending(np.array(expected), fine)[first::SUBSTEPS]
    assert np.mean(np.abs(bent - seen.deflection)) < 2e-3 * device.deflection_um


@pytest.mark.parametrize("style", GRAINS)
def test_a_film_is_metallic_when_hot_and_bends_by_its_deflection(style: str) -> None:
    bench, _, seen = bench_of(style)
    hot = simulate(bench.device, np.full(200, bench.high_mA))
    assert hot.resistance[-1] == pytest.approx(bench.device.film.metal, rel=1e-6)
    sag = 1.0 + bench.device.bimorph_per_K * (hot.temperature[-1] - bench.device.ambient_C)
    assert 0.5 * sag < hot.deflection[-1] / bench.device.deflection_um < 1.3 * sag
    assert np.ptp(np.log(seen.resistance)) > 1.5


@pytest.mark.parametrize("style", GRAINS)
@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_of_size_zero_is_the_null_and_a_middling_one_is_not(name: str, style: str) -> None:
    bench, current, null = bench_of(style)
    guess = foreign_grain_sizes.first_guess(bench, name, np.random.default_rng(0), current.size)
    check_null_and_middling(simulate, bench.device, current, null, guess)
    assert set(EQUATIONS) == set(EFFECTS)


def test_a_step_through_the_layer_is_too_fast_to_be_seen() -> None:
    bench, current, null = bench_of("buckled_bridge")
    other = foreign_grain_generate.without_layer(bench)
    assert change(simulate(other.device, current), null) < 3e-3


@pytest.mark.parametrize("response", ["displacement", "acceleration"])
def test_a_response_is_that_of_another_integrator(response: str) -> None:
    def slope(t: float, y: np.ndarray) -> list[float]:
        u = np.interp(t / 0.01, np.arange(300), RECORD.drive)
        return [y[1], 300.0 * u - NATURAL / 20.0 * y[1] - NATURAL**2 * y[0] - 0.5 * abs(y[1]) * y[1]]

    times = 0.01 * np.arange(120)
    exact = solve_ivp(slope, (0.0, 1.2), [0.0, 0.0], "DOP853", times, rtol=1e-8, atol=1e-10, max_step=0.01).y
    expected = exact[0]
    if response == "acceleration":
        expected = np.array([slope(t, y)[1] for t, y in zip(times, exact.T, strict=True)])
    hidden = OscillatorEffect(name="damping.quadratic", size=0.5, unit="")
    seen = respond(DEVICE, replace(RECORD, drive=RECORD.drive[:120]), response, (hidden,)).reading
    np.testing.assert_allclose(seen, expected, atol=2e-4 * np.std(expected))


@pytest.mark.parametrize("name", OSCILLATOR_EFFECTS)
def test_an_effect_on_either_response_vanishes_at_size_zero_and_acts_otherwise(name: str) -> None:
    for response in ("displacement", "acceleration"):
        if response == "acceleration" and name == "drive.offset":
            continue  # a constant force on a straight spring
        null = respond(DEVICE, RECORD, response, steps=8).reading
        size = COEFFICIENT.get(name, 0.05)
        hidden = OscillatorEffect(name=name, size=size, unit="", values=VALUES | {"hold": 0.0})
        zero = respond(DEVICE, RECORD, response, (replace(hidden, size=0.0),), steps=8).reading
        some = respond(DEVICE, RECORD, response, (hidden,), steps=8).reading
        np.testing.assert_array_equal(zero, null)
        if not (
            response == "acceleration" and name.startswith("sensor.")
        ):  # sizes are those of a displacement
            assert np.sqrt(np.mean((some - null) ** 2)) > 1e-3 * np.std(null)


def test_a_lag_of_straight_lines_is_exact() -> None:
    step, tau = 0.1, 0.35
    ramp = np.arange(50) * step
    np.testing.assert_allclose(follow(ramp, tau, step), ramp - tau * (1.0 - np.exp(-ramp / tau)), atol=1e-12)
    assert follow(np.r_[0.0, np.ones(200)], tau, step)[-1] == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("style", GRAINS)
def test_one_seed_in_six_is_null_one_has_two_and_single_effects_go_round(style: str) -> None:
    drawn = [foreign_grain_sizes.draw_names(style, seed) for seed in range(402, 402 + 78)]
    check_turns(drawn)


@pytest.mark.parametrize("style", RESPONSES)
def test_later_oscillators_draw_as_the_others_do(style: str) -> None:
    counts = [draw_names(style, seed, "all")[0] for seed in range(2400)]
    assert (counts.count(0), counts.count(2)) == (400, 400)
    assert foreign_response_sizes.SMALLEST == 0.03
    kinds = foreign_campaign.KINDS
    assert kinds["vo2"].others[: len(GRAINS)] == GRAINS
    assert kinds["oscillator"].others[: len(RESPONSES)] == RESPONSES


@pytest.mark.parametrize(("style", "seed"), [("nanoribbon", 0), ("buckled_bridge", 8)])
def test_a_film_is_read_by_the_program_with_its_units(style: str, seed: int, tmp_path: Path) -> None:
    bench = grain_bench(style, seed)
    dataset = read_dataset(foreign_grain_generate.generate(style, seed, tmp_path))
    plan = foreign_grain_generate.records(bench, seed)
    assert [record.use for record in dataset.records] == [use for _, use, _ in plan]
    for record, (_, _, current) in zip(dataset.records, plan, strict=True):
        np.testing.assert_allclose(record.signals["current"], current, rtol=1e-7)
        clean = simulate(bench.device, current)
        np.testing.assert_allclose(record.signals["resistance"], clean.resistance, rtol=0.02)
        off = np.std(record.signals["deflection"] - clean.deflection)
        assert off < 4e-3 * bench.device.deflection_um
    assert json.loads((tmp_path / "truth.json").read_text("utf-8"))["effect"] is None


@pytest.mark.parametrize(("style", "seed"), [("aerospace_panel", 0), ("afm_cantilever", 3)])
def test_a_response_is_read_by_the_program_with_its_units(style: str, seed: int, tmp_path: Path) -> None:
    bench = response_bench(style, seed)
    dataset = read_dataset(generate(style, seed, tmp_path))
    si = {"m/s^2": 1.0, "g_0": 9.80665, "nm": 1.0}[bench.response_unit] * bench.to_unit * bench.sensor_gain
    unit = 1e-3 if bench.response == "acceleration" else 1.0
    for record, made in zip(dataset.records, bench.records, strict=True):
        drive, clean = record.signals["drive"], respond(bench.device, made, bench.response).reading
        np.testing.assert_allclose(drive, made.drive, rtol=1e-9, atol=1e-9)
        seen = record.signals[bench.response]
        ratio = float(seen @ clean / (clean @ clean))
        assert ratio == pytest.approx(si, rel=0.02) or ratio == pytest.approx(si / unit, rel=0.02)
        assert np.std(seen / ratio - clean) < 2.0 * (bench.white + bench.flicker) * bench.reading_rms


def test_both_forms_of_a_universal_file_hold_the_same(tmp_path: Path) -> None:
    pyuff = pytest.importorskip("pyuff")
    bench = response_bench("aerospace_panel", 0)
    columns = {"FORCE 1Z+": WAVE, "ACC 7Z+": 2.0 * WAVE}
    for form in ("uff", "uff binary"):
        _write_uff(tmp_path / "r.uff", replace(bench, file=form), columns)
        for dataset, column in zip(
            pyuff.UFF(str(tmp_path / "r.uff")).read_sets(), columns.values(), strict=True
        ):
            np.testing.assert_allclose(dataset["data"], column, rtol=1e-11)
