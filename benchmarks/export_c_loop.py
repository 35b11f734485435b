"""All VO2 scenarios with the loop on the emulated Cortex-M4F and the device in another process, beside Python's loop.

python benchmarks/export_c_loop.py --model MODEL.toml [--device vo2_a] [--set KEY=VALUE ...] [SCENARIO ...]
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rtctl.api.exporting.c import export_c
from rtctl.api.runs.running import run
from rtctl.export.c.emulated import run_emulated
from rtctl.models.vo2 import read_model
from rtctl.scenario.bundled import find_scenario
from rtctl.scenario.schema import load_scenario

SCENARIOS = ("steps", "sine_0p1hz", "sine_0p5hz", "sine_1hz", "multisine_1_10hz", "multisine_10_30hz")


@contextmanager
def served(device: str, port: Path) -> Iterator[None]:
    """A device on a serial line by another process."""
    command = [sys.executable, "-m", "rtctl", "serve", device, "--serial", str(port)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
        try:
            while not port.exists():
                time.sleep(0.1)
                assert process.poll() is None, "the device did not start"
            yield
        finally:
            process.terminate()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenarios", nargs="*", default=SCENARIOS)
    parser.add_argument("--model", type=Path, required=True)
    parser.add_argument("--device", default="vo2_a")
    parser.add_argument("--set", dest="overrides", action="append", default=[])
    args = parser.parse_args()
    model = read_model(args.model)
    print(
        "| scenario | verdict on the board | tracking, board | tracking, Python | more, of the range | samples |"
    )
    print("|---|---|---|---|---|---|")
    for name in args.scenarios or SCENARIOS:
        scenario, _ = load_scenario(find_scenario(name), args.overrides)
        if scenario.reference is None:
            continue
        with tempfile.TemporaryDirectory() as place:
            folder, port = Path(place) / "loop", Path(place) / "line"
            export_c(name, model=args.model, out=folder, settings=args.overrides)
            with served(args.device, port):
                there = run_emulated(folder, scenario, model, str(port)).result
        python = run(name, model=args.model, settings=args.overrides)
        board, ours = there.summary["tracking"], python.summary["tracking"]
        print(
            f"| {name} | {there.summary['verdict']} | {board['mean_abs_um']:.4f} um | {ours['mean_abs_um']:.4f} um | "
            f"{board['mean_abs_percent'] - ours['mean_abs_percent']:+.4f} % | {len(there.signals['index'])} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
