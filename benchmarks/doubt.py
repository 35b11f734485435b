"""`rtctl doubt` on runs in which nothing changes, and on runs in which one thing does, with seeds of their own.

    python benchmarks/doubt.py unchanged --minutes 5        false alarms in simulated hours, all scenarios of VO2
    python benchmarks/doubt.py changed [--reference]        detected, after how long, named right, simulated devices
    python benchmarks/doubt.py foreign --seeds 901 902      the same on devices of another lab over Modbus TCP
    python benchmarks/doubt.py retuned [--reference]        each policy while it runs: tracking error before the change,
                                                            after it, and at the end

Models are identified with noise seed 7001, runs have 7100 and 7300 and more; the watch was built on 501, 9000, 9100
and, of sizes and seeds 7200, on six cases. Each case is kept in --out and not run again.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq

import rtctl
import rtctl.session.run_files
from rtctl.cli import main as rtctl_main
from rtctl.doubt.policy import OnceActing, Policy
from rtctl.loop.live_parameters import ParameterChannel
from rtctl.plant_control.lookup import support_of
from rtctl.scenario.schema import load_scenario
from rtctl.session.closed_loop import track
from rtctl.session.doubting.recorded import doubt_run
from rtctl.session.doubting.retuning import Retuning
from rtctl.session.doubting.under_way import LiveWatch
from rtctl.session.run_files import write_run
from rtctl.session.run_folder import RunFolder, run_metadata
from rtctl.wiring import build_driver

ROOT = Path(__file__).resolve().parent.parent
DEVICES = ("vo2_a", "vo2_b", "vo2_l2p")
SCENARIOS = (
    "steps", "sine_0p1hz", "sine_0p5hz", "sine_1hz", "multisine_1_10hz", "multisine_10_30hz",
)  # fmt: skip
CHANGES = {
    "actuation.delay": 'delay = "2 ms"',
    "thermal.second_time_constant": 'second_share = 0.25\nsecond_time_constant = "10 ms"',
    "sensor.lag": 'sensor_lag = "3 ms"',
    "hysteresis.rate_dependence": 'domain_lag = "3 ms"',
    "thermal.ambient_drift": 'warming = "0.06 K/s"',
    "input.gain_drift": 'gain_drift = "0.0006 1/s"',
    "sensor.ageing": 'ageing = "0.003 1/s"',
    "sensor.gain": "gain_loss = 0.06",
    "structure.resonance": 'swing_share = 0.4\nswing_frequency = "80 Hz"\nswing_damping = 0.05',
    "noise": "noise_growth = 6",
}
RETUNED = {
    "actuation.delay": 'delay = "3 ms"',
    "sensor.lag": 'sensor_lag = "4 ms"',
    "hysteresis.rate_dependence": 'domain_lag = "4 ms"',
    "thermal.second_time_constant": 'second_share = 0.35\nsecond_time_constant = "8 ms"',
    "sensor.gain": "gain_loss = 0.1",
    "sensor.ageing": 'ageing = "0.006 1/s"',
}
"""Larger than those of `CHANGES`: most of them at least double the tracking error."""
AFTER_S = 24.0
"""Of a run of part retuned, time after the change."""
FOREIGN = (
    "actuation.delay",
    "thermal.second_time_constant",
    "sensor.lag",
    "thermal.ambient_drift",
    "sensor.ageing",
)


def main() -> None:
    """Run one part and print its figures."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("part", choices=["unchanged", "changed", "foreign", "retuned"])
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument(
        "--noise", type=int, default=7100, help="of part unchanged: seed of the first scenario"
    )
    parser.add_argument(
        "--round", type=int, default=0, help="of parts changed and retuned: other cases, other noise"
    )
    parser.add_argument("--seeds", type=int, nargs="+", default=[901, 902])
    parser.add_argument("--reference", action="store_true", help="use the reference instrument as well")
    parser.add_argument("--devices", nargs="+", default=list(DEVICES))
    parser.add_argument("--changes", nargs="+", default=list(RETUNED), help="of part retuned")
    parser.add_argument("--at", type=float, default=12.0, help="of part retuned: second of the change")
    parser.add_argument(
        "--then", choices=RETUNED, help=f"of part retuned: a second change {AFTER_S:g} s after the first"
    )
    parser.add_argument("--policies", nargs="+", default=["warn", "derate", "retune"], help="of part retuned")
    parser.add_argument("--out", type=Path, default=Path("out/doubt"))
    args = parser.parse_args()
    rtctl.session.run_files.draw_run = lambda *nothing: None  # a picture a run is not needed here
    parts = {"unchanged": unchanged, "changed": changed, "foreign": foreign, "retuned": retuned}
    parts[args.part](args)


def model_of(device: str, out: Path) -> Path:
    """The device's model, identified from an acquisition with a seed of its own."""
    model = out / f"{device}.toml"
    if not model.is_file():
        data = out / f"{device}-data"
        options = ["--set", f"driver.device={device}", "--set", "driver.seed=7001", "--quiet"]
        rtctl_main(["acquire", "acquire_vo2", *options, "--out", str(data)])
        rtctl_main(["identify", str(data / "dataset.toml"), "--out", str(model), "--quiet", "--no-plot"])
    return model


def played(folder: Path, scenario: str, model: Path, settings: list[str]) -> None:
    """A run, unless it is there."""
    if not (folder / "summary.json").is_file():
        run = rtctl.run(scenario, model=model, settings=settings, out=folder)
        assert run.fault is None, run.message


def unchanged(args: argparse.Namespace) -> None:
    """Alarms where nothing changes."""
    hours, alarms = 0.0, 0
    for device in args.devices:
        for k, scenario in enumerate(SCENARIOS):
            folder = args.out / f"unchanged-{device}-{scenario}"
            settings = [
                f"driver.device={device}",
                f"driver.seed={args.noise + k}",
                f"scenario.duration={args.minutes} min",
            ]
            played(folder, scenario, model_of(device, args.out), settings)
            found = [
                one
                for one in doubt_run(folder, use_reference=args.reference).findings
                if one.kind != "learned"
            ]
            hours += args.minutes / 60.0
            alarms += sum(one.kind not in ("named", "differs") for one in found)
            said = "; ".join(f"{one.kind} at {one.sample}" for one in found)
            print(f"{device} {scenario}: {said or 'nothing'}", flush=True)
            (folder / "signals.parquet").unlink()  # some 100 MB an hour
            (folder / "summary.json").unlink()
    print(f"{alarms} alarms in {hours:.2f} simulated hours")


def changed(args: argparse.Namespace) -> None:
    """One change in each run."""
    rows = []
    for k in range(len(args.devices)):
        for number, change in enumerate(CHANGES):
            device = args.devices[(number + k + args.round) % len(args.devices)]
            scenario = SCENARIOS[(number + 2 * k + args.round) % len(SCENARIOS)]
            at_s = 16.0 + (7 * number + 3 * k + 2 * args.round) % 9
            folder = args.out / f"changed-{args.round}-{k}-{change}"
            settings = [
                f"driver.device={changing(folder, device, [(CHANGES[change], at_s)])}",
                f"driver.seed={7300 + 10 * number + k + 10_000 * args.round}",
                "scenario.duration=40 s",
            ]
            played(folder, scenario, model_of(device, args.out), settings)
            rows.append(judged(f"{device} {scenario}", change, folder, at_s, use_reference=args.reference))
        told(rows)


def retuned(args: argparse.Namespace) -> None:
    """Each policy on the same run: a device that changes once, or twice (`--then`)."""
    rows = []
    names, late = list(RETUNED), "" if args.at == 12.0 else f"-{args.at:g}s"
    late += f"-then-{args.then}" if args.then else ""
    second = [(RETUNED[args.then], args.at + AFTER_S)] if args.then else []
    for k, device in enumerate(args.devices):
        for change in args.changes:
            number = names.index(change)
            for policy in args.policies:
                folder = (
                    args.out
                    / f"retuned-{args.round}{late}-{device}-{change}-{policy}{'-reference' if args.reference else ''}"
                )
                settings = [
                    f"driver.device={changing(folder, device, [(RETUNED[change], args.at), *second])}",
                    f"driver.seed={7700 + 10 * number + k + 10_000 * args.round}",
                    f"scenario.duration={args.at + AFTER_S * (1 + len(second))} s",
                ]
                if not (folder / "summary.json").is_file():
                    played_with(
                        folder,
                        "multisine_1_10hz",
                        model_of(device, args.out),
                        settings,
                        policy,
                        args.reference,
                    )
                row = {"device": device, "change": change, "policy": policy, **errors_of(folder, args.at)}
                rows.append(row)
                print(json.dumps(row), flush=True)
    for policy in args.policies:
        ends = [row["end"] for row in rows if row["policy"] == policy]
        print(
            f"{policy}: error at the end over before, median {np.median(ends):.2f}, largest {max(ends):.2f}"
        )


def changing(folder: Path, device: str, changes: list[tuple[str, float]]) -> Path:
    """The file of a device that changes, each at its time [s]."""
    folder.mkdir(parents=True, exist_ok=True)
    text = (ROOT / "plant_sim" / "vo2" / "devices" / f"{device}.toml").read_text(encoding="utf-8")
    file = folder / "device.toml"
    tables = "".join(f'\n[[changes]]\nat = "{at_s} s"\n{change}\n' for change, at_s in changes)
    file.write_text(text + tables, encoding="utf-8")
    return file


# 6 parameters: what a run is
def played_with(
    folder: Path, name: str, model_file: Path, settings: list[str], policy: str, use_reference: bool
) -> None:
    """A run in lockstep whose watch looks every tenth of a second of it, in the same process: the same every time."""
    scenario, tables = load_scenario(ROOT / "scenarios" / f"{name}.toml", settings)
    changes, calls, watches = ParameterChannel(), 0, []

    def act(scenario: Any, model: Any, memory_before: Any) -> Any:
        if policy == "retune":
            return Retuning(
                folder, scenario, model, changes.offer_model, memory_before, use_reference=use_reference
            )
        return OnceActing(Policy(policy), lambda: changes.parameters(), changes.offer, changes.stop)

    def look() -> bool:
        nonlocal calls
        calls += 1
        if calls % 100 == 0:
            if not watches:
                watches.append(LiveWatch(folder, act, lambda *said: None, use_reference=use_reference))
            watches[0].look()
        return False

    place = RunFolder(path=folder, metadata=run_metadata(tables), model=model_file)
    result, outcome = track(
        scenario,
        support_of("vo2").read_model(model_file),
        build_driver(scenario, folder),
        look,
        place,
        changes,
    )
    watches[0].tail.close()
    assert outcome.fault is None or policy == "stop", outcome.message
    write_run(folder, scenario, tables, result, plot=False)


def errors_of(folder: Path, at_s: float) -> dict[str, Any]:
    """Mean absolute tracking error over what it was before the change: in the first seconds after it, at the end."""
    table = pq.read_table(folder / "signals.parquet", columns=["index", "setpoint", "deflection"])
    time_s, setpoint, deflection = (table[name].to_numpy() for name in table.column_names)
    off, time_s = np.abs(setpoint - deflection), 1e-3 * time_s
    before = np.nanmean(off[(time_s > 2.0) & (time_s < at_s - 1.0)])
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    told = [one for one in events if one["event"] == "doubt" and one["kind"] != "learned"]
    return {
        "after": round(float(np.nanmean(off[(time_s > at_s + 1.0) & (time_s < at_s + 4.0)]) / before), 2),
        "end": round(float(np.nanmean(off[time_s > time_s[-1] - 8.0]) / before), 2),
        "said": [f"{one['kind']} {one['message']} {one.get('done', '')}"[:220] for one in told],
    }  # fmt: skip


def foreign(args: argparse.Namespace) -> None:
    """The same on devices of another lab, whose effect begins at a device time."""
    server = ROOT / "tests" / "foreign" / "foreign_wire_server.py"
    rows = []
    for seed in args.seeds:
        for change in ("none", *FOREIGN):
            folder = args.out / f"foreign-{seed}-{change}"
            model = args.out / f"foreign-{seed}.toml"
            if not (folder / "summary.json").is_file():
                begin = "0" if change == "none" else "20"
                command = [
                    sys.executable,
                    str(server),
                    "--seed",
                    str(seed),
                    "--effect",
                    change,
                    "--begin",
                    begin,
                ]
                if not model.is_file():
                    quiet = [*command[:4], "--effect", "none"]
                    with_server(quiet, partial(identified, out=args.out, seed=seed))
                if not model.is_file():
                    print(f"foreign {seed}: not identified", flush=True)
                    break
                with_server(command, partial(played_on, folder=folder, model=model))
            if (folder / "summary.json").is_file():
                rows.append(judged(f"foreign {seed}", change, folder, 20.0, use_reference=args.reference))
    told(rows)


def with_server(command: list[str], use: Any) -> None:
    """Serve a device while it is used."""
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            use(process.stdout.readline().split(" ", 2)[1])
        finally:
            process.terminate()


def identified(where: str, out: Path, seed: int) -> None:
    """Acquire and identify at an address."""
    wire = ["--set", "driver.kind=modbus-tcp", "--set", f"driver.address={where}", "--quiet"]
    data = out / f"foreign-{seed}-data"
    rtctl_main(["acquire", "acquire_vo2", *wire, "--out", str(data)])
    model = out / f"foreign-{seed}.toml"
    rtctl_main(["identify", str(data / "dataset.toml"), "--out", str(model), "--quiet", "--no-plot"])


def played_on(where: str, folder: Path, model: Path) -> None:
    """A run of multisines at an address."""
    wire = ["driver.kind=modbus-tcp", f"driver.address={where}", "scenario.duration=44 s"]
    played(folder, "multisine_1_10hz", model, wire)


def judged(name: str, change: str, folder: Path, at_s: float, *, use_reference: bool) -> dict[str, Any]:
    """What the watch said of a run."""
    begun = time.perf_counter()
    found = [one for one in doubt_run(folder, use_reference=use_reference).findings if one.kind != "learned"]
    cost_s = time.perf_counter() - begun
    alarm = next((one for one in found if one.kind not in ("named", "differs")), None)
    named = next((one for one in found if one.kind == "named"), None)
    causes = [cause.id for cause in named.causes] if named else []
    grown = growth(folder, at_s)
    row = {
        "name": name, "change": change, "kind": alarm.kind if alarm else "",
        "grown": grown, "after_s": 1e-3 * alarm.sample - at_s if alarm else None,
        "causes": [(one.id, round(one.probability, 2)) for one in named.causes] if named else [],
        "first": causes[:1] == [change], "in_two": change in causes[:2], "seconds": round(cost_s, 1),
    }  # fmt: skip
    print(json.dumps(row), flush=True)
    return row


def growth(folder: Path, at_s: float) -> float:
    """Mean absolute tracking error after the change over before it, the start from the cold device left out."""
    table = pq.read_table(folder / "signals.parquet", columns=["index", "setpoint", "deflection"])
    time_s, setpoint, deflection = (table[name].to_numpy() for name in table.column_names)
    off, time_s = np.abs(setpoint - deflection), 1e-3 * time_s
    before = np.nanmean(off[(time_s > 2.0) & (time_s < at_s - 1.0)])
    return round(float(np.nanmean(off[time_s > at_s]) / before), 2)


def told(rows: list[dict[str, Any]]) -> None:
    """Print the sums."""
    real = [row for row in rows if row["change"] != "none"]
    caught = [row for row in real if row["after_s"] is not None and row["after_s"] > 0.0]
    to_name = [row for row in caught if row["change"] not in ("noise", "structure.resonance")]
    early = sum(row["after_s"] is not None and row["after_s"] <= 0.0 for row in rows)
    early += sum(row["kind"] != "" for row in rows if row["change"] == "none")
    worse = [row for row in real if row["grown"] >= 2.0]
    in_time = sum(row["after_s"] is not None and 0.0 < row["after_s"] <= 20.0 for row in worse)
    print(f"of {len(worse)} that at least double the tracking error {in_time} detected within 20 s")
    delays = sorted(row["after_s"] for row in caught)
    print(f"detected {len(caught)} of {len(real)}; false or too early {early}")
    if delays:
        print(f"delay [s]: median {delays[len(delays) // 2]:.1f}, longest {delays[-1]:.1f}")
    print(f"named first {sum(row['first'] for row in to_name)}, in the first two "
          f"{sum(row['in_two'] for row in to_name)} of {len(to_name)}")  # fmt: skip


if __name__ == "__main__":
    main()
