"""The foreign oscillators: files repeat, the physics is what textbooks say, effects vanish at size zero."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import foreign_campaign
import numpy as np
import pytest
from foreign_oscillator_device import (
    EFFECTS,
    HOLDS,
    KNOWN,
    MOTION,
    NEW,
    Device,
    Effect,
    Record,
    acting_drive,
    rest_position,
    simulate,
)
from foreign_oscillator_generate import generate, user_model
from foreign_oscillator_guesses import beside, first_guess
from foreign_oscillator_motion import STATES, Law, run
from foreign_oscillator_sizes import LARGEST, SMALLEST, draw_names, share_left, sized_effect
from foreign_oscillator_styles import STYLES, draw_bench
from scipy.integrate import solve_ivp
from scipy.signal import cont2discrete, dlsim

from rtctl.measured import read_dataset

pytestmark = pytest.mark.slow  # the cases are made by hand and weekly, and so is what makes them checked

NATURAL = 2.0 * np.pi * 5.0  # rad/s
PERIOD_S = 0.01
LINEAR = Law(damping=NATURAL / 20.0, stiffness=NATURAL**2, cubic=0.0, gain=300.0)
DEVICE = Device(law=LINEAR, period_s=PERIOD_S, hold="zero")
COEFFICIENT = {  # where the sizes have a unit, as large as the linear force at some z of the motion
    "stiffness.quadratic": 200.0,
    "stiffness.cubic": 200.0,
    "stiffness.quintic": 100.0,
    "stiffness.parametric": 60.0,
    "stiffness.drift": 100.0,
    "stiffness.viscoelastic": 300.0,
    "stiffness.gravity": 700.0,
    "damping.nonlinear": 5.0,
    "damping.quadratic": 0.5,
    "damping.power": 1.0,
    "friction.coulomb": 60.0,
    "friction.coulomb:smooth": 60.0,
    "friction.stribeck": 60.0,
    "friction.presliding": 60.0,
    "hysteresis.bouc_wen": 60.0,
    "mode.second": 0.3,
    "base.motion": 50.0,
    "drive.saturation": 3.0,
    "sensor.highpass": 0.3,
    "input.hold": 1.0,
}
VALUES = {
    "sign": 1.0, "over_s": 2.0, "settles": 1.0, "tau_s": 0.02, "speed": 1.0, "breakaway": 1.5, "yielding": 0.1,
    "loop": 0.7, "order": 1.0, "carried": 0.0, "frequency_Hz": 9.0, "ratio": 0.02, "a": 1.0, "b": 0.5, "U": 3.0,
    "A": 2.0, "hard": 1.0, "hold": 1.0, "stiffness": 9000.0, "damping": 3.0, "exponent": 1.5, "lines": 2.0,
    "spread": 0.1,
}  # fmt: skip


def drive(samples: int = 400) -> np.ndarray:
    """Random levels of RMS 1, each for 8 samples."""
    return np.repeat(np.random.default_rng(5).normal(size=samples // 8), 8)


RECORD = Record(name="r", use="fit", drive=drive())


def effect(name: str, size: float, **values: float) -> Effect:
    return Effect(name=name, size=size, unit="", values=VALUES | values)


def free(law: Law, z: float, seconds: float, h: float = 1e-3) -> np.ndarray:
    """States (z, z') of the motion from rest at `z` without any drive."""
    steps = round(seconds / h)
    none, y = np.zeros((steps, 3)), np.zeros(STATES)
    y[0] = z
    return run(law, none, none, h, 0.0, y, 0, np.zeros((1, 2)))[:, :2]


def test_same_seed_gives_the_same_bytes_and_the_truth_stands_apart(tmp_path: Path) -> None:
    for name in ("once", "twice"):
        generate("test_stand", 3, tmp_path / name, ("sensor.offset",))
    files = [{p.name: p.read_bytes() for p in (tmp_path / name).rglob("*.*")} for name in ("once", "twice")]
    assert files[0] == files[1]
    assert json.loads(files[0]["truth.json"])["effect"] == "sensor.offset"
    users = [path.read_text("utf-8") for path in (tmp_path / "once" / "data").iterdir()]
    assert not any("offset" in text for text in users)


@pytest.mark.parametrize(
    ("law", "potential"),
    [
        (LINEAR, lambda z: 0.5 * NATURAL**2 * z**2),
        (LINEAR._replace(cubic=800.0), lambda z: 0.5 * NATURAL**2 * z**2 + 200.0 * z**4),
        (LINEAR._replace(clearance=0.3), lambda z: 0.5 * NATURAL**2 * np.maximum(np.abs(z) - 0.3, 0.0) ** 2),
        (
            LINEAR._replace(stop_gap=0.6, stop_stiffness=2e4, stop_sides=1.0),
            lambda z: 0.5 * NATURAL**2 * z**2 + 1e4 * np.maximum(z - 0.6, 0.0) ** 2,
        ),
        (
            LINEAR._replace(gravity=NATURAL**2),
            lambda z: NATURAL**2 * (1.0 - np.cos(z)),
        ),
    ],
    ids=["linear", "cubic", "clearance", "stop", "pendulum"],
)
def test_undamped_free_motion_keeps_its_energy(
    law: Law, potential: Callable[[np.ndarray], np.ndarray]
) -> None:
    states = free(law._replace(damping=0.0), 1.2, 20.0, 4e-4)
    energy = 0.5 * states[:, 1] ** 2 + potential(states[:, 0])
    np.testing.assert_allclose(energy, energy[0], rtol=3e-5)
    assert np.ptp(states[:, 0]) > 1.5


def test_the_steady_state_is_that_of_the_transfer_function() -> None:
    h, w = 1e-3, 0.9 * NATURAL
    t = h * (np.arange(20000)[:, None] + np.array([0.0, 0.5, 1.0]))
    states = run(LINEAR, np.sin(w * t), 0.0 * t, h, 0.0, np.zeros(STATES), 0, np.zeros((1, 2)))
    answer = LINEAR.gain / (NATURAL**2 - w * w + 1j * w * LINEAR.damping)
    expected = np.imag(answer * np.exp(1j * w * h * np.arange(20001)))
    np.testing.assert_allclose(states[15000:, 0], expected[15000:], atol=1e-5 * abs(answer))


@pytest.mark.parametrize(("hold", "method"), [("zero", "zoh"), ("linear", "foh")])
def test_the_drive_between_its_samples_is_held_as_stated(hold: str, method: str) -> None:
    matrix = np.array([[0.0, 1.0], [-(NATURAL**2), -LINEAR.damping]])
    system = (matrix, np.array([[0.0], [LINEAR.gain]]), np.array([[1.0, 0.0]]), np.zeros((1, 1)))
    wave = replace(RECORD, drive=np.concatenate([[0.0], RECORD.drive[1:]]))  # at rest before its first sample
    exact = dlsim(cont2discrete(system, PERIOD_S, method=method), wave.drive)[1].ravel()
    seen = simulate(replace(DEVICE, hold=hold), wave).displacement
    np.testing.assert_allclose(seen, exact, atol=2e-5 * np.max(np.abs(exact)))


def test_a_band_limited_drive_is_the_sine_that_was_sampled() -> None:
    n, steps = np.arange(600), 5
    window = np.exp(-(((n - 300.0) / 60.0) ** 2))
    nodes = acting_drive(window * np.sin(0.8 * n), "band-limited", steps)
    places = (np.arange(nodes.shape[0])[:, None] + np.array([0.0, 0.5, 1.0])) / steps
    exact = np.exp(-(((places - 300.0) / 60.0) ** 2)) * np.sin(0.8 * places)
    np.testing.assert_allclose(nodes, exact, atol=1e-9)


def test_dry_friction_takes_four_times_its_level_over_the_stiffness_in_each_period_then_holds() -> None:
    level = 0.06 * NATURAL**2
    states = free(LINEAR._replace(damping=0.0, sliding=level), 1.3, 3.0)
    for period in range(5):
        assert states[200 * period, 0] == pytest.approx(1.3 - 0.24 * period, abs=1e-4)
    assert states[-1, 0] == pytest.approx(0.02, abs=1e-4)  # 1.3, -1.18, ..., 0.10, 0.02: below 0.06 it sticks
    np.testing.assert_array_equal(states[-500:, 1], 0.0)


def test_the_mass_sticks_until_the_break_away_level_and_then_slides_at_the_lower_one() -> None:
    law = LINEAR._replace(sliding=100.0, breakaway=60.0, stribeck_speed=0.05)
    h = 1e-3
    force = 200.0 * h * (np.arange(1000)[:, None] + np.array([0.0, 0.5, 1.0]))  # 160 at 0.8 s
    states = run(law, force / law.gain, 0.0 * force, h, 0.0, np.zeros(STATES), 0, np.zeros((1, 2)))
    first = int(np.argmax(np.abs(states[:, 1]) > 0.0))
    assert first * h == pytest.approx(0.8, abs=2 * h)
    assert np.max(states[first:, 0]) > 60.0 / NATURAL**2 * 1.3


EQUATIONS: dict[str, Callable[..., list[float]]] = {
    "stiffness.quadratic": lambda z, v, u, t, m: [-200 * z**2],
    "stiffness.cubic": lambda z, v, u, t, m: [-200 * z**3],
    "stiffness.quintic": lambda z, v, u, t, m: [-100 * z**5],
    "stiffness.parametric": lambda z, v, u, t, m: [-60 * u * z],
    "stiffness.drift": lambda z, v, u, t, m: [-100 * (1 - np.exp(-t / 2)) * z],
    "stiffness.viscoelastic": lambda z, v, u, t, m: [-300 * (z - m[0]), (z - m[0]) / 0.02],
    "stiffness.gravity": lambda z, v, u, t, m: [700 * z - 700 * np.sin(z)],
    "damping.nonlinear": lambda z, v, u, t, m: [-5 * z**2 * v],
    "damping.quadratic": lambda z, v, u, t, m: [-0.5 * abs(v) * v],
    "damping.power": lambda z, v, u, t, m: [-np.sign(v) * abs(v) ** 1.5],
    "friction.coulomb:smooth": lambda z, v, u, t, m: [-60 * np.tanh(v)],
    "friction.presliding": lambda z, v, u, t, m: [-60 * m[0], v / 0.1 * (1 - np.sign(v) * m[0])],
    "hysteresis.bouc_wen": lambda z, v, u, t, m: [
        -60 * m[0],
        10 * (v - 0.7 * abs(v) * m[0] - 0.3 * v * abs(m[0])),
    ],
    "mode.second": lambda z, v, u, t, m: [0, m[1], 90 * u - 3197.7527 * m[0] - 2 * 0.02 * 56.548668 * m[1]],
    "drive.lag": lambda z, v, u, t, m: [300 * (m[0] - u), (u - m[0]) / 0.03],
    "sensor.lag": lambda z, v, u, t, m: [0, (z - m[0]) / 0.03],
    "sensor.highpass": lambda z, v, u, t, m: [0, (z - m[0]) * 2 * np.pi * 0.3],
}


@pytest.mark.parametrize("name", EQUATIONS)
def test_a_motion_is_that_of_another_integrator_on_the_bare_equation(name: str) -> None:
    extra, samples = len(EQUATIONS[name](0.0, 0.0, 0.0, 0.0, [0.0, 0.0])) - 1, 150

    def slope(t: float, y: np.ndarray, u: float) -> list[float]:
        z, v, *m = y
        force, *rates = EQUATIONS[name](z, v, u, t, m)
        return [v, 300 * u - NATURAL / 20 * v - NATURAL**2 * z + force, *rates]

    y, rows = np.zeros(2 + extra), []
    for k in range(samples):
        rows.append(y)
        span = (k * PERIOD_S, (k + 1) * PERIOD_S)
        y = solve_ivp(slope, span, y, "DOP853", args=(RECORD.drive[k],), rtol=1e-9, atol=1e-11).y[:, -1]
    table = np.array(rows)
    expected = {"mode.second": table[:, 0] + table[:, -2], "sensor.lag": table[:, -1]}
    expected["sensor.highpass"] = table[:, 0] - table[:, -1]
    size = COEFFICIENT.get(name, 0.03)
    seen = simulate(DEVICE, replace(RECORD, drive=RECORD.drive[:samples]), (effect(name, size),)).displacement
    exact = expected.get(name, table[:, 0])
    np.testing.assert_allclose(seen, exact, atol=1e-4 * np.std(exact))


def test_a_carried_mass_is_an_absorber_at_its_own_frequency() -> None:
    h, w = 1e-3, 2.0 * np.pi * 5.0
    law = LINEAR._replace(mode_mass=0.1, mode_rad_s=w, mode_ratio=0.01)
    t = h * (np.arange(40000)[:, None] + np.array([0.0, 0.5, 1.0]))
    states = run(law, np.sin(w * t), 0.0 * t, h, 0.0, np.zeros(STATES), 0, np.zeros((1, 2)))
    x = (1.0 + 0.02j) / 0.02j  # q / z at its frequency, zeta 0.01
    main = 300.0 / (1j * w * LINEAR.damping - 0.1 * w * w * x)
    assert np.max(np.abs(states[30000:, 0])) == pytest.approx(abs(main), rel=1e-3)


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_of_size_zero_is_the_null_and_one_of_some_size_is_not(name: str) -> None:
    null = simulate(DEVICE, RECORD, steps=8)
    zero = simulate(DEVICE, RECORD, (effect(name, 0.0),), steps=8)
    np.testing.assert_allclose(zero.displacement, null.displacement, atol=1e-9)
    np.testing.assert_allclose(zero.velocity, null.velocity, atol=1e-7)
    some = simulate(DEVICE, RECORD, (effect(name, COEFFICIENT.get(name, 0.05)),), steps=8)
    change = np.sqrt(np.mean((some.displacement - null.displacement) ** 2)) / np.std(null.displacement)
    assert change > 1e-3


def displacement(*effects: Effect) -> np.ndarray:
    return simulate(DEVICE, RECORD, effects).displacement


def test_delays_and_skews_of_whole_samples_shift() -> None:
    null = displacement()
    np.testing.assert_allclose(displacement(effect("drive.delay", 2 * PERIOD_S))[2:], null[:-2], atol=1e-9)
    early = displacement(effect("timing.skew", PERIOD_S, sign=-1.0))
    late = displacement(effect("timing.skew", PERIOD_S))
    np.testing.assert_allclose(early[1:], null[:-1], atol=1e-9)
    np.testing.assert_allclose(late[:-1], null[1:], atol=1e-9)
    at_end = simulate(replace(DEVICE, read_at_end=True), RECORD).displacement
    np.testing.assert_allclose(at_end, late, atol=1e-9)


def test_what_a_drive_passes_is_its_formula() -> None:
    def gained(wave: np.ndarray) -> np.ndarray:
        return simulate(DEVICE, replace(RECORD, drive=wave)).displacement

    u = RECORD.drive
    dead = np.where(np.abs(u) > 0.4, u - np.sign(u) * 0.4, 0.0)
    np.testing.assert_allclose(displacement(effect("drive.deadband", 0.4)), gained(dead), atol=1e-9)
    bent = u + 0.1 * u**2 + 0.15 * u**3 / 9.0
    np.testing.assert_allclose(displacement(effect("drive.harmonics", 0.3)), gained(bent), atol=1e-9)
    bent = displacement(effect("drive.saturation", 6.0))  # knee 0.5
    x = 2.0 * u
    np.testing.assert_allclose(bent, gained(1.5 * (1 / np.tanh(x) - 1 / x)), atol=1e-9)
    played, held = [], 0.0
    for value in u:
        held = value - 0.5 if value - held > 0.5 else value + 0.5 if held - value > 0.5 else held
        played.append(held)
    np.testing.assert_allclose(
        displacement(effect("actuator.backlash", 0.5)), gained(np.array(played)), atol=1e-9
    )
    offset = displacement(effect("drive.offset", 0.5))  # at rest under it before the record begins
    np.testing.assert_allclose(offset - displacement(), 0.5 * 300.0 / NATURAL**2, rtol=1e-5)
    grown = u * (1.0 + 0.2 * (np.arange(u.size) + 0.5) * PERIOD_S / 4.0)  # its mean over each hold
    drifting = displacement(effect("input.gain_drift", 0.2, over_s=4.0, settles=0.0))
    np.testing.assert_allclose(drifting, gained(grown), atol=2e-3)
    assert np.max(np.abs(drifting - displacement())) > 0.1


def test_what_a_sensor_makes_of_the_motion_is_its_formula() -> None:
    z, t = displacement(), PERIOD_S * np.arange(RECORD.drive.size)
    cut = displacement(effect("sensor.saturation", 0.7))
    np.testing.assert_allclose(cut, np.clip(z, -0.6, 0.6), atol=1e-12)
    soft = displacement(effect("sensor.saturation", 0.5, hard=0.0))
    np.testing.assert_allclose(soft, 4.0 * np.tanh(z / 4.0), atol=1e-12)
    np.testing.assert_allclose(
        displacement(effect("sensor.drift", 0.3, exponent=0.5)), z + 0.3 * np.sqrt(t / t[-1]), atol=1e-12
    )
    steps = displacement(effect("sensor.quantisation", 0.25))
    np.testing.assert_allclose(steps, 0.25 * np.round(z / 0.25), atol=1e-12)
    hum = displacement(effect("sensor.hum", 0.1)) - z
    line = np.column_stack([np.sin(2 * np.pi * 9.0 * t), np.cos(2 * np.pi * 9.0 * t)])
    parts = np.linalg.lstsq(line, hum, rcond=None)[0]
    np.testing.assert_allclose(line @ parts, hum, atol=1e-9)
    assert np.hypot(*parts) == pytest.approx(0.1)


def test_a_moving_base_is_an_acceleration_of_the_sizes_rms_times_the_root_of_two() -> None:
    hidden = effect("base.motion", 50.0, lines=1.0)
    still = replace(RECORD, drive=np.zeros(4000))
    moved = simulate(DEVICE, still, (hidden,)).displacement[3000:]
    w = 2.0 * np.pi * 9.0
    expected = 50.0 / abs(NATURAL**2 - w * w + 1j * w * LINEAR.damping)
    assert np.sqrt(2.0) * np.std(moved) == pytest.approx(expected, rel=0.01)
    begun = simulate(DEVICE, still, (hidden,)).displacement[:20]  # it moved before the record began
    assert np.ptp(begun) > expected


def test_the_bistable_beam_rests_in_its_well_under_a_constant_force() -> None:
    law = Law(damping=1.0, stiffness=-400.0, cubic=100.0, gain=1.0)
    z = rest_position(law, 30.0, 2.0)
    assert -400.0 * z + 100.0 * z**3 == pytest.approx(30.0)
    assert z == pytest.approx(2.0 + 30.0 / 800.0, abs=2e-3)
    assert rest_position(law, 0.0, -2.0) == pytest.approx(-2.0, abs=1e-9)


def test_a_record_that_begins_in_motion_is_the_end_of_a_longer_one() -> None:
    whole = simulate(DEVICE, RECORD).displacement
    cut = replace(RECORD, drive=RECORD.drive[100:], before=RECORD.drive[:100])
    np.testing.assert_allclose(simulate(DEVICE, cut).displacement, whole[100:], atol=1e-9)
    begun = simulate(DEVICE, cut, restarts=simulate(DEVICE, cut).fine)  # from the first row's state
    np.testing.assert_allclose(begun.displacement, whole[100:], atol=1e-9)


@pytest.mark.parametrize("style", STYLES)
def test_a_dataset_is_read_by_the_program_with_its_units_rows_and_roles(style: str, tmp_path: Path) -> None:
    seed = 2
    bench = draw_bench(style, seed)
    dataset = read_dataset(generate(style, seed, tmp_path))
    records = dataset.records
    assert len(records) == len(bench.records)
    for record, made in zip(records, bench.records, strict=True):
        np.testing.assert_allclose(record.signals["drive"], made.drive, rtol=1e-8)
        clean = simulate(bench.device, made).displacement * bench.sensor_gain
        off = np.std(record.signals["displacement"] - clean) / bench.rms
        assert off < 3.0 * (bench.white + bench.flicker) + 1e-3
        assert (record.use == "test") == (made.use == "test")


def test_the_users_rough_values_are_off_by_a_little_and_of_the_readings_unit() -> None:
    seen = set()
    for seed in range(12):
        bench = draw_bench("shaker_lab", seed)
        seen.add(bench.user)
        assert bool(user_model(bench, np.random.default_rng(seed))) == (bench.user != "identify")
    assert seen == {"identify", "start", "sheet"}


def test_the_share_of_an_offset_is_the_offset() -> None:
    bench = draw_bench("test_stand", 0)
    hidden, share = sized_effect(bench, 0, "sensor.offset", share=0.1)
    assert share == pytest.approx(0.1, rel=0.15)
    spread = np.concatenate([simulate(bench.device, record).displacement for record in bench.records[:2]])
    assert share == pytest.approx(hidden.size / np.std(spread), rel=0.02)


@pytest.mark.parametrize(
    "same",
    [
        effect("damping.power", 0.2, exponent=1.0),
        effect("stiffness.drift", 0.4, over_s=1e-9, settles=1.0),
        effect("input.gain_drift", 0.2, over_s=1e-9, settles=1.0),
        effect("stiffness.cubic", 0.2),
    ],
    ids=["damping", "stiffness", "gain", "cubic"],
)
def test_an_effect_that_is_another_value_of_the_users_model_has_no_share(same: Effect) -> None:
    bench = draw_bench("test_stand", 0)
    assert bench.cubic_known
    records = tuple(replace(r, drive=r.drive[:3000], before=np.empty(0)) for r in bench.records)
    assert share_left(replace(bench, records=records), (same,)) < 2e-3
    first, device = records[0], bench.device
    seen, null = simulate(device, first, (same,)).displacement, simulate(device, first).displacement
    assert np.std(seen - null) > 2e-2 * np.std(null)


@pytest.mark.parametrize(
    "style",
    [pytest.param(style, marks=pytest.mark.slow) for style in STYLES],
)
def test_an_effect_on_a_bench_reaches_its_share(style: str) -> None:
    bench = draw_bench(style, 4)
    hidden, share = sized_effect(bench, 4, "damping.quadratic")
    assert SMALLEST <= share <= LARGEST
    assert share_left(bench, (hidden,)) == share


def test_every_effect_has_a_guess_with_bounds_and_the_values_that_it_needs() -> None:
    bench = draw_bench("test_stand", 1)
    assert bench.displacement_unit == "rad"
    for name in EFFECTS:
        guess, low, high = first_guess(bench, name, np.random.default_rng(0))
        assert low <= guess.size <= high
        assert beside(bench, name, np.random.default_rng(0)) == guess.values
        assert np.isfinite(simulate(bench.device, bench.records[0], (guess,)).displacement).all()


def test_a_sixth_of_the_seeds_is_null_a_sixth_has_two_and_effects_come_about_equally_often() -> None:
    for which, names in (("known", KNOWN), ("new", NEW), ("all", EFFECTS)):
        for k, style in enumerate(STYLES):
            for seeds in (range(2400), range(k, 9600, 4)):
                drawn = [draw_names(style, seed, which) for seed in seeds]
                counts = [count for count, _ in drawn]
                assert (counts.count(0), counts.count(2)) == (400, 400)
                first = [tried[0] for count, tried in drawn if count == 1]
                each = [first.count(name) for name in names]
                assert min(each) > 0.6 * len(first) / len(names)
                assert max(each) < 1.5 * len(first) / len(names)


def test_known_and_new_effects_are_apart_and_holds_have_their_numbers() -> None:
    assert not set(KNOWN) & set(NEW)
    assert len(KNOWN) == 22
    assert set(MOTION) <= set(EFFECTS)
    assert HOLDS.index("band-limited") == 2


def cause(name: str, *others: str) -> dict[str, object]:
    return {"id": name, "indistinguishable_from": list(others)}


@pytest.mark.parametrize(
    ("causes", "outcome"),
    [
        ([], "missed"),
        ([cause("a")], "partly"),
        ([cause("b"), cause("a")], "right"),
        ([cause("a"), cause("c")], "wrong"),
        ([cause("a"), cause("b"), cause("c")], "wrong"),
        ([cause("c", "a", "b")], "wrong"),
        ([cause("c", "a"), cause("b")], "in sets"),
        ([cause("c", "a"), cause("d", "b")], "in sets"),
        ([cause("c", "a"), cause("d", "b", "e")], "wrong"),
        ([cause("c", "a", "b"), cause("d")], "wrong"),
        ([cause("c", "a", "e", "f"), cause("b")], "wrong"),
    ],
)
def test_two_effects_are_right_if_both_are_named_and_no_other(causes: list[dict], outcome: str) -> None:
    assert foreign_campaign.judge("a", {"verdict": "explained", "causes": causes}, "b") == outcome


@pytest.mark.parametrize(
    ("causes", "outcome"),
    [
        ([cause("b", "a")], "right"),
        ([cause("b", "a", "c")], "missed"),
        ([cause("b", "c")], "wrong"),
    ],
)
def test_one_effect_is_right_in_a_set_of_two(causes: list[dict], outcome: str) -> None:
    assert foreign_campaign.judge("a", {"verdict": "explained", "causes": causes}) == outcome


def test_what_is_true_of_the_bench_is_taken_out_before_the_answer_is_judged() -> None:
    said = {"verdict": "explained", "causes": [cause("timing.skew")]}
    assert foreign_campaign.judge(None, foreign_campaign.to_be_judged(said, ["timing.skew"])) == "right"
    assert foreign_campaign.judge(None, foreign_campaign.to_be_judged(said, [])) == "wrong"
    part = said | {"verdict": "partly_explained"}
    assert foreign_campaign.judge(None, foreign_campaign.to_be_judged(part, ["timing.skew"])) == "missed"
    value = {"verdict": "explained", "causes": [cause("parameter.stiffness_cubic")]}
    assert foreign_campaign.judge("stiffness.cubic", foreign_campaign.to_be_judged(value, [])) == "right"


def test_a_table_counts_pairs_apart_where_there_are_any() -> None:
    case = {"style": "mems", "effect": "a", "second": None, "groups": ["g"], "outcome": "right"}
    case |= {"identify_s": 1.0, "diagnose_s": 2.0}
    without = foreign_campaign.table([case])
    both = foreign_campaign.table([case, case | {"second": "b", "outcome": "partly"}])
    assert "pairs" not in without
    assert without.splitlines()[2].startswith("| mems | 0 | - | - | 1 | 1 (21 to 100 %)")
    assert "| 1 | 0 (0 to 79 %) | 0 (0 to 79 %) | 1 (21 to 100 %) |" in both.splitlines()[2]
