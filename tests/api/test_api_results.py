"""What the Python interface returns: values with units, one line as text, short tables, figures, files."""

from __future__ import annotations

import json
import re
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from api_cases import NOISE_MM, write_bench
from matplotlib.figure import Figure

import rtctl


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model without the fifth-order spring that the device has, and the device's data <& more>."""
    return write_bench(tmp_path_factory.mktemp("bench"))


def shown(value: object) -> str:
    """The HTML of a result, after the checks that hold for all of them."""
    text = repr(value)
    assert "\n" not in text
    assert len(text) < 300
    html = value._repr_html_()  # type: ignore[attr-defined]
    for tag in ("table", "p", "tr", "td", "th"):
        assert len(re.findall(rf"<{tag}>", html)) == len(re.findall(rf"</{tag}>", html))
    assert "<&" not in html
    return str(html)


def test_a_dataset_and_a_model_say_what_they_hold_in_which_unit(bench: Path) -> None:
    dataset = rtctl.read_dataset(str(bench / "dataset.toml"))
    assert dataset.units == {"drive": "V", "displacement": "mm"}
    html = shown(dataset)
    assert "bench &lt;&amp; more&gt;" in html
    assert "displacement [mm]" in html
    assert "<td>500 Hz</td>" in html
    assert "2000 samples at 500 Hz" in repr(dataset.records[0])
    model = rtctl.read_model(bench / "device.toml")
    assert model.parameters["damping"].value == 8.0
    assert model.units["stiffness.quintic.coefficient"] == "1/(mm^4*s^2)"
    assert model.mechanisms == ("stiffness.quintic",)
    assert "1/(mm^4*s^2)" in shown(model)


def test_a_model_that_is_saved_is_the_same_when_it_is_read(bench: Path, tmp_path: Path) -> None:
    model = rtctl.read_model(bench / "device.toml")
    again = rtctl.read_model(model.save(tmp_path / "new" / "copy.toml"))
    assert again.parameters == model.parameters
    assert again.content == model.content


def test_identify_takes_the_kind_from_the_data_and_gives_errors_with_units(
    bench: Path, tmp_path: Path
) -> None:
    heard: list[tuple[str, float | None]] = []
    dataset = rtctl.read_dataset(bench / "dataset.toml")
    fit = rtctl.identify(
        dataset,
        model=bench / "device.toml",
        starts=2,
        progress=lambda text, share: heard.append((text, share)),
    )
    assert fit.trusted
    for name, truth in (("damping", 8.0), ("stiffness", 9000.0)):
        found = fit.parameters[name]
        assert found.standard_error is not None
        assert abs(found.value - truth) < 5.0 * found.standard_error
    assert fit.units["displacement"] == "mm"
    assert fit.residual_rms["displacement"] == pytest.approx(NOISE_MM, rel=0.1)
    assert "displacement: residual 0.00" in shown(fit)
    assert heard
    shares = [share for _, share in heard if share is not None]
    assert 0.0 <= min(shares) <= max(shares) <= 1.0
    saved = fit.save(tmp_path / "fit.toml", plot=True)
    assert saved.model.source == tmp_path / "fit.toml"
    assert (tmp_path / "fit.png").stat().st_size > 20_000
    assert isinstance(fit.plot(), Figure)
    assert fit.to_dict()["trusted"] is True


def test_simulate_gives_arrays_and_scores_and_a_figure_of_any_record(bench: Path, tmp_path: Path) -> None:
    comparison = rtctl.simulate(bench / "model.toml", bench / "dataset.toml")
    assert set(comparison.records) == {"r1", "r2", "r3"}
    score = next(one for one in comparison.scores if one.record == "r2")
    compared = comparison.records["r2"]
    error = compared.simulated["displacement"] - compared.record.signals["displacement"]
    assert score.rms_error == pytest.approx(float(np.sqrt(np.mean(error**2))))
    assert score.unit == comparison.units["displacement"] == "mm"
    assert not comparison.diverged
    assert "mm" in shown(comparison)
    assert comparison.plot("r2")._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]
    with pytest.raises(rtctl.InputError, match=r'no record "r22".*did you mean "r2"'):
        comparison.plot("r22")
    with pytest.raises(rtctl.InputError, match=r'no output "displacment".*did you mean'):
        comparison.plot("r2", "displacment")
    comparison.save(tmp_path / "out")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["worst"] == comparison.worst
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "summary.json", "worst.png", "r1.parquet", "r2.parquet", "r3.parquet",
    }  # fmt: skip


def test_simulate_takes_objects_and_gives_the_same_as_from_files(bench: Path) -> None:
    model, dataset = rtctl.read_model(bench / "model.toml"), rtctl.read_dataset(bench / "dataset.toml")
    objects = rtctl.simulate(model, dataset)
    files = rtctl.simulate(bench / "model.toml", bench / "dataset.toml")
    assert objects.scores == files.scores


def test_diagnose_names_the_hidden_spring_and_its_model_explains_the_data(
    bench: Path, tmp_path: Path
) -> None:
    few = ["stiffness.quintic", "friction.coulomb"]
    diagnosis = rtctl.diagnose(bench / "dataset.toml", bench / "model.toml", mechanisms=few)
    assert diagnosis.verdict == "explained"
    (cause,) = diagnosis.causes
    assert cause.id == "stiffness.quintic"
    assert diagnosis.gain is not None
    assert diagnosis.gain.unit == "mm"
    assert diagnosis.gain.after < 1.2 * NOISE_MM < diagnosis.gain.before
    assert diagnosis.model.mechanisms == ("stiffness.quintic",)
    better = rtctl.simulate(diagnosis.model, bench / "dataset.toml")
    assert max(score.rms_error for score in better.scores) < 1.2 * NOISE_MM
    html = shown(diagnosis)
    assert "stiffness.quintic" in html
    assert "noise" in html
    assert isinstance(diagnosis.plot(), Figure)
    assert {"stretch", "spectrum", "plane"} <= diagnosis.figures().keys()
    with pytest.raises(rtctl.InputError, match="did you mean"):
        diagnosis.plot("spectrm")
    folder = diagnosis.save(tmp_path / "answer")
    assert json.loads((folder / "diagnosis.json").read_text()) == diagnosis.to_dict(folder)
    assert rtctl.read_model(folder / "model-extended.toml").mechanisms == ("stiffness.quintic",)


@pytest.fixture
def sigint() -> Iterator[Callable[..., object]]:
    """Python's own handler of Ctrl-C, also where the tests run in the background of a shell, which ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield signal.default_int_handler
    signal.signal(signal.SIGINT, before)


def test_ctrl_c_in_a_diagnosis_gives_what_is_known(bench: Path, sigint: Callable[..., object]) -> None:
    def interrupt(text: str, share: float | None) -> None:
        if "not explain it" in text:
            signal.raise_signal(signal.SIGINT)

    diagnosis = rtctl.diagnose(
        bench / "dataset.toml", bench / "model.toml", mechanisms="damping.quadratic", progress=interrupt
    )
    assert diagnosis.stopped
    assert diagnosis.causes == ()
    assert any("stopped by the user" in warning for warning in diagnosis.warnings)
    assert signal.getsignal(signal.SIGINT) is sigint


def test_a_run_gives_signals_with_units_and_what_its_checks_say(model_file: Path, tmp_path: Path) -> None:
    run = rtctl.run(
        "steps", model=model_file, settings={"scenario.duration": "0.05 s"}, controller={"kind": "pi"}
    )
    assert run.signals["setpoint"].shape == run.time_s.shape == (50,)
    assert run.units["deflection"] == "um"
    assert run.time_s[1] == pytest.approx(1e-3)
    assert run.fault is None
    assert run.passed == (run.summary["verdict"] == "pass")
    assert "gain margin" in (run.tuning or "")
    assert "um" in shown(run)
    assert isinstance(run.plot(), Figure)
    run.save(tmp_path / "run")
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["scenario"] == run.summary["scenario"]


def test_a_run_is_recorded_where_it_is_asked_to_and_replays_to_the_bit(
    model_file: Path, tmp_path: Path
) -> None:
    model = rtctl.read_model(model_file)
    run = rtctl.run("steps", model=model, settings={"scenario.duration": "0.05 s"}, out=tmp_path / "run")
    assert run.folder == tmp_path / "run"
    replayed = rtctl.replay(tmp_path / "run")
    assert replayed.same
    assert replayed.rows == 50
    assert "same to the bit" in repr(replayed)


def test_ctrl_c_in_a_run_gives_what_was_recorded(model_file: Path) -> None:
    def interrupt(text: str, share: float | None) -> None:
        if share is not None:
            signal.raise_signal(signal.SIGINT)

    run = rtctl.run("steps", model=model_file, settings={"scenario.duration": "2 s"}, progress=interrupt)
    assert run.fault is rtctl.Fault.INTERRUPTED
    assert 200 <= len(run.time_s) < 2000


def test_acquire_gives_the_dataset_it_wrote(tmp_path: Path) -> None:
    excitation = {"kind": "levels", "hold": "10 ms", "levels": ["50 %", "60 %"]}
    tables = {"scenario": {"title": "two levels"}, "excitation": [excitation]}
    dataset = rtctl.acquire(tables, tmp_path / "data", driver={"kind": "inprocess", "device": "vo2_b"})
    assert dataset.path == tmp_path / "data" / "dataset.toml"
    assert dataset.identity == "VO2-B"
    assert set(dataset.units) == {"current", "resistance", "deflection"}
