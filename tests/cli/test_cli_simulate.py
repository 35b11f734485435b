"""`rtctl simulate` on real files: scores of a free run, predictions, messages; exit codes."""

from __future__ import annotations

import json
import threading
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.integrate import odeint

from rtctl.border.errors import InputError
from rtctl.cli import main
from rtctl.session.validation.model_validation import _on_all_cores

RATE_HZ = 500.0
SAMPLES = 1500
DAMPING, STIFFNESS, CUBIC, GAIN = 8.0, 9.0e3, 4.0e3, 300.0
MODEL = f"""
[model]
kind = "oscillator"
[model.parameters]
damping = {{ value = {DAMPING}, unit = "1/s" }}
stiffness = {{ value = {STIFFNESS}, unit = "1/s^2" }}
stiffness_cubic = {{ value = {CUBIC}, unit = "1/(mm^2*s^2)" }}
drive_gain = {{ value = {GAIN}, unit = "mm/s^2/V" }}
"""
SIGNALS = """
[dataset]
name = "bench"
plant = "oscillator"
[signals.drive]
role = "input"
unit = "V"
[signals.displacement]
role = "output"
unit = "mm"
"""


def duffing(drive: np.ndarray) -> np.ndarray:
    """Displacement [mm] of the model above from rest under a drive [V] that is linear between samples."""
    time_s = np.arange(len(drive)) / RATE_HZ

    def rate(t: float, y: np.ndarray) -> list[float]:
        u = float(np.interp(t, time_s, drive))
        return [y[1], GAIN * u - DAMPING * y[1] - STIFFNESS * y[0] - CUBIC * y[0] ** 3]

    moved = odeint(rate, [0.0, 0.0], time_s, tfirst=True, rtol=1e-10, atol=1e-13, hmax=1 / RATE_HZ)
    return np.asarray(moved[:, 0])


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with model.toml and a dataset of two repeats of one input (noise 0.01 mm) and a clean test record."""
    folder = tmp_path_factory.mktemp("bench")
    rng = np.random.default_rng(3)
    first, second = (np.convolve(rng.standard_normal(SAMPLES), np.ones(8) / 8, "same") * 30 for _ in range(2))
    for name, drive, noise in (("a", first, 0.01), ("b", first, 0.01), ("c", second, 0.0)):
        z = duffing(drive) + noise * rng.standard_normal(SAMPLES)
        rows = np.column_stack([drive, z])
        np.savetxt(
            folder / f"{name}.csv", rows, delimiter=",", header="drive,displacement", comments="", fmt="%.12g"
        )
    records = "".join(
        f'[[records]]\nfile = "{name}.csv"\nsample_rate_hz = {RATE_HZ}\n{more}\n'
        for name, more in (
            ("a", 'repeat = "A"\nignore_first = 100'),
            ("b", 'repeat = "A"\nignore_first = 100'),
            ("c", 'use = "test"'),
        )
    )
    (folder / "dataset.toml").write_text(SIGNALS + records)
    (folder / "model.toml").write_text(MODEL)
    return folder


def simulate(model: Path, dataset: Path, out: Path, *more: str) -> int:
    return main(["simulate", str(model), str(dataset), "--out", str(out), "--quiet", *more])


def edited(source: Path, target: Path, old: str, new: str) -> Path:
    text = source.read_text()
    assert old in text
    target.write_text(text.replace(old, new))
    return target


OFFSET = """
[[model.mechanisms]]
id = "sensor.offset"
parameters = { offset = { value = 0.3, unit = "mm" } }
[[model.mechanisms]]
id = "sensor.saturation"
parameters = { curvature = { value = 0.2, unit = "1/mm^2" } }
"""


@pytest.mark.slow
def test_a_motion_begins_where_the_models_sensor_reads_the_first_sample(bench: Path, tmp_path: Path) -> None:
    z = duffing(np.loadtxt(bench / "c.csv", delimiter=",", skiprows=1)[:, 0])
    root = np.sqrt(0.2)
    rows = np.column_stack(
        [np.loadtxt(bench / "c.csv", delimiter=",", skiprows=1)[:, 0], np.tanh(root * z) / root + 0.3]
    )
    np.savetxt(tmp_path / "c.csv", rows, delimiter=",", header="drive,displacement", comments="", fmt="%.12g")
    record = f'[[records]]\nfile = "c.csv"\nsample_rate_hz = {RATE_HZ}\n'
    (tmp_path / "dataset.toml").write_text(SIGNALS + record)
    (tmp_path / "model.toml").write_text(MODEL + OFFSET)
    assert simulate(tmp_path / "model.toml", tmp_path / "dataset.toml", tmp_path / "out") == 0
    [row] = json.loads((tmp_path / "out" / "summary.json").read_text())["records"]
    assert row["outputs"]["displacement"]["rms_error"] < 3e-5  # SciPy's; begun at the reading it is 0.31


def test_a_true_model_leaves_only_the_noise(bench: Path, tmp_path: Path) -> None:
    assert simulate(bench / "model.toml", bench / "dataset.toml", tmp_path) == 0
    rows = json.loads((tmp_path / "summary.json").read_text())["records"]
    assert [(row["file"], row["use"]) for row in rows] == [
        ("a.csv", "fit"),
        ("b.csv", "fit"),
        ("c.csv", "test"),
    ]
    scores = [row["outputs"]["displacement"] for row in rows]
    assert {score["unit"] for score in scores} == {"mm"}
    assert scores[0]["rms_error"] == pytest.approx(
        0.01, rel=0.08
    )  # 5 standard errors of an RMS of 1400 samples
    assert scores[2]["rms_error"] < 1e-5  # SciPy's, between its steps; the signal is 1 mm
    assert scores[0]["noise_floor"] == pytest.approx(0.01, rel=0.08)
    assert scores[2]["noise_floor"] is None
    assert scores[0]["nrmse"] == pytest.approx(scores[0]["rms_error"] / scores[0]["rms_signal"])
    assert scores[0]["integrator_error"] < 1e-4
    assert (tmp_path / "worst.png").stat().st_size > 50_000


def test_the_table_of_a_record_holds_what_was_scored_with_its_units(bench: Path, tmp_path: Path) -> None:
    assert simulate(bench / "model.toml", bench / "dataset.toml", tmp_path, "--no-plot") == 0
    assert not (tmp_path / "worst.png").exists()
    table = pq.read_table(tmp_path / "a.parquet")
    units = {field.name: field.metadata[b"unit"].decode() for field in table.schema}
    assert units == {"time": "s", "drive": "V", "measured": "mm", "simulated": "mm", "error": "mm"}
    column = {name: table[name].to_numpy() for name in table.column_names}
    assert np.array_equal(column["error"], column["simulated"] - column["measured"])
    assert column["time"][1] == pytest.approx(1.0 / RATE_HZ)
    score = json.loads((tmp_path / "summary.json").read_text())["records"][0]["outputs"]["displacement"]
    assert score["rms_error"] == pytest.approx(float(np.sqrt(np.mean(column["error"][100:] ** 2))), rel=1e-12)
    assert score["max_signal"] == pytest.approx(float(np.abs(column["measured"][100:]).max()), rel=1e-12)


def test_json_prints_the_summary(bench: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["simulate", str(bench / "model.toml"), str(bench / "dataset.toml"), "--out", str(tmp_path)]
    assert main([*arguments, "--json", "--no-plot"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads((tmp_path / "summary.json").read_text())


def test_a_divergence_has_its_record_and_time_and_the_summary_is_written(
    bench: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = edited(bench / "model.toml", tmp_path / "falls.toml", f"value = {CUBIC}", f"value = -{CUBIC}e1")
    assert simulate(model, bench / "dataset.toml", tmp_path / "out") == 1
    message = capsys.readouterr().err
    assert "record a diverged" in message
    assert "s after its first sample" in message
    rows = json.loads((tmp_path / "out" / "summary.json").read_text())["records"]
    assert rows[0]["outputs"]["displacement"]["rms_error"] is None
    assert 0.0 < rows[0]["diverged_at_s"] < SAMPLES / RATE_HZ
    assert (tmp_path / "out" / "worst.png").is_file()


def test_a_run_away_of_a_hundred_decades_is_drawn_as_far_as_it_means_anything(
    bench: Path, tmp_path: Path
) -> None:
    text = (bench / "model.toml").read_text()
    text = text.replace("stiffness = { value = ", "stiffness = { value = -9").replace(
        f"value = {CUBIC}", "value = 0.0"
    )
    (tmp_path / "runs.toml").write_text(text)
    assert simulate(tmp_path / "runs.toml", bench / "dataset.toml", tmp_path / "out") == 1
    assert (tmp_path / "out" / "worst.png").is_file()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"mm/s^2/V"', '"mm/s^2/N"', ["model.parameters.drive_gain", "not compatible", "drive in V"]),
        ('kind = "oscillator"', 'kind = "vo2"', ['is a model of a "vo2"', 'holds data of an "oscillator"']),
        ('kind = "oscillator"', 'kind = "osclator"', ['model.kind', "'osclator'", "oscillator"]),
        ("damping =", "dampin =", ["model.parameters.dampin", 'did you mean "damping"?']),
        ("[model.parameters]", '[[model.mechanisms]]\nid = "friction.colomb"\n[model.parameters]',
         ['"friction.colomb"', "is no mechanism of an oscillator"]),
        ("9000.0", "9e30", ["record a", "check the units of its parameters"]),
    ],
)  # fmt: skip
def test_bad_models_are_named(
    old: str, new: str, words: list[str], bench: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = edited(bench / "model.toml", tmp_path / "bad.toml", old, new)
    assert simulate(model, bench / "dataset.toml", tmp_path / "out") == 2
    message = "".join(
        capsys.readouterr().err.split()
    )  # a long path moves where a line is broken, even within a word
    assert [word for word in ["bad.toml", *words] if "".join(word.split()) not in message] == []
    assert not (tmp_path / "out" / "summary.json").exists()


def test_data_of_another_plant_and_missing_files_are_named(
    bench: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    film = tmp_path / "film.toml"
    film.write_text(
        '[dataset]\nname = "x"\nplant = "vo2"\n[signals.current]\nrole = "input"\nunit = "mA"\n'
        '[signals.resistance]\nrole = "output"\nunit = "ohm"\n[[records]]\nfile = "f.csv"\nsample_rate_hz = 1000.0\n'
    )
    (tmp_path / "f.csv").write_text("current,resistance\n1,2\n1,2\n1,2\n")
    assert simulate(bench / "model.toml", film, tmp_path / "out") == 2
    assert 'a model of an "oscillator"' in capsys.readouterr().err
    assert simulate(bench / "none.toml", bench / "dataset.toml", tmp_path / "out") == 2
    assert "none.toml: no such file" in capsys.readouterr().err
    assert simulate(bench / "model.toml", bench / "none.toml", tmp_path / "out") == 2
    assert "none.toml: no such file" in capsys.readouterr().err


def test_a_stop_leaves_no_summary(bench: Path, tmp_path: Path) -> None:
    from rtctl.measured import open_dataset
    from rtctl.session.validation.model_validation import compare_dataset, simulation_for

    dataset = open_dataset(bench / "dataset.toml")
    simulation = simulation_for(bench / "model.toml", dataset)
    done: list[int] = []
    with pytest.raises(KeyboardInterrupt):
        compare_dataset(simulation, dataset, tmp_path, lambda: True, done.append, source="model.toml")
    assert not (tmp_path / "summary.json").exists()


def test_the_first_record_that_fails_is_named_whichever_core_comes_first() -> None:
    later_has_failed = threading.Event()

    def work(k: int) -> dict[str, int]:
        if k == 0:
            later_has_failed.wait(5.0)
            threading.Event().wait(0.3)  # for the other's future to be seen
        later_has_failed.set()
        raise InputError(f"record {k}")

    for _ in range(3):
        with pytest.raises(InputError, match="record 0"):
            _on_all_cores(work, 3, lambda: False, lambda _: None)
        later_has_failed.clear()
