"""A campaign's result is the same however it was computed: in one process or several, at once or after a kill."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pyarrow.dataset as ds
import pytest
from campaign_cases import SMALL, campaign

from rtctl.cli import main


def parts(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted((folder / "parts").glob("*.parquet"))}


def test_one_process_and_two_give_the_same_bytes_and_a_table_with_units(tmp_path: Path) -> None:
    file = campaign(tmp_path)
    for workers in (1, 2):
        out = tmp_path / str(workers)
        assert main(["sweep", str(file), "--out", str(out), "--workers", str(workers), "--quiet"]) == 0
    assert parts(tmp_path / "1") == parts(tmp_path / "2")
    assert len(parts(tmp_path / "1")) == 6
    table = ds.dataset(tmp_path / "1" / "parts", format="parquet").to_table()
    assert table.column("trajectory").to_pylist() == list(range(84))
    assert table.schema.field("velocity").metadata == {b"unit": b"mm/s"}
    assert set(table.column("displacement").to_pylist()) == {-12.0, -7.0, 3.0, 7.0}
    assert set(table.column("kind").to_pylist()) >= {"intrawell", "interwell", "chaotic"}
    summary = json.loads((tmp_path / "1" / "summary.json").read_text())
    assert sum(summary["kind"].values()) == summary["trajectories"] == 84


def sweep_words(file: Path, out: Path, *, workers: int) -> list[str]:
    """Words after `rtctl`."""
    return ["sweep", str(file), "--out", str(out), "--workers", str(workers), "--quiet"]


def in_session(session: int) -> list[int]:
    """Processes that a command has started, itself among them."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):  # ended meanwhile
            state, _, _, own = stat.read_text().rpartition(")")[2].split()[:4]
            found += [int(stat.parent.name)] if int(own) == session and state != "Z" else []
    return found


def test_worker_processes_end_with_a_campaign_that_is_killed(tmp_path: Path) -> None:
    file, out = campaign(tmp_path, SMALL.replace("part = 16", "part = 1")), tmp_path / "out"
    command = [sys.executable, "-m", "rtctl", *sweep_words(file, out, workers=2)]
    with subprocess.Popen(command, start_new_session=True) as running:
        while not list(out.glob("parts/*.parquet")) and running.poll() is None:
            time.sleep(0.002)
        assert len(in_session(running.pid)) >= 4, "the command, its fork server and two workers"
        running.send_signal(signal.SIGKILL)
    end = time.monotonic() + 20.0
    while left := in_session(running.pid):
        assert time.monotonic() < end, f"{len(left)} processes outlive the command"
        time.sleep(0.02)


def test_a_campaign_that_was_killed_goes_on_where_it_was(tmp_path: Path) -> None:
    file = campaign(tmp_path)
    out, whole = tmp_path / "out", tmp_path / "whole"
    assert main(["sweep", str(file), "--out", str(whole), "--workers", "1", "--quiet"]) == 0
    command = [sys.executable, "-m", "rtctl", *sweep_words(file, out, workers=1)]
    with subprocess.Popen(command) as running:
        while not list(out.glob("parts/*.parquet")) and running.poll() is None:
            time.sleep(0.002)
        running.send_signal(signal.SIGKILL)
    before = parts(out)
    assert 0 < len(before) < 6, "it must have been killed half way"
    assert main(["sweep", str(file), "--out", str(out), "--workers", "1", "--quiet"]) == 0
    assert parts(out) == parts(whole)
    found = json.loads((out / "summary.json").read_text())["parts"]
    assert found == {"all": 6, "computed": 6 - len(before), "found": len(before)}


def test_another_campaign_is_not_mixed_into_a_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = SMALL.replace("count = 7", "count = 1")
    out = str(tmp_path / "out")
    assert main(["sweep", str(campaign(tmp_path, text)), "--out", out, "--workers", "1", "--quiet"]) == 0
    other = campaign(tmp_path, text.replace("3.81", "3.8"))
    assert main(["sweep", str(other), "--out", out, "--quiet"]) == 2
    assert "holds the results of another campaign" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("amplitude =", "amplitud =", 'unknown key "drive.amplitud"; did you mean "amplitude"?'),
        ("[factors.velocity]", "[factors.velocty]", 'unknown factor "velocty"; did you mean "velocity"?'),
        ('"3.81 m/s^2"', '"3.81 m"', 'key "drive.amplitude": unit "m" is not compatible with m/s^2'),
        ('"8 Hz"', '"8"', 'key "factors.frequency.low": \'8\' has no unit; write "8 Hz"'),
        ('"8 Hz"', '"0 Hz"', 'key "factors.frequency": a frequency must be above 0 Hz'),
        ('"8 Hz"', '"20 Hz"', "20 must be below high = 14 Hz"),
        ("count = 7", "", 'key "factors.frequency.count" is missing'),
        ('"beam_hm"', '"beam_hn"', 'no bundled plant "beam_hn"; did you mean "beam_hm"?'),
        ('"kind", "att', '"kin", "att', 'unknown value "kin"; did you mean "kind"?'),
        ('kind = "grid"', 'kind = "random"', 'a random design needs "samples"'),
        ('"3.81 m/s^2"\n', '"3.81 m/s^2"\nfrequency = "9 Hz"\n', 'key "drive.frequency" is a factor as well'),
        ('most = "40 s"', 'most = "10 s"', "most = 10 s must not be below look = 20 s"),
        ('amplitude = "3.81 m/s^2"', "", 'key "drive.amplitude" is missing'),
        ("[design]", '[picture]\nkind = "basins"\nx = "frequncy"\ny = "velocity"\nshow = "kind"\n[design]',
         'key "picture.x": "frequncy" is no factor; did you mean "frequency"?'),
    ],
)  # fmt: skip
def test_bad_input_names_file_key_and_the_nearest_valid_key(
    old: str, new: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert old in SMALL
    file = campaign(tmp_path, SMALL.replace(old, new, 1))
    assert main(["sweep", str(file), "--out", str(tmp_path / "out")]) == 2
    message = capsys.readouterr().err
    assert words in message
    assert message.count("\n") == 1
    assert "no bundled" in message or str(file) in message
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["basins_beam", "bifurcation_beam", "hypercube_beam"])
def test_bundled_campaigns_are_read_and_have_parts_enough_for_many_cores(name: str) -> None:
    from rtctl.campaign.file import find_campaign
    from rtctl.campaign.plan import read_plan

    plan = read_plan(find_campaign(name))
    assert plan.parts >= 8
    assert plan.steps_per_period % 32 == 0


def test_an_address_that_is_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = campaign(tmp_path)
    assert main(["sweep", str(file), "--out", str(tmp_path / "o"), "--scheduler", "127.0.0.1:1"]) == 2
    assert "an address such as tcp://HOST:8786 is needed" in capsys.readouterr().err
