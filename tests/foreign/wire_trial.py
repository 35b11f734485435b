"""The README's path on VO2 actuators of another lab over Modbus TCP, step by step as a user types it.

python tests/foreign/wire_trial.py --seeds 0-2 --effects none,actuation.delay --out DIR

acquire -> identify (both again with longer holds where it asks for them) -> [an effect begins] -> acquire -> run ->
diagnose -> run with the extended model. Each case has its own folder with the log of each step and `case.json`; a trial
that was stopped continues. DIR/table.md and DIR/cases.json have all cases.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from foreign_campaign import judge, to_be_judged
from foreign_wire_table import table

LOOPS = ("steps", "sine_1hz", "multisine_1_10hz")
ATTEMPTS = 3  # to acquire with holds that are long enough
ALSO_TRUE = [
    "timing.skew",
    "actuation.delay",
]  # of a device that reads at the start of the period of its command
LONGEST_S = 1800.0  # of one command
SAID = 4000  # characters of a step's output that are kept


@dataclass(slots=True, kw_only=True)
class Step:
    """One command: what was typed, how it ended, what it said."""

    name: str
    command: str
    exit: int
    seconds: float
    said: str


@dataclass(slots=True, kw_only=True)
class Case:
    """A device with what was hidden in it, and what came of the path."""

    seed: int
    effect: str
    device: dict[str, Any] = field(default_factory=dict)
    steps: list[Step] = field(default_factory=list)
    outcome: str = "failed"  # as `foreign_campaign.judge`
    verdict: str | None = None
    causes: list[dict[str, Any]] = field(default_factory=list)
    extended: bool = False
    rehearsed: dict[str, Any] | None = None
    before: dict[str, float] = field(default_factory=dict)  # mean absolute tracking error of each loop [um]
    after: dict[str, float] = field(default_factory=dict)


class Device:
    """The served device, and the options that lead to it."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process
        _, address, told = self._line().split(" ", 2)
        self.told: dict[str, Any] = json.loads(told)
        self.options = ["--set", "driver.kind=modbus-tcp", "--set", f"driver.address={address}"]

    def begin(self) -> None:
        """Let the hidden effect act from here on."""
        assert self._process.stdin is not None
        self._process.stdin.write("begin\n")
        self._process.stdin.flush()
        self._line()

    def _line(self) -> str:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"the device's server ended with exit code {self._process.wait()}")
        return line


@contextmanager
def served(seed: int, effect: str, begin: str) -> Iterator[Device]:
    """The device in a process of its own."""
    server = Path(__file__).resolve().with_name("foreign_wire_server.py")
    command = [sys.executable, str(server), "--seed", str(seed), "--effect", effect, "--begin", begin]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield Device(process)
        finally:
            process.terminate()


class User:
    """Types commands in the case's folder."""

    def __init__(self, case: Case, folder: Path) -> None:
        self._case, self._folder = case, folder

    def types(self, name: str, *words: str) -> Step:
        """`rtctl WORDS`; the log is kept as NAME.log."""
        begin = time.perf_counter()
        command = [sys.executable, "-m", "rtctl", *words]
        try:
            done = subprocess.run(
                command, cwd=self._folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                text=True, timeout=LONGEST_S, check=False,
            )  # fmt: skip
            code, said = done.returncode, done.stdout
        except subprocess.TimeoutExpired:
            code, said = -1, f"stopped after {LONGEST_S:g} s"
        (self._folder / f"{name}.log").write_text(said, encoding="utf-8")
        seconds = round(time.perf_counter() - begin, 1)
        step = Step(
            name=name, command=" ".join(["rtctl", *words]), exit=code, seconds=seconds, said=said[-SAID:]
        )
        self._case.steps.append(step)
        print(f"  {name}: exit {code}, {seconds:g} s", flush=True)
        return step


def run_case(seed: int, effect: str, folder: Path, begin: str) -> Case:
    """The whole path on one device; steps that fail end it where nothing can follow."""
    folder.mkdir(parents=True, exist_ok=True)
    case = Case(seed=seed, effect=effect)
    user = User(case, folder)
    with served(seed, effect, begin) as device:
        case.device = device.told
        holds = measured_and_identified(user, device)
        if not (folder / "model.toml").exists():
            return case
        if begin == "line":
            device.begin()
        user.types("validate", "acquire", "acquire_vo2", *device.options, *holds, "--out", "validation")
        case.before = loops(user, device, folder, "model.toml", "before")
        user.types(
            "diagnose", "diagnose", "validation/dataset.toml", "--model", "model.toml", "--out", "answer"
        )
        read_answer(case, folder / "answer")
        if case.extended:
            case.after = loops(user, device, folder, "answer/model-extended.toml", "after")
    return case


def measured_and_identified(user: User, device: Device) -> list[str]:
    """Acquire and identify, again with longer holds where `identify` asks for them; the options for these holds."""
    holds: dict[str, str] = {}
    for attempt in range(1, ATTEMPTS + 1):
        options = [word for hold in holds.values() for word in ("--set", hold)]
        number = "" if attempt == 1 else str(attempt)
        user.types(f"acquire{number}", "acquire", "acquire_vo2", *device.options, *options, "--out", "data")
        step = user.types(
            f"identify{number}", "identify", "data/dataset.toml", "--kind", "vo2", "--out", "model.toml"
        )
        asked = {
            hold.split("=")[0]: hold
            for hold in re.findall(r'--set "(excitation\.\d+\.hold=[^"]+)"', step.said)
        }
        if not asked:
            break
        holds |= asked
    return [word for hold in holds.values() for word in ("--set", hold)]


def loops(user: User, device: Device, folder: Path, model: str, name: str) -> dict[str, float]:
    """Mean absolute tracking error [um] of each loop that ran to its end."""
    errors = {}
    for scenario in LOOPS:
        out = f"{name}-{scenario}"
        user.types(out, "run", scenario, "--model", model, *device.options, "--out", out)
        summary = folder / out / "summary.json"
        if summary.exists():
            told = json.loads(summary.read_text(encoding="utf-8"))
            if told["verdict"] != "fault":
                errors[scenario] = told["tracking"]["mean_abs_um"]
    return errors


def read_answer(case: Case, folder: Path) -> None:
    """What the diagnosis said, and its judgement."""
    answer = folder / "diagnosis.json"
    if not answer.exists():
        return
    diagnosis = json.loads(answer.read_text(encoding="utf-8"))
    also_true = ALSO_TRUE if case.device["convention"] == "start" else []
    hidden = None if case.effect == "none" else case.effect
    case.outcome = judge(hidden, to_be_judged(diagnosis, also_true))
    case.verdict = diagnosis["verdict"]
    kept = ("id", "probability", "share_removed", "indistinguishable_from", "parameters", "statement")
    case.causes = [{key: cause.get(key) for key in kept} for cause in diagnosis["causes"]]
    case.rehearsed = diagnosis.get("loop")
    case.extended = (folder / "model-extended.toml").exists()


def seeds_of(text: str) -> list[int]:
    """Seeds of "0-3,7"."""
    if not re.fullmatch(r"\d+(-\d+)?(,\d+(-\d+)?)*", text):
        raise argparse.ArgumentTypeError(f"seeds are numbers and ranges such as 0-3,7; got {text!r}")
    parts = [part.split("-") for part in text.split(",")]
    return [seed for part in parts for seed in range(int(part[0]), int(part[-1]) + 1)]


def main() -> None:
    """Run the cases that are not done yet, one at a time, then write the table."""
    parser = argparse.ArgumentParser(description="The README's path on foreign devices over Modbus TCP.")
    parser.add_argument("--seeds", type=seeds_of, required=True, help="such as 0-3,7")
    parser.add_argument(
        "--effects", default="none", help="ids with commas between, or none; every seed has each"
    )
    parser.add_argument(
        "--begin", default="line", help='"line" (after identify), "start", or a device time in s'
    )
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    for effect in given.effects.split(","):
        for seed in given.seeds:
            folder = given.out / f"{seed}-{effect}"
            if (folder / "case.json").exists():
                continue
            print(f"{seed} {effect}", flush=True)
            case = run_case(seed, effect, folder, given.begin)
            text = json.dumps(asdict(case), indent=1)
            (folder / "case.json").write_text(text + "\n", encoding="utf-8")
    paths = sorted(given.out.glob("*/case.json"))
    cases = [json.loads(path.read_text(encoding="utf-8")) for path in paths]
    (given.out / "cases.json").write_text(json.dumps(cases, indent=1) + "\n", encoding="utf-8")
    (given.out / "table.md").write_text(table(cases), encoding="utf-8")
    print(table(cases))


if __name__ == "__main__":
    main()
