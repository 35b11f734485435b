"""Policies of `rtctl doubt` at work while the wire, the device and the host have faults: is every level still safe?

    python benchmarks/policy_faults.py --model model.toml [--kinds drop,stall] [--policies derate,stop] [--turns 1]

A served device with a journal, a faulty line, a closed loop that is armed again after each fault; at a random moment a
policy acts as upon a finding of the watch (`retune`: another model takes over, then the first one again). Safe means,
by the device's journal alone: a level at the plant is off, the device's own safe one or inside the limits, and is held
no longer than its lease. Exit 1: a level that is not, a fault without a name, or a policy that did something else.
"""

from __future__ import annotations

import argparse
import json
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from fault_campaign import KINDS, NOT_OF_TCP
from fault_cells import PERIOD_S, TIMEOUT_S, WATCHDOG_S, unsafe_entries

from plant_sim.journal import read_journal
from rtctl.border.errors import RtctlError
from rtctl.border.model_file import Value
from rtctl.doubt.policy import OnceActing, Policy
from rtctl.doubt.watch import Finding
from rtctl.models.vo2 import read_model, write_model
from rtctl.session.live import control_socket

LONGEST_S = 120.0
SHORT, LONG = '"6 s"', '"60 s"'
"""Durations of a run: a model may be refused again and again while a busy machine misses deadlines."""
LOW_MA, HIGH_MA = 3.68, 8.49
SCENARIO = f"""
[scenario]
title = "a policy under faults"
period = {{ value = {PERIOD_S}, unit = "s" }}
duration = {SHORT}
any_device = true
[clock]
mode = "live"
settle = "40 ms"
timeout = {{ value = {TIMEOUT_S}, unit = "s" }}
watchdog = {{ value = {WATCHDOG_S}, unit = "s" }}
[safety]
rearm = 100
rearm_after = "100 ms"
[reference]
kind = "multisine"
offset = "30 um"
sines = [{{ amplitude = "6 um", frequency = "1 Hz" }}]
[controller]
kind = "pi"
feedforward = "inverse"
"""


def main() -> int:
    """Run all cases, a line each."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--model", type=Path, required=True)
    parser.add_argument("--kinds", default=",".join(KINDS))
    parser.add_argument("--policies", default="derate,stop,retune")
    parser.add_argument("--turns", type=int, default=1)
    arguments = parser.parse_args()
    bad = cases = faults = acted = 0
    for turn in range(arguments.turns):
        for kind in arguments.kinds.split(","):
            for policy in arguments.policies.split(","):
                with tempfile.TemporaryDirectory() as folder:
                    found = case(kind, policy, arguments.model, Path(folder), turn)
                print(json.dumps(found), flush=True)
                bad += len(found["unsafe"]) + len(found["wrong"])
                cases, faults, acted = cases + 1, faults + found["injected"], acted + bool(found["done"])
    print(f"{cases} runs, {faults} injected faults, a policy acted in {acted}; unsafe or wrong: {bad}")
    return 1 if bad else 0


def case(kind: str, policy: str, model: Path, folder: Path, turn: int) -> dict[str, Any]:
    """One run with one kind of fault in which a policy acts once."""
    chance = random.Random(f"{kind} {policy} {turn}")
    wire = "serial" if kind in NOT_OF_TCP or turn % 2 else "modbus-tcp"
    out = folder / "run"
    with device(wire, folder) as (pid, where, journal):
        file = folder / "scenario.toml"
        scenario = SCENARIO.replace(SHORT, LONG) if policy == "retune" else SCENARIO
        file.write_text(scenario + driver(wire, where, kind, pid, chance.randrange(1000)), encoding="utf-8")
        command = [
            sys.executable,
            "-m",
            "rtctl",
            "run",
            str(file),
            "--model",
            str(model),
            "--out",
            str(out),
            "--quiet",
        ]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
            done = act_in(out, policy, model, process, chance)
            _, said = process.communicate(timeout=LONGEST_S)
        time.sleep(2.0 * WATCHDOG_S)
    entries = read_journal(journal)
    sent = {entry.values[0] for entry in entries if entry.event == "command"}
    wrong = [] if (out / "summary.json").is_file() or "rtctl run:" in said else [f"no summary: {said}"]
    noted = out / "events.jsonl"  # none where the first opening failed
    events = [json.loads(line) for line in noted.read_text("utf-8").splitlines()] if noted.is_file() else []
    wrong += [
        f"a fault without a word: {one}" for one in events if one["event"] == "fault" and not one["message"]
    ]
    if policy == "stop" and done and not any(one.get("fault") == "interrupted" for one in events):
        wrong.append("asked to stop, it went on")
    return {
        "kind": kind, "policy": policy, "wire": wire, "done": done,
        "injected": sum(one.get("count", 1) for one in events if one["event"] == "injected"),
        "faults": [one["fault"] for one in events if one["event"] == "fault"],
        "said": said.strip(), "models": [one["number"] for one in events if one["event"] == "model"],
        "unsafe": unsafe_entries(entries, sent, LOW_MA, HIGH_MA), "wrong": wrong,
    }  # fmt: skip


def driver(wire: str, where: str, kind: str, device_pid: int, seed: int) -> str:
    """The tables of the line."""
    key = "address" if wire == "modbus-tcp" else "port"
    duration_s = KINDS[kind][1]
    return (
        f'[driver]\nkind = "{wire}"\n{key} = "{where}"\nfaults_seed = {seed}\ndevice_pid = {device_pid}\n'
        f'[[driver.faults]]\nkind = "{kind}"\nrate = 0.01\n'
        + (f'duration = "{duration_s} s"\n' if duration_s else "")
    )


def act_in(out: Path, policy: str, model: Path, process: subprocess.Popen[str], chance: random.Random) -> str:
    """Let a policy act in a run at a random moment after its begin; return what it did, "": the run was over."""
    while process.poll() is None and not (out / "events.jsonl").is_file():
        time.sleep(0.05)
    time.sleep(chance.uniform(0.2, 2.0))
    if policy == "retune":
        shifted = {"resistance_offset": Value(value=0.02, unit="dimensionless")}
        write_model(replace(read_model(model), corrections=shifted), out / "retuned-1.toml")
        done = "; ".join(filter(None, (asked(process, out, number) for number in (1, 0))))
        with suppress(RtctlError):
            control_socket.stop(out)
        return done
    acting = OnceActing(
        Policy(policy),
        lambda: control_socket.parameters(out),
        lambda name, value: control_socket.send(out, name, value),
        lambda: control_socket.stop(out),
    )
    while process.poll() is None:
        said = acting.act(Finding("device", 0, 0, ""))
        if "not done" not in said:
            return said
        time.sleep(0.1)
    return ""


def asked(process: subprocess.Popen[str], out: Path, number: int) -> str:
    """Ask for a model until the run takes it or is over; one that was armed again meanwhile refuses it by an event."""
    while process.poll() is None:
        before = len(answers(out))
        try:
            said = control_socket.change_model(out, number)
        except RtctlError:
            time.sleep(0.1)
            continue
        while process.poll() is None and len(answers(out)) == before:
            time.sleep(0.02)
        if (noted := answers(out)[before:]) and noted[0]["event"] == "model":
            return said
    return ""


def answers(out: Path) -> list[dict[str, Any]]:
    """The events by which a run took or refused a model."""
    text = (out / "events.jsonl").read_text("utf-8")
    noted = [
        json.loads(line) for line in text[: text.rfind("\n") + 1].splitlines()
    ]  # the last may be half written
    return [
        one
        for one in noted
        if one["event"] == "model" or (one["event"], one.get("name")) == ("refused", "model")
    ]


@contextmanager
def device(wire: str, folder: Path) -> Iterator[tuple[int, str, Path]]:
    """A served device with a journal: its process, where it is, the journal."""
    journal = folder / "journal.csv"
    where = "127.0.0.1:0" if wire == "modbus-tcp" else str(folder / "device")
    command = [sys.executable, "-m", "rtctl", "serve", "vo2_a", f"--{wire}", where, "--journal", str(journal)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield process.pid, process.stdout.readline().split()[2], journal
        finally:
            process.terminate()


if __name__ == "__main__":
    sys.exit(main())
