"""The blind cases are what they claim: the physics against SciPy, sizes, files, and independence of the project."""

from __future__ import annotations

import ast
import os
import tomllib
from collections import Counter
from pathlib import Path

import generator
import numpy as np
import pytest
from generator import Options, generate
from generator.added import ADDED
from generator.effects import CATALOGUE, Surroundings
from generator.equation import N_PARAMETERS, P
from generator.files import FORMATS
from generator.holds import HOLDS
from generator.noise import KINDS, add_noise, noise_colour
from generator.oscillator import _draw_ids
from generator.outside import OUTSIDE_CATALOGUE
from generator.plan import Input, Plan, simulate
from generator.stale_caches import drop_stale_caches
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

pytestmark = pytest.mark.slow  # the cases are made by hand and weekly, and so is what makes them checked

FloatArray = NDArray[np.float64]
SMALL = {"samples": 1200, "fit_records": 2, "test_records": 1, "samples_a_period": 20.0}
SPP = 20.0
DT = 2 * np.pi / SPP


def duffing(**parameters: float) -> Plan:
    """Light damping, unit stiffness, some hardening."""
    plan = Plan(parameters=np.zeros(N_PARAMETERS), hold="linear", samples_a_period=SPP, rest=0.0)
    return plan.having(C=0.05, K=1.0, K3=0.05, G=1.0).having(**parameters)


def driven(samples: int, seed: int = 3) -> Input:
    n = np.arange(samples)
    rng = np.random.default_rng(seed)
    u = sum(np.sin(2 * np.pi * f * n / SPP + rng.uniform(0, 6)) for f in (0.3, 0.7, 1.1, 1.6)) * 0.6
    window = np.minimum(1.0, np.minimum(n, samples - 1 - n) / 30.0)
    return Input(number=0, excitation="multisine", use="fit", drive=u * window, displaced=0.0)


def continuous(u: FloatArray, hold: str, t: float) -> float:
    """The drive at any time, as a textbook writes each hold."""
    place = t / DT
    if hold == "zero":
        return float(u[min(int(np.floor(place + 1e-9)), u.size - 1)])
    if hold == "linear":
        return float(np.interp(place, np.arange(u.size), u))
    return float(np.sum(u * np.sinc(place - np.arange(u.size))))


def oracle(rhs, u: FloatArray, hold: str, start: list[float]) -> FloatArray:
    """States (n, samples) by solve_ivp, one call a sample so that no step crosses a jump or a bend."""
    states = [np.array(start)]
    for k in range(u.size - 1):

        def f(t: float, x: FloatArray, k: int = k) -> list[float]:
            # the sample's own end belongs to the piece before it
            return rhs(x, continuous(u, hold, min(t, (k + 1) * DT - 1e-7 * DT)))

        span = (k * DT, (k + 1) * DT)
        states.append(solve_ivp(f, span, states[-1], method="DOP853", rtol=1e-9, atol=1e-11).y[:, -1])
    return np.array(states).T


def base(x: FloatArray, u: float) -> float:
    return u - 0.05 * x[1] - x[0] - 0.05 * x[0] ** 3


@pytest.mark.parametrize("hold", HOLDS)
def test_duffing_agrees_with_solve_ivp_for_each_hold(hold: str) -> None:
    record = driven(150)
    plan = duffing()
    y, _ = simulate(Plan(parameters=plan.parameters, hold=hold, samples_a_period=SPP, rest=0.0), record)
    x = oracle(lambda x, u: [x[1], base(x, u)], record.drive, hold, [0.0, 0.0])
    # zero and linear holds are exact; the sinc sum is a cubic within a step and cut at the record's ends
    assert np.max(np.abs(y - x[0])) < (3e-4 if hold == "band-limited" else 1e-6) * np.max(np.abs(x[0]))


MEMORY_EFFECTS = {
    "bouc-wen": (
        {"BW": 0.3, "BW_BETA": 1.5, "BW_GAMMA": 0.5},
        lambda x, u: [x[1], base(x, u) - 0.3 * x[2], x[1] - 1.5 * abs(x[1]) * x[2] - 0.5 * x[1] * abs(x[2])],
        3,
        lambda x: x[0],
    ),
    "viscoelastic": (
        {"VE": 0.3, "VE_RATE": 0.7},
        lambda x, u: [x[1], base(x, u) - 0.3 * x[2], x[1] - 0.7 * x[2]],
        3,
        lambda x: x[0],
    ),
    "drive lag": (
        {"DRIVE_RATE": 5.0},
        lambda x, u: [x[1], base(x, x[2]), 5.0 * (u - x[2])],
        3,
        lambda x: x[0],
    ),
    "sensor lag": (
        {"SENSOR_RATE": 5.0},
        lambda x, u: [x[1], base(x, u), 5.0 * (x[0] - x[2])],
        3,
        lambda x: x[2],
    ),
    "parallel mode": (
        {"MODE_GAIN": 0.4, "MODE_W2": 6.0, "MODE_C": 0.1},
        lambda x, u: [x[1], base(x, u), x[3], 0.4 * u - 0.1 * x[3] - 6.0 * x[2]],
        4,
        lambda x: x[0] + x[2],
    ),
    "attached mode": (
        {"MODE_MASS": 0.1, "MODE_W2": 1.5, "MODE_C": 0.1},
        lambda x, u: [
            x[1],
            base(x, u) - 0.1 * (0.1 * (x[1] - x[3]) + 1.5 * (x[0] - x[2])),
            x[3],
            -0.1 * (x[3] - x[1]) - 1.5 * (x[2] - x[0]),
        ],
        4,
        lambda x: x[0],
    ),
    "memoryless forces": (
        {"K2": 0.1, "K5": 0.01, "CN": 0.05, "CQ": 0.1, "PAR": 0.2, "CU": 0.05},
        lambda x, u: [
            x[1],
            base(x, u)
            - 0.1 * x[0] ** 2
            - 0.01 * x[0] ** 5
            - 0.05 * x[0] ** 2 * x[1]
            - 0.1 * abs(x[1]) * x[1]
            - 0.2 * u * x[0]
            - 0.05 * abs(u) * x[1],
        ],
        2,
        lambda x: x[0],
    ),
}


@pytest.mark.parametrize("name", MEMORY_EFFECTS)
def test_effects_of_the_equation_agree_with_textbook_forms_by_solve_ivp(name: str) -> None:
    parameters, rhs, states, seen = MEMORY_EFFECTS[name]
    record = driven(100)
    y, _ = simulate(duffing(**parameters), record)
    x = oracle(rhs, record.drive, "linear", [0.0] * states)
    assert np.max(np.abs(y - seen(x))) < 2e-4 * np.max(np.abs(seen(x)))  # |z'| and |h| bend within a step


def test_dry_friction_takes_four_levels_of_amplitude_a_cycle_and_then_sticks() -> None:
    """Free motion from 1 with F = 0.03, k = 1: turning points 1 - 2 F j of alternate sign; stuck once |z| <= F."""
    plan = duffing(C=0.0, K3=0.0, FRICTION=0.03)
    record = Input(number=0, excitation="ring-down", use="fit", drive=np.zeros(601), displaced=1.0)
    y, _ = simulate(plan, record)
    half = int(SPP / 2)
    turning = y[::half]
    expected = np.array([(-1) ** j * (1 - 0.06 * j) for j in range(17)])
    assert np.max(np.abs(turning[:17] - expected)) < 1e-8
    assert abs(turning[17] + (1 - 0.06 * 17)) < 0.03
    assert np.ptp(y[17 * half + 1 :]) == 0.0


def test_stuck_device_waits_for_the_drive_to_exceed_the_level() -> None:
    record = Input(number=0, excitation="ramp", use="fit", drive=np.linspace(0.0, 0.2, 400), displaced=0.0)
    y, _ = simulate(duffing(FRICTION=0.1), record)
    assert np.all(y[:200] == 0.0)
    assert y[220] > 0.0


@pytest.mark.parametrize("hold", ["zero", "linear"])
def test_drive_delayed_by_whole_samples_shifts_the_response(hold: str) -> None:
    record = driven(300)
    plan = Plan(parameters=duffing().parameters, hold=hold, samples_a_period=SPP, rest=0.0)
    late = Plan(parameters=plan.parameters, hold=hold, samples_a_period=SPP, rest=0.0, delay=3 * DT)
    assert np.allclose(simulate(late, record)[0][3:], simulate(plan, record)[0][:-3], atol=1e-8)


def test_delayed_feedback_follows_the_exact_solution_under_a_ramp() -> None:
    record = Input(number=0, excitation="ramp", use="fit", drive=np.linspace(0.0, 1.0, 4000), displaced=0.0)
    y, _ = simulate(duffing(K3=0.0, C=0.5, FEEDBACK=0.3, FEEDBACK_TIME=4.0), record)
    slope = 1.0 / (3999 * DT)
    # z = (r t - lag)/(k + k_f), lag = r (c - k_f tau)/(k + k_f): the ramp's exact particular solution
    t = np.arange(4000) * DT
    exact = slope * (t - (0.5 - 0.3 * 4.0) / 1.3) / 1.3
    assert np.max(np.abs(y[2000:] - exact[2000:])) < 1e-5


# ── the cases ────────────────────────────────────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize("file_format", FORMATS)
def test_same_seed_gives_the_same_bytes(file_format: str, tmp_path: Path) -> None:
    options = SMALL | {"file_format": file_format, "kind": "null"}
    for name in ("a", "b"):
        generate(11, tmp_path / name, **options)
    files = sorted(p.name for p in (tmp_path / "a").iterdir())
    assert len(files) >= 3
    assert files == sorted(p.name for p in (tmp_path / "b").iterdir())
    for name in files:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name


def test_another_seed_gives_another_case(tmp_path: Path) -> None:
    first, second = (generate(seed, tmp_path / str(seed), kind="null", **SMALL) for seed in (1, 2))
    assert first.f0_Hz != second.f0_Hz


def pooled(truth: generator.Truth) -> FloatArray:
    return np.concatenate([r.clean for r in truth.records if r.use == "fit"])


@pytest.mark.parametrize("name", ["friction.coulomb", "drive.lag", "damping.quadratic", "sensor.saturation"])
def test_effect_moves_the_response_by_the_share_that_the_truth_states(name: str, tmp_path: Path) -> None:
    """The same seed without the effect is the same device and drive: their difference is the effect's."""
    options = SMALL | {"shape": "hardening", "noise": "white"}
    having = generate(5, tmp_path / "with", effects=(name,), **options)
    without = generate(5, tmp_path / "without", effects=(), **options)
    assert np.array_equal(having.records[0].drive, without.records[0].drive)
    moved = np.sqrt(np.mean((pooled(having) - pooled(without)) ** 2) / np.mean(pooled(having) ** 2))
    assert having.effects[0].share == pytest.approx(moved, rel=1e-9)
    assert 0.06 <= moved <= 0.30
    assert 0.0 < having.refitted_share < moved


def test_parameters_of_the_truth_are_those_that_act(tmp_path: Path) -> None:
    truth = generate(3, tmp_path, effects=("sensor.offset",), shape="hardening", **SMALL)
    offset = truth.effects[0].parameters["offset"]
    assert offset.unit == truth.noise.unit
    assert truth.effects[0].share == pytest.approx(
        abs(offset.value) / np.sqrt(np.mean(pooled(truth) ** 2)), rel=1e-9
    )


@pytest.mark.parametrize("name", [*CATALOGUE, *OUTSIDE_CATALOGUE, *ADDED])
def test_every_effect_can_be_drawn_and_switched_on(name: str) -> None:
    """Each recipe changes the response, and its parameters carry numbers."""
    draw = (CATALOGUE | OUTSIDE_CATALOGUE | ADDED)[name]
    around = Surroundings(
        bistable=False,
        well=0.0,
        sample_time=DT,
        longest=600 * DT,
        omega0=200.0,
        manifest_hold="linear",
        variant=None,
        radian=2.0,
    )
    recipe = draw(np.random.default_rng(1), around)
    record = driven(600)
    amplitude = 1.0 if np.isnan(recipe.guess) else 0.9 * recipe.guess
    moved = simulate(recipe.apply(duffing(), amplitude), record)[0] - simulate(duffing(), record)[0]
    assert np.sqrt(np.mean(moved**2)) > 1e-5
    assert all(np.isfinite(value[0]) for value in recipe.sizes(amplitude).values())
    named_since = {"stop": {"stop.one_sided", "stop.two_sided"}}
    assert recipe.id in ({name} if name in CATALOGUE | ADDED else named_since.get(name, {generator.OUTSIDE}))


def test_null_is_the_nominal_model_and_noise_and_nothing_else(tmp_path: Path) -> None:
    """Its noise-free outputs solve the nominal equation of formats.md with the true parameters, in their units."""
    truth = generate(
        8,
        tmp_path,
        kind="null",
        shape="hardening",
        quality=20.0,
        hold="linear",
        noise="white",
        snr_dB=40.0,
        **SMALL,
    )
    assert truth.ids == ()
    assert truth.expected_verdict == "adequate"
    assert truth.share == truth.refitted_miss_over_noise == 0.0
    c, k, g, k3 = (
        truth.parameters[n].value for n in ("damping", "stiffness", "drive_gain", "stiffness_cubic")
    )
    record = truth.records[0]
    t = np.arange(200) / truth.sample_rate_Hz
    scale = np.max(np.abs(record.clean))
    solution = solve_ivp(
        lambda s, x: [x[1], g * np.interp(s, t, record.drive[:200]) - c * x[1] - k * x[0] - k3 * x[0] ** 3],
        (0.0, t[-1]),
        [record.clean[0], 0.0],
        t_eval=t,
        max_step=t[1] / 2,
        rtol=1e-9,
        atol=1e-11 * scale,
    )
    assert np.max(np.abs(solution.y[0] - record.clean[:200])) < 1e-5 * scale
    noise = np.concatenate([r.measured - r.clean for r in truth.records])
    assert np.std(noise) == pytest.approx(truth.noise.rms, rel=0.06)  # 4 sigma of 3600 samples is 0.047


@pytest.mark.parametrize("kind", KINDS)
def test_noise_has_its_rms_whatever_its_colour(kind: str) -> None:
    rng = np.random.default_rng(4)
    clean = np.sin(np.arange(16_000) * 0.1)
    colour = noise_colour(rng, kind)
    noise = np.concatenate([add_noise(rng, clean, kind, 0.01, colour) - clean for _ in range(6)])
    # AR(1) at 0.97 leaves about 96000 (1 - 0.97^2) / 2 independent squares; 1/f's lowest octaves decide: wider
    assert np.std(noise) == pytest.approx(0.01, rel=0.2 if kind == "one-over-f" else 0.1)


def test_one_over_f_of_a_sensor_has_one_density_whatever_the_length_of_a_record() -> None:
    """Above what the shorter one shows: a longer record adds slow noise and takes nothing from the fast."""
    rng = np.random.default_rng(5)

    def fast(size: int) -> float:
        noise = add_noise(rng, np.zeros(size), "one-over-f", 1.0, np.ones(1), like=1000)
        return float(np.var(np.diff(noise)))

    assert fast(64_000) == pytest.approx(fast(1000), rel=0.15)  # 3 sigma of 1000 samples
    assert np.mean([fast(1000) for _ in range(50)]) == pytest.approx(fast(64_000), rel=0.03)


def test_hum_runs_on_over_slices_of_one_file(tmp_path: Path) -> None:
    """Hum is what is left of reading minus the response: one sine fits all slices, in the file's own time."""
    truth = generate(4, tmp_path, effects=("sensor.hum",), file_format="csv", slices=True, **SMALL)
    rows = np.loadtxt(tmp_path / "run.csv", delimiter=",", skiprows=1)
    w = truth.effects[0].parameters["angular_frequency"].value
    n = np.arange(rows.shape[0])
    manifest = tomllib.loads((tmp_path / "dataset.toml").read_text(encoding="utf-8"))
    gaps = np.ones(n.size, dtype=bool)
    for record in manifest["records"]:
        gaps[slice(*record["rows"])] = False
    basis = np.column_stack([f(w * n[gaps] / truth.sample_rate_Hz) for f in (np.sin, np.cos, np.ones_like)])
    fit, *_ = np.linalg.lstsq(basis, rows[gaps, 1], rcond=None)
    amplitude = truth.effects[0].parameters["amplitude"].value
    assert np.hypot(fit[0], fit[1]) == pytest.approx(amplitude, rel=0.02)
    assert np.std(rows[gaps, 1] - basis @ fit) < 2.0 * truth.noise.rms


MANIFEST_KEYS = {
    "dataset": {"name", "plant"},
    "signal": {"role", "unit", "hold", "column"},
    "record": {
        "file",
        "sample_rate_hz",
        "time",
        "resample",
        "rows",
        "ignore_first",
        "use",
        "repeat",
        "conditions",
        "initial",
    },
}


def test_manifests_and_models_hold_only_the_keys_of_the_formats(tmp_path: Path) -> None:
    for seed in range(7):
        folder = tmp_path / str(seed)
        truth = generate(seed, folder, kind="null", **SMALL)
        manifest = tomllib.loads((folder / "dataset.toml").read_text(encoding="utf-8"))
        assert set(manifest) == {"dataset", "signals", "records"}
        assert set(manifest["dataset"]) <= MANIFEST_KEYS["dataset"]
        assert set(manifest["signals"]) == {"drive", "displacement"}
        assert all(set(signal) <= MANIFEST_KEYS["signal"] for signal in manifest["signals"].values())
        assert all(set(record) <= MANIFEST_KEYS["record"] for record in manifest["records"])
        assert [record["use"] for record in manifest["records"]] == [record.use for record in truth.records]
        files = {record["file"] for record in manifest["records"]}
        assert {p.name for p in folder.iterdir()} == files | {"dataset.toml", "model.toml"}
        model = tomllib.loads((folder / "model.toml").read_text(encoding="utf-8"))["model"]
        assert model["kind"] == "oscillator"
        assert "mechanisms" not in model
        assert set(model["parameters"]) == set(truth.parameters)
        for name, parameter in model["parameters"].items():
            assert parameter["unit"] == truth.parameters[name].unit
            assert parameter["value"] == pytest.approx(truth.parameters[name].value, rel=0.1)


def test_kinds_of_cases_come_in_their_proportions_and_every_effect_comes_up() -> None:
    drawn = [_draw_ids(np.random.default_rng([seed, 0]), Options()) for seed in range(3000)]
    sizes = Counter(len(ids) for ids in drawn)
    outside = sum(ids[0] in OUTSIDE_CATALOGUE for ids in drawn if ids)
    for count, share in ((sizes[0], 0.20), (sizes[1] - outside, 0.55), (sizes[2], 0.15), (outside, 0.10)):
        assert count == pytest.approx(3000 * share, abs=4 * np.sqrt(3000 * share * (1 - share)))
    assert {name for ids in drawn for name in ids} == set(CATALOGUE) | set(OUTSIDE_CATALOGUE)


def test_generator_imports_nothing_of_the_project() -> None:
    folder = Path(generator.__file__).parent
    imported = set()
    for path in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                imported |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                imported.add(str(node.module).split(".")[0])
    allowed = {"__future__", "collections", "dataclasses", "enum", "pathlib", "tomllib", "typing"}
    assert imported <= allowed | {"numba", "numpy", "pyarrow", "scipy", "tomli_w"}


def test_numbers_of_the_kernel_are_those_of_the_names() -> None:
    from generator import equation

    assert all(getattr(equation, parameter.name) == parameter.value for parameter in P)


def test_wrong_words_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"no effect 'friction.colomb'"):
        generate(1, tmp_path, effects=("friction.colomb",), **SMALL)
    with pytest.raises(TypeError, match="colour"):
        generate(1, tmp_path, colour="pink")
    with pytest.raises(ValueError, match="no plant 'vo3'"):
        generate(1, tmp_path, plant="vo3")


def test_a_record_that_is_cut_is_the_rest_of_the_whole_one_and_begins_in_motion(tmp_path: Path) -> None:
    whole, rest = (generate(100_700, tmp_path / f"{cut}", **SMALL, cut=cut) for cut in (0.0, 0.3))
    for one, other in zip(whole.records, rest.records, strict=True):
        left_out = one.drive.size - other.drive.size
        assert left_out == round(0.3 * one.drive.size)
        assert (one.drive[left_out:] == other.drive).all()
        assert (one.measured[left_out:] == other.measured).all()
    tables = tomllib.loads((tmp_path / "0.3" / "dataset.toml").read_text())["records"]
    assert not [table for table in tables if "initial" in table]
    speeds = [np.abs(np.diff(one.clean[:2])).max() / np.abs(np.diff(one.clean)).max() for one in rest.records]
    assert max(speeds) > 0.2
    with pytest.raises(ValueError, match="share of a record"):
        Options(cut=1.0)


def test_kernels_that_were_compiled_before_a_source_changed_are_dropped(tmp_path: Path) -> None:
    """The integrator calls the equation, which is another file: an old one would make other devices."""
    (tmp_path / "__pycache__").mkdir()
    for name, time_s in (
        ("equation.py", 200.0),
        ("__pycache__/old.nbi", 100.0),
        ("__pycache__/new.nbc", 300.0),
    ):
        (tmp_path / name).write_text("")
        os.utime(tmp_path / name, (time_s, time_s))
    assert drop_stale_caches(tmp_path) == 1
    assert [one.name for one in (tmp_path / "__pycache__").iterdir()] == ["new.nbc"]
