"""The styles that are kept back for final figures: the torsion balance and the sputtered cantilever."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import foreign_campaign
import foreign_kept_cantilever_generate as films
import foreign_kept_cantilever_sizes as film_sizes
import foreign_kept_torsion_generate as balances
import foreign_kept_torsion_sizes as balance_sizes
import numpy as np
import pytest
from foreign_checks import (
    DEVICE,
    NATURAL,
    RECORD,
    check_delay_and_tcr,
    check_null_and_middling,
    check_turns,
)
from foreign_common import Array
from foreign_device import EFFECTS, Effect, Readings
from foreign_generate import generate as write_film
from foreign_grain_generate import _truth as grain_truth
from foreign_grain_styles import draw_bench as grain_bench
from foreign_kept_cantilever_device import EQUATIONS, CantileverDevice, simulate
from foreign_kept_cantilever_excitations import levels, records
from foreign_kept_cantilever_motion import Film, left_by_latent, play, resistance
from foreign_kept_cantilever_styles import Bench as FilmBench
from foreign_kept_cantilever_styles import draw_bench as film_bench
from foreign_kept_cantilever_styles import draw_cells
from foreign_kept_torsion_device import EQUATIONS as BALANCE_EQUATIONS
from foreign_kept_torsion_device import simulate as swing
from foreign_kept_torsion_styles import draw_bench as balance_bench
from foreign_oscillator_device import EFFECTS as OSCILLATOR_EFFECTS
from foreign_oscillator_device import Effect as OscillatorEffect
from foreign_oscillator_device import Record
from foreign_oscillator_generate import generate as write_balance
from foreign_oscillator_sizes import draw_names
from scipy.integrate import solve_ivp
from test_foreign_oscillators import COEFFICIENT, VALUES

from rtctl.measured import read_dataset

pytestmark = pytest.mark.slow  # the cases are made by hand, and so is what makes them checked

BALANCE, FILM = "torsion_balance", "sputtered_cantilever"


def hidden(name: str, size: float, **values: float) -> OscillatorEffect:
    return OscillatorEffect(name=name, size=size, unit="", values=VALUES | values)


@cache
def film_of(seed: int) -> tuple[FilmBench, Array, Readings]:
    """A bench, a short record of its current [mA], and what it reads."""
    bench = film_bench(FILM, seed)
    tau = bench.device.tau_s / bench.device.period_s
    current = levels(bench, 500, tau, np.random.default_rng(3))
    return bench, current, simulate(bench.device, current)


def heated_plate(convention: str, second_share: float = 0.0) -> CantileverDevice:
    """A device whose cells turn at 500 °C: heat and nothing else."""
    device = film_bench(FILM, 0).device
    cold = device.cells._replace(up=np.full(128, 500.0), down=np.full(128, 490.0))
    return replace(
        device,
        ambient_C=20.0,
        gain_C_per_mA2=1.0,
        tau_s=4e-3,
        second_share=second_share,
        period_s=1e-3,
        convention=convention,
        cells=cold,
    )


@pytest.mark.parametrize("hold", ["zero", "linear"])
def test_a_swing_is_that_of_another_integrator(hold: str) -> None:
    def slope(t: float, y: Array) -> list[float]:
        place = t / 0.01
        u = np.interp(place, np.arange(300), RECORD.drive) if hold == "linear" else RECORD.drive[int(place)]
        return [y[1], 300.0 * u - NATURAL / 20.0 * y[1] - NATURAL**2 * y[0] - 200.0 * y[0] ** 3]

    y, exact = np.zeros(2), [0.0]
    for k in range(100):  # sample by sample: the drive has kinks there
        span = (0.01 * k, 0.01 * (k + 1) - 1e-13)
        y = solve_ivp(slope, span, y, "DOP853", rtol=1e-9, atol=1e-11).y[:, -1]
        exact.append(float(y[0]))
    short = replace(RECORD, drive=RECORD.drive[:101])
    seen = swing(replace(DEVICE, hold=hold), short, (hidden("stiffness.cubic", 200.0),)).reading
    np.testing.assert_allclose(seen, exact, atol=2e-6 * np.std(exact))


def test_dry_friction_takes_the_same_from_each_swing_and_then_holds_the_bar() -> None:
    device = replace(DEVICE, law=DEVICE.law._replace(damping=1e-9), period_s=0.002)
    silence = Record(name="r", use="fit", drive=np.zeros(700))
    seen = swing(device, silence, (hidden("friction.coulomb", 60.0),), (0.5, 0.0)).angle
    lost = 2.0 * 60.0 / NATURAL**2  # in each half period
    turns = 0.1 * np.arange(5)
    at_turns = np.interp(turns, 0.002 * np.arange(700), seen)
    expected = (0.5 - lost * np.arange(5)) * (-1.0) ** np.arange(5)
    np.testing.assert_allclose(
        at_turns, np.where(np.abs(expected) < 0.5 * lost, at_turns, expected), atol=1e-6
    )
    assert np.ptp(seen[-100:]) == 0.0
    assert abs(seen[-1]) <= 0.5 * lost


def test_a_bar_that_sticks_breaks_away_where_the_torque_exceeds_the_friction() -> None:
    ramp = Record(name="r", use="fit", drive=np.linspace(0.0, 1.0, 401))
    seen = swing(DEVICE, ramp, (hidden("friction.stribeck", 60.0, breakaway=2.0),)).angle
    moved = int(np.argmax(seen > 0.0))
    assert ramp.drive[moved - 1] * 300.0 <= 120.0 <= ramp.drive[moved] * 300.0


@pytest.mark.parametrize("name", OSCILLATOR_EFFECTS)
def test_an_effect_on_a_balance_vanishes_at_size_zero_and_acts_otherwise(name: str) -> None:
    null = swing(DEVICE, RECORD)
    effect = hidden(name, COEFFICIENT.get(name, 0.05), hold=0.0)
    np.testing.assert_array_equal(swing(DEVICE, RECORD, (replace(effect, size=0.0),)).reading, null.reading)
    some = swing(DEVICE, RECORD, (effect,)).reading
    assert np.sqrt(np.mean((some - null.reading) ** 2)) > 1e-3 * np.std(null.reading)
    assert set(BALANCE_EQUATIONS) == set(OSCILLATOR_EFFECTS)


def test_the_balance_is_drawn_and_sized_by_the_rules_of_the_other_oscillators() -> None:
    counts = [draw_names(BALANCE, seed, "all")[0] for seed in range(2400)]
    assert (counts.count(0), counts.count(2)) == (400, 400)
    bench = balance_bench(BALANCE, 5)
    effect, share = balance_sizes.sized_effect(bench, 5, "sensor.offset", 0.1)
    assert share == pytest.approx(0.1, rel=0.12)  # a constant reading is not to be fitted by anything else
    assert effect.size == pytest.approx(share * bench.rms, rel=0.5)
    kinds = foreign_campaign.KINDS
    assert BALANCE in kinds["oscillator"].others
    assert FILM in kinds["vo2"].others
    assert {BALANCE, FILM}.isdisjoint(kinds["oscillator"].styles + kinds["vo2"].styles)


@pytest.mark.parametrize("seed", [9, 12])  # a hardening fibre that the user knows, and a straight one
def test_the_refit_of_a_balance_finds_a_fibre_that_is_many_line_widths_stiffer(seed: int) -> None:
    bench = balance_bench(BALANCE, seed)
    law, records = bench.device.law, list(bench.records[:2])
    other = replace(bench.device, law=law._replace(stiffness=1.3 * law.stiffness, gain=0.8 * law.gain))
    seen = [swing(other, record).reading for record in records]
    found = balance_sizes.regression(bench, records, seen)
    assert found[1] / bench.quality == pytest.approx(0.3, abs=0.03)  # a guess, from held samples
    assert found[2] == pytest.approx(-0.2, abs=0.06)
    assert balance_sizes.share_left(bench, ()) < 1e-4


def test_every_run_of_a_balance_uses_about_the_same_part_of_its_range() -> None:
    for seed in range(3):
        bench = balance_bench(BALANCE, seed)
        rms = [float(np.std(swing(bench.device, record).angle)) for record in bench.records]
        assert max(rms) < 3.0 * min(rms)
        assert len({record.drive.size for record in bench.records}) > 1


@pytest.mark.parametrize("file", ["parquet", "parquet in one", "arrow"])
def test_a_balance_is_read_by_the_program_with_its_units(file: str, tmp_path: Path) -> None:
    seed = next(seed for seed in range(40) if balance_bench(BALANCE, seed).file == file)
    bench = balance_bench(BALANCE, seed)
    dataset = read_dataset(write_balance(BALANCE, seed, tmp_path))
    assert len(dataset.records) == len(bench.records)
    for record, made in zip(dataset.records, bench.records, strict=True):
        drive, clean = record.signals["drive"], swing(bench.device, made).reading
        assert float(drive @ made.drive) ** 2 == pytest.approx((drive @ drive) * (made.drive @ made.drive))
        off = record.signals["displacement"] / bench.to_unit - clean  # the electronics' zero is taken away
        assert np.std(off) < 2.0 * np.hypot(bench.white, bench.flicker) * bench.reading_rms
        assert abs(np.mean(off)) < np.std(off)
        assert record.period_s == pytest.approx(bench.device.period_s, rel=1e-6)
    truth = json.loads((tmp_path / "truth" / "truth.json").read_text("utf-8"))
    assert truth["effect"] is None
    assert truth["also_true"] == (["timing.skew"] if bench.device.read_at_end else [])
    assert len(truth["groups"]) == 2


def test_the_air_has_unit_variance_and_its_correlation_time() -> None:
    noise = balances.air(200_000, 8.0, np.random.default_rng(1))
    assert np.std(noise) == pytest.approx(1.0, abs=0.03)
    assert np.mean(noise[8:] * noise[:-8]) == pytest.approx(np.exp(-1.0), abs=0.03)


def test_a_step_of_current_warms_the_film_by_its_two_modes() -> None:
    t, share = 1e-3 * np.arange(1, 60), 0.3
    expected = 20.0 + 36.0 * (1.0 - (1.0 - share) * np.exp(-t / 4e-3) - share * np.exp(-t / 0.5e-3))
    late = simulate(heated_plate("end", share), np.full(59, 6.0))
    early = simulate(heated_plate("start", share), np.full(59, 6.0))
    np.testing.assert_allclose(late.temperature, expected, rtol=1e-12)
    np.testing.assert_allclose(early.temperature[1:], late.temperature[:-1], rtol=1e-12)


def test_the_second_mode_is_too_weak_to_be_seen() -> None:
    bench, current, _ = film_of(1)
    most = replace(bench.device, second_share=0.003)
    shares = film_sizes.shares_left(most, [current], (), replace(most, second_share=0.0))
    assert max(shares.values()) < 2e-3


def test_a_delay_of_whole_samples_shifts_and_a_heater_with_tcr_settles_at_its_fixed_point() -> None:
    check_delay_and_tcr(simulate, heated_plate("end"))


def test_cells_return_to_where_they_left_and_latent_heat_is_paid_once() -> None:
    cells = draw_cells(np.random.default_rng(2))
    metallic, seen = np.zeros(cells.up.size), []
    outer, inner = np.quantile(cells.up, [0.7, 0.5])
    cold, mild = np.quantile(cells.down, [0.3, 0.5])
    for degrees in (outer, cold, inner, mild, inner, cold, outer, 200.0, -50.0):
        seen.append(play(degrees, cells, cells.electrical, metallic, True))
    assert seen[4] == pytest.approx(seen[2], abs=1e-12)
    assert seen[5] == pytest.approx(seen[1], abs=1e-12)
    assert seen[6] == pytest.approx(seen[0], abs=1e-12)
    assert (seen[-2], seen[-1]) == (pytest.approx(1.0), pytest.approx(0.0, abs=1e-12))
    assert min(seen[0] - seen[1], seen[2] - seen[1], seen[2] - seen[3]) > 0.02
    metallic[:] = 0.0
    before = play(65.0, cells, cells.electrical, metallic, True)
    left = left_by_latent(75.0, before, 12.0, cells, metallic)
    now = play(left, cells, cells.electrical, metallic, True)
    assert left + 12.0 * now == pytest.approx(75.0 + 12.0 * before, abs=1e-4)
    assert now > before + 0.1


def test_the_cells_cool_at_lower_temperatures_than_they_heat_and_are_lopsided() -> None:
    skews = []
    for seed in range(8):
        cells = draw_cells(np.random.default_rng(seed))
        assert np.min(cells.up - cells.down) > 1.5
        assert 3.0 < np.mean(cells.up - cells.down) < 14.0
        assert cells.electrical.sum() == pytest.approx(1.0)
        assert cells.structural.sum() == pytest.approx(1.0)
        skews.append(np.mean((cells.up - cells.up.mean()) ** 3) / cells.up.std() ** 3)
    assert np.median(np.abs(skews)) > 0.15


def test_the_mixture_is_a_mean_of_its_phases_behind_the_contacts() -> None:
    film = Film(1e4, 0.0, 10.0, 0.0, 3.0, 1e-6)
    assert resistance(70.0, 0.0, film) == pytest.approx(1e4 + 3.0)
    assert resistance(70.0, 1.0, film) == pytest.approx(13.0)
    assert resistance(70.0, 0.4, film) == pytest.approx(3.0 + 1e4**0.6 * 10.0**0.4, rel=1e-4)  # Lichtenecker
    parallel = resistance(70.0, 0.4, film._replace(power=1.0))
    assert parallel == pytest.approx(3.0 + 1.0 / (0.6e-4 + 0.4e-1))


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_of_size_zero_is_the_null_and_a_middling_one_is_not(name: str) -> None:
    bench, current, null = film_of(1)
    guess = film_sizes.first_guess(bench, name, np.random.default_rng(0), current.size)
    check_null_and_middling(simulate, bench.device, current, null, guess)
    assert set(EQUATIONS) == set(EFFECTS)


def test_one_seed_in_six_is_null_one_has_two_and_single_effects_go_round() -> None:
    drawn = [film_sizes.draw_names(FILM, seed) for seed in range(402, 402 + 78)]
    check_turns(drawn)


@pytest.mark.parametrize("file", ["tdms", "csv in us"])
def test_a_film_is_read_by_the_program_with_its_units(file: str, tmp_path: Path) -> None:
    seed = next(seed for seed in range(40) if film_bench(FILM, seed).file == file)
    bench = film_bench(FILM, seed)
    dataset = read_dataset(write_film(FILM, seed, tmp_path))
    plan = records(bench, seed)
    assert [record.use for record in dataset.records] == [use for _, use, _ in plan]
    for record, (_, _, current) in zip(dataset.records, plan, strict=True):
        np.testing.assert_allclose(record.signals["current"], current, rtol=1e-8)
        clean = simulate(bench.device, current)
        np.testing.assert_allclose(record.signals["resistance"], clean.resistance, rtol=0.02)
        assert np.std(record.signals["deflection"] - clean.deflection) < 4e-3 * bench.device.deflection_um
        assert record.period_s == pytest.approx(bench.device.period_s)
    truth = json.loads((tmp_path / "truth.json").read_text("utf-8"))
    other = grain_truth(grain_bench("nanoribbon", 0), 0, (), [], "with the effect")
    assert truth.keys() - {"noise_shares"} == other.keys()
    assert (truth["effect"], truth["second"], len(truth["groups"])) == (None, None, 2)


def test_the_same_seed_writes_the_same_bytes_and_hides_what_was_asked_for(tmp_path: Path) -> None:
    for name in ("once", "twice"):
        write_film(FILM, 3, tmp_path / name, "sensor.crosstalk")
    once, twice = ({p.name: p.read_bytes() for p in (tmp_path / n).iterdir()} for n in ("once", "twice"))
    assert once == twice
    truth = json.loads(once["truth.json"])
    assert (truth["effect"], truth["staircase"]) == ("sensor.crosstalk", "before the effect")
    assert 0.03 <= truth["share"] <= 0.3
    assert not any(b"crosstalk" in text for name, text in once.items() if name != "truth.json")
    assert films.staircase_before(np.random.default_rng(0), (Effect(id="heater.tcr", size=1e-3, unit="1/K"),))
