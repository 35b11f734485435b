"""No command writes over a file that it reads, or over one that the same command did not write before."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import rtctl
from rtctl import Record
from rtctl.border.errors import InputError
from rtctl.cli import main

MODEL = """[model]
kind = "oscillator"
[model.parameters]
damping = { value = 5.0, unit = "1/s" }
stiffness = { value = 4000.0, unit = "1/s^2" }
stiffness_cubic = { value = 0.0, unit = "1/(mm^2*s^2)" }
drive_gain = { value = 100.0, unit = "mm/(s^2*V)" }
"""
OF_OTHERS = b"rtctl simulate is what I ran on these; measured on 2026-03-02 by hand\n"
"""A file of somebody who writes about this program."""


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a measured file, its manifest and a model written by hand; the commands run in it."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(1)
    drive = np.repeat(rng.normal(size=200), 5)
    still = Record(
        name="r", period_s=2e-3, use="fit", signals={"drive": drive, "displacement": np.zeros(drive.size)}
    )
    Path("model.toml").write_text(MODEL, encoding="utf-8")
    data = rtctl.write_dataset(
        "made", [still], name="n", plant="oscillator", units={"drive": "V", "displacement": "mm"}
    )
    motion = rtctl.simulate("model.toml", data).records["r"].simulated["displacement"]
    noise = 1e-4 * rng.normal(size=motion.size)
    rows = zip(2e-3 * np.arange(motion.size), drive, motion + noise, strict=True)
    text = "".join(f"{t!r},{u!r},{x!r}\n" for t, u, x in (map(float, row) for row in rows))
    Path("r.csv").write_text("t_s,u_V,x_mm\n" + text, encoding="utf-8")
    assert main(["init", "r.csv", "--yes", "--quiet", "--no-plot", "--hold", "zero", "--test", "none"]) == 0
    return tmp_path


COMMANDS = {
    "simulate's summary": (["simulate", "model.toml", "dataset.toml", "--out", "d"], "d/summary.json"),
    "simulate's record": (["simulate", "model.toml", "dataset.toml", "--out", "d"], "d/r.parquet"),
    "simulate's picture": (["simulate", "model.toml", "dataset.toml", "--out", "d"], "d/worst.png"),
    "identify": (["identify", "dataset.toml", "--out", "raw.h5"], "raw.h5"),
    "identify's picture": (["identify", "dataset.toml", "--out", "beam.toml"], "beam.png"),
    "diagnose's model": (["diagnose", "dataset.toml", "--out", "d"], "d/model.toml"),
    "diagnose's page": (
        ["diagnose", "dataset.toml", "--model", "model.toml", "--out", "d"], "d/report.html",
    ),
    "preview": (["preview", "dataset.toml", "--out", "photo.png"], "photo.png"),
    "init": (["init", "r.csv", "--yes", "--out", "d"], "d/dataset.toml"),
    "doubt": (["doubt", "d", "--out", "notes.json"], "notes.json"),
    "export mcap": (["export", "mcap", "d", "--out", "run.mcap"], "run.mcap"),
    "export fmu": (["export", "fmu", "--model", "model.toml", "--out", "m.fmu"], "m.fmu"),
    "export c": (["export", "c", "--scenario", "steps", "--model", "model.toml", "--out", "d"], "d/rtctl.c"),
    "firmware": (["firmware", "--out", "d"], "d/Makefile"),
    "sweep": (["sweep", "basins_beam", "--out", "d"], "d/summary.json"),
    "sweep's plan": (["sweep", "basins_beam", "--out", "d"], "d/campaign.json"),
    "reproduce": (["reproduce", "vo2", "--short", "--out", "d"], "d/report.html"),
    "reproduce's picture": (["reproduce", "vo2", "--short", "--out", "d"], "d/pictures/rate-term.png"),
    "latency": (["latency", "--out", "d"], "d/latency.json"),
    "acquire": (["acquire", "acquire_oscillator", "--out", "d"], "d/r00-random_multisine.parquet"),
    "run": (["run", "me_amplitude", "--out", "d"], "d/summary.json"),
    "run's recording": (["run", "me_amplitude", "--out", "d"], "d/timing.parquet"),
    "run's model": (["run", "me_amplitude", "--out", "d"], "d/model.toml"),
    "demo": (["demo", "--out", "d"], "d/model.toml"),
    "serve's journal": (["serve", "beam_hm", "--modbus-tcp", "127.0.0.1:0", "--journal", "j.csv"], "j.csv"),
    "serve's account": (
        ["serve", "beam_hm", "--modbus-tcp", "127.0.0.1:0", "--record", "d"], "d/signals.parquet",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("command", "name"), COMMANDS.values(), ids=COMMANDS)
def test_a_file_of_another_origin_stays(
    place: Path, capsys: pytest.CaptureFixture[str], command: Sequence[str], name: str
) -> None:
    file = place / name
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(OF_OTHERS)
    capsys.readouterr()
    assert main(command) == 2
    assert file.read_bytes() == OF_OTHERS
    said = capsys.readouterr().err
    assert name in said or "is not empty" in said
    assert "choose" in said


READ = {
    "simulate's record": (["simulate", "model.toml", "s/dataset.toml", "--out", "s"], "s/r.parquet"),
    "identify's manifest": (["identify", "dataset.toml", "--out", "dataset.toml"], "dataset.toml"),
    "identify's start": (["identify", "dataset.toml", "--model", "i.toml", "--out", "i.toml"], "i.toml"),
    "identify's start by a link": (
        ["identify", "dataset.toml", "--model", "l.toml", "--out", "i.toml"], "i.toml",
    ),
    "preview's manifest": (["preview", "dataset.toml", "--out", "dataset.toml"], "dataset.toml"),
}  # fmt: skip


@pytest.mark.parametrize(("command", "name"), READ.values(), ids=READ)
def test_a_file_that_is_read_stays_also_where_the_same_command_made_it(
    place: Path, capsys: pytest.CaptureFixture[str], command: Sequence[str], name: str
) -> None:
    assert main(["simulate", "model.toml", "dataset.toml", "--out", "s", "--quiet", "--no-plot"]) == 0
    assert main(["identify", "dataset.toml", "--out", "i.toml", "--quiet", "--no-plot"]) == 0
    Path("l.toml").symlink_to("i.toml")
    manifest = Path("dataset.toml").read_text(encoding="utf-8").replace("r.csv", "r.parquet")
    manifest = manifest.replace("t_s", "time").replace("u_V", "drive").replace("x_mm", "measured")
    Path("s/dataset.toml").write_text(manifest, encoding="utf-8")
    before = (place / name).read_bytes()
    capsys.readouterr()
    assert main(command) == 2
    assert (place / name).read_bytes() == before
    assert f"{name}: is " in capsys.readouterr().err


def test_what_a_command_wrote_before_is_replaced(place: Path) -> None:
    commands = [
        ["simulate", "model.toml", "dataset.toml", "--out", "s"],
        ["identify", "dataset.toml", "--out", "i.toml"],
        ["preview", "dataset.toml", "--out", "p.png"],
        ["diagnose", "dataset.toml", "--model", "i.toml", "--out", "d", "--work", "1"],
        ["run", "me_amplitude", "--out", "o", "--set", "scenario.duration=0.2 s"],
        ["export", "mcap", "o", "--out", "o.mcap"],
        ["export", "fmu", "--model", "i.toml", "--out", "m.fmu", "--sources-only"],
    ]
    for command in commands:
        for _ in range(2):
            assert main([*command, "--quiet"]) == 0 or command[0] == "run", (
                command
            )  # too short for its checks
    assert Path("o/before-1/signals.parquet").is_file()
    Path("empty.png").touch()  # as mktemp leaves one
    assert main(["preview", "dataset.toml", "--out", "empty.png", "--quiet"]) == 0


def test_a_command_does_not_replace_what_another_one_wrote(place: Path) -> None:
    assert main(["simulate", "model.toml", "dataset.toml", "--out", "d", "--quiet", "--no-plot"]) == 0
    summary = Path("d/summary.json").read_bytes()
    assert main(["run", "me_amplitude", "--out", "d", "--quiet"]) == 2
    assert main(["identify", "dataset.toml", "--out", "d/r.parquet", "--quiet"]) == 2
    assert Path("d/summary.json").read_bytes() == summary


def test_python_functions_leave_files_of_another_origin(place: Path) -> None:
    data, model = rtctl.read_dataset("dataset.toml"), rtctl.read_model("model.toml")
    comparison, fit = rtctl.simulate(model, data), rtctl.identify(data)
    file = place / "x" / "f"
    writers = {
        "summary.json": lambda: comparison.save(file.parent),
        "m.toml": lambda: fit.save(file.parent / "m.toml"),
        "n.toml": lambda: model.save(file.parent / "n.toml"),
        "p.png": lambda: rtctl.preview(data).save(file.parent / "p.png"),
        "m.mat": lambda: rtctl.save_mat(model, file.parent / "m.mat"),
        "m.fmu": lambda: rtctl.export_fmu(model, file.parent / "m.fmu", sources_only=True),
        "r.parquet": lambda: rtctl.write_dataset(
            file.parent, data.records, name="n", plant="oscillator", units=data.units
        ),
    }
    for name, write in writers.items():
        target = file.parent / name
        target.parent.mkdir(exist_ok=True)
        target.write_bytes(OF_OTHERS)
        with pytest.raises(InputError, match="not written over"):
            write()
        assert target.read_bytes() == OF_OTHERS
        target.unlink()
        write()
        write()
