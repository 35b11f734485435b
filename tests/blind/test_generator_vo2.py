"""The blind vo2 cases are what they claim: memory, physics against formulas and SciPy, sizes, files."""

from __future__ import annotations

import ast
import tomllib
from pathlib import Path

import generator
import numpy as np
import pyarrow.parquet as pq
import pytest
from generator import Vo2Truth, generate
from generator.vo2.case import draw_ids
from generator.vo2.device import draw_device
from generator.vo2.effects import CATALOGUE
from generator.vo2.files import FORMATS
from generator.vo2.kernel import fraction
from generator.vo2.options import Vo2Options
from generator.vo2.outside import OUTSIDE_CATALOGUE
from generator.vo2.physics import FloatArray
from generator.vo2.plant import Input, Output, Plant, simulate, twin
from scipy.integrate import solve_ivp

pytestmark = pytest.mark.slow  # the cases are made by hand and weekly, and so is what makes them checked

SMALL = {
    "samples": 1500,
    "fit_records": 2,
    "test_records": 1,
    "identify_records": 1,
    "sample_rate_Hz": 2000.0,
    "file_format": "npz",
}
RATE = 2000.0
IDS = [
    "thermal.second_time_constant",
    "thermal.nonlinear_loss",
    "thermal.latent_heat",
    "thermal.ambient_drift",
    "heater.tcr",
    "actuation.delay",
    "actuation.deadband",
    "structure.resonance",
    "hysteresis.rate_dependence",
    "hysteresis.creep",
    "hysteresis.shape",
    "sensor.self_heating",
    "sensor.lag",
    "sensor.ageing",
    "sensor.crosstalk",
]


def device() -> Plant:
    return draw_device(np.random.default_rng(7))[0]


def record(current: FloatArray, rate_Hz: float = RATE, use: str = "fit") -> Input:
    return Input(number=0, position=0, use=use, excitation="own", current=current, rate_Hz=rate_Hz)


def telegraph(plant: Plant, samples: int = 1500) -> Input:
    rng = np.random.default_rng(2)
    parts = np.repeat(rng.uniform(0.2, 1.0, samples // 20), 20)
    return record(np.r_[np.full(40, 0.5), plant.physics.top_current * np.sqrt(parts)])


def at_rest(plant: Plant, parts: list[float]) -> Output:
    """Readings after a long hold at each part of the top square of the current."""
    return simulate(plant, record(plant.physics.top_current * np.sqrt(np.array(parts)), 1.0, "identify"))


def held_last(output: Output) -> FloatArray:
    return np.c_[np.log(output.resistance), output.deflection]


def test_loop_closes_at_a_return_point_and_is_wiped_out_beyond_it() -> None:
    """After a closed minor loop the state is the one before it: any later path gives the same readings."""
    plant = device()
    tail = [0.75, 0.55, 0.65, 0.3, 0.9, 0.1, 0.1]
    straight = held_last(at_rest(plant, [0.1, 0.7, 0.5, *tail]))
    looped = held_last(at_rest(plant, [0.1, 0.7, 0.5, 0.62, 0.56, 0.6, 0.5, *tail]))
    assert np.allclose(straight[-6:], looped[-6:], atol=1e-9)
    assert (
        np.ptp(held_last(at_rest(plant, [0.1, 0.7, 0.6, 0.5, 0.6, 0.6]))[[3, 5], 1]) > 0.0
    )  # there is a loop


def test_fraction_goes_from_all_semiconductor_to_all_metal() -> None:
    grains = device().electric
    cold = np.full(grains.weight.size, -1e3)
    assert fraction(20.0, cold, grains, 1.0) < 1e-3
    assert fraction(120.0, cold, grains, 1.0) > 0.999
    assert grains.weight.sum() == pytest.approx(1.0)


def test_heating_is_the_exact_first_order_step_response() -> None:
    plant = device()
    p = plant.physics
    current = np.r_[0.0, np.full(40, p.top_current)]
    t = np.maximum(np.arange(41) - 1, 0) / RATE
    expected = p.ambient + p.heating * p.top_current**2 * (1.0 - np.exp(-t / p.tau))
    assert np.allclose(simulate(plant, record(current)).temperature, expected, atol=1e-9)


def test_twin_of_a_device_without_effects_is_the_device() -> None:
    plant = device()
    having, without = simulate(plant, telegraph(plant)), twin(plant, telegraph(plant))
    assert np.allclose(having.resistance, without.resistance, rtol=1e-9)
    assert np.allclose(having.deflection, without.deflection, atol=1e-9)


def _loss(p, theta, q):  # type: ignore[no-untyped-def]
    return q - theta * (1.0 + p.loss * theta / p.top) / (1.0 + p.loss)


def _tcr(p, theta, q):  # type: ignore[no-untyped-def]
    return q * (1.0 + p.tcr * theta) / (1.0 + p.tcr * p.top) - theta


@pytest.mark.parametrize(("field", "value", "law"), [("loss", 1.5, _loss), ("tcr", 0.008, _tcr)])
def test_nonlinear_heating_agrees_with_solve_ivp(field: str, value: float, law) -> None:  # type: ignore[no-untyped-def]
    plant = device().having(**{field: value})
    p = plant.physics
    current = np.r_[0.0, np.full(30, p.top_current), np.full(30, 0.6 * p.top_current)]
    seen = simulate(plant, record(current)).temperature - p.ambient
    theta = [0.0]
    for i in current[:-1]:
        q = p.heating * i * i
        step = solve_ivp(
            lambda t, x, q=q: law(p, x, q) / p.tau, (0.0, 1.0 / RATE), theta[-1:], rtol=1e-8, atol=1e-8
        )
        theta.append(float(step.y[0, -1]))
    assert np.max(np.abs(seen - theta)) < 2e-3 * p.top


def test_beam_swings_at_its_frequency_and_comes_to_rest_where_the_rigid_one_is() -> None:
    plant = device()
    current = np.r_[np.full(20, 0.5), np.full(4000, 0.4 * plant.physics.top_current)]
    rigid = simulate(plant, record(current, 10_000.0)).deflection
    free = simulate(plant.having(resonance=300.0, quality=25.0), record(current, 10_000.0)).deflection
    assert free[-1] == pytest.approx(rigid[-1], abs=1e-4 * np.ptp(rigid) + 1e-6)
    swing = (free - rigid)[220:1820]
    line = np.argmax(np.abs(np.fft.rfft(swing * np.hanning(swing.size))))
    assert line * 10_000.0 / swing.size == pytest.approx(300.0, abs=7.0)


def test_delay_of_whole_samples_shifts_the_response() -> None:
    plant = device()
    drive = telegraph(plant)
    late = simulate(plant.having(delay=3 / RATE), drive).deflection
    assert np.allclose(late[3:], simulate(plant, drive).deflection[:-3], atol=1e-8)


@pytest.mark.parametrize("name", ["thermal.second_time_constant", "hysteresis.creep", "thermal.latent_heat"])
def test_effect_without_a_static_part_leaves_the_staircase_as_it_is(name: str) -> None:
    plant = device()
    recipe = CATALOGUE[name](np.random.default_rng(1), plant, 3.0)
    parts = [0.1, *np.linspace(0.2, 0.95, 9), *np.linspace(0.9, 0.3, 8)]
    hold = np.repeat(plant.physics.top_current * np.sqrt(parts), 20)
    readings = [
        held_last(simulate(one, record(hold, 5.0, "identify")))[19::20]
        for one in (plant, recipe.apply(plant, recipe.guess))
    ]
    assert np.max(np.abs(readings[1] - readings[0])) < 2e-3 * np.ptp(readings[0][:, 1])


def test_catalogue_is_the_list_of_the_formats() -> None:
    assert list(CATALOGUE) == IDS


@pytest.mark.parametrize("name", [*CATALOGUE, *OUTSIDE_CATALOGUE])
def test_every_effect_moves_the_response(name: str) -> None:
    plant = device()
    recipe = (CATALOGUE | OUTSIDE_CATALOGUE)[name](np.random.default_rng(1), plant, 0.8)
    drive = telegraph(plant)
    moved = held_last(simulate(recipe.apply(plant, recipe.guess), drive)) - held_last(simulate(plant, drive))
    assert np.sqrt(np.mean(moved**2)) > 1e-3
    assert all(np.isfinite(value) for value, _ in recipe.sizes(recipe.guess).values())


@pytest.mark.parametrize(
    "name", ["thermal.second_time_constant", "heater.tcr", "sensor.lag", "sensor.ageing", "widening_loop"]
)
def test_effects_have_their_size(name: str, tmp_path: Path) -> None:
    truth = generate(6, tmp_path, plant="vo2", effects=(name,), **SMALL)
    assert 0.06 <= truth.effects[0].share <= 0.30
    assert truth.share == pytest.approx(truth.effects[0].share, rel=1e-9)
    assert 0.0 < truth.refitted_share <= 1.001 * truth.share


def test_slow_effects_spare_the_staircases(tmp_path: Path) -> None:
    """The same seed without the effect is the same device: a model identified from either is the same."""
    having = generate(6, tmp_path / "a", plant="vo2", effects=("sensor.ageing",), **SMALL)
    without = generate(6, tmp_path / "b", plant="vo2", effects=(), **SMALL)
    for name in ("resistance", "deflection"):
        first, second = having.records[0].clean[name], without.records[0].clean[name]
        assert having.records[0].use == "identify"
        assert np.array_equal(first, second)
    moved = having.records[1].clean["resistance"] - without.records[1].clean["resistance"]
    assert np.max(np.abs(moved)) > 0.0


@pytest.mark.parametrize("file_format", FORMATS)
def test_same_seed_gives_the_same_bytes(file_format: str, tmp_path: Path) -> None:
    for name in ("a", "b"):
        generate(11, tmp_path / name, plant="vo2", **(SMALL | {"file_format": file_format, "kind": "null"}))
    files = sorted(p.name for p in (tmp_path / "a").iterdir())
    assert len(files) == 5
    for name in files:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name


MANIFEST_KEYS = {
    "signal": {"role", "unit", "hold", "column"},
    "record": {"file", "sample_rate_hz", "time", "ignore_first", "use", "repeat", "conditions"},
}


def test_manifests_hold_only_the_keys_of_the_formats(tmp_path: Path) -> None:
    for seed in range(5):
        folder = tmp_path / str(seed)
        truth: Vo2Truth = generate(seed, folder, plant="vo2", kind="null", **SMALL)
        manifest = tomllib.loads((folder / "dataset.toml").read_text(encoding="utf-8"))
        assert set(manifest) == {"dataset", "signals", "records"}
        assert manifest["dataset"] == {"name": f"case {seed}", "plant": "vo2"}
        assert {name: signal["unit"] for name, signal in manifest["signals"].items()} == {
            "current": "mA",
            "resistance": "ohm",
            "deflection": "um",
        }
        assert manifest["signals"]["current"]["hold"] == "zero"
        assert all(set(signal) <= MANIFEST_KEYS["signal"] for signal in manifest["signals"].values())
        assert all(set(table) <= MANIFEST_KEYS["record"] for table in manifest["records"])
        assert [table["use"] for table in manifest["records"]] == [r.use for r in truth.records]
        files = {table["file"] for table in manifest["records"]}
        assert {p.name for p in folder.iterdir()} == files | {"dataset.toml"}
        clean = np.concatenate([r.clean["resistance"] for r in truth.records])
        assert 100.0 < clean.min() < clean.max() < 1e6


def test_deflection_can_be_missing_in_one_record(tmp_path: Path) -> None:
    options = SMALL | {"file_format": "parquet", "missing_deflection": True}
    truth = generate(3, tmp_path, plant="vo2", kind="null", **options)
    columns = [len([c for c in pq.read_schema(tmp_path / r.name).names if c != "t"]) for r in truth.records]
    assert sorted(columns) == [2] + [3] * (len(columns) - 1)
    assert columns[0] == 3
    assert [len(r.measured) + 1 for r in truth.records] == columns


def test_noise_has_the_size_that_the_truth_states(tmp_path: Path) -> None:
    truth = generate(9, tmp_path, plant="vo2", kind="null", noise="white", snr_dB=45.0, **SMALL)
    assert truth.expected_verdict == "adequate"
    for name, noise in truth.noises.items():
        added = np.concatenate([r.measured[name] - r.clean[name] for r in truth.records])
        assert np.std(added) == pytest.approx(noise.rms, rel=0.05)


def test_pairs_act_at_different_places_and_everything_comes_up() -> None:
    drawn = [draw_ids(np.random.default_rng([seed, 0, 2]), Vo2Options()) for seed in range(1500)]
    assert {name for ids in drawn for name in ids} == set(CATALOGUE) | set(OUTSIDE_CATALOGUE)
    pairs = [ids for ids in drawn if len(ids) == 2]
    assert pairs
    assert all(a.split(".")[0] != b.split(".")[0] for a, b in pairs)


def test_generator_imports_nothing_of_the_project() -> None:
    imported = set()
    for path in (Path(generator.__file__).parent / "vo2").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                imported |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                imported.add(str(node.module).split(".")[0])
    allowed = {"__future__", "collections", "dataclasses", "pathlib", "typing"}
    assert imported <= allowed | {"numba", "numpy", "pyarrow", "scipy", "tomli_w"}


def test_wrong_words_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"no effect 'sensor.lagg'"):
        generate(1, tmp_path, plant="vo2", effects=("sensor.lagg",))
    with pytest.raises(TypeError, match="quality"):
        generate(1, tmp_path, plant="vo2", quality=3.0)
