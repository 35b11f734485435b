"""What an exported loop costs on a Cortex-M4F: flash, memory, stack, instructions a sample, for each estimator.

Instructions are counted by emulation over a recorded run of the scenario `steps` (of a Kalman filter of equations: the
scenario that is named beside it), so they are the same on each machine.

    python benchmarks/export_c_cost.py --model MODEL.toml [--duration "2 s"] [--loops observer,none ...]
"""

from __future__ import annotations

import argparse
import struct
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from rtctl.api.exporting.c import export_c
from rtctl.api.runs.running import run
from rtctl.export.c.laws.planning import law_of
from rtctl.export.c.proof.machines import EMULATED, MACHINES, missing
from rtctl.export.c.proof.recorded import inputs_of
from rtctl.models.vo2 import read_model
from rtctl.session.closed_loop import planned_step
from rtctl.session.replay import read_run

LOOPS = (
    ("observer", "none"), ("observer", "inverse"), ("composite", "none"), ("gap_free", "none"), ("preisach", "none"),
    ("egpi", "none"), ("lock_in", "none"), ("kalman", "voice_coil_steps"), ("kalman", "sma_steps"),
    ("kalman", "piezo_steps"),
)  # fmt: skip
CLOCK_HZ, RATE_HZ = 100e6, 10e3


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", type=Path, required=True)
    parser.add_argument("--duration", default="2 s")
    parser.add_argument("--loops", nargs="+", default=[",".join(one) for one in LOOPS])
    args = parser.parse_args()
    is_plain = not read_model(args.model).mechanisms
    if lack := missing(MACHINES["m4f"]):
        raise SystemExit(lack)
    print(
        "| estimator, feedforward or scenario | flash, kB | of it tables | memory, byte | stack, byte | "
        "instructions, mean | most |"
    )
    print("|---|---|---|---|---|---|---|")
    for estimator, _, feedforward in (loop.partition(",") for loop in args.loops):
        settings: dict[str, Any] = {"estimator.kind": estimator}
        scenario, model = {"lock_in": ("me_amplitude", None), "kalman": (feedforward, None)}.get(
            estimator, ("steps", args.model)
        )
        if estimator != "kalman":
            settings["scenario.duration"] = args.duration
        if model is not None:
            settings["controller.feedforward"] = feedforward
        with tempfile.TemporaryDirectory() as place:
            found = cost(scenario, model, settings, Path(place))
        print(
            f"| {estimator}, {feedforward} | {found['flash'] / 1e3:.1f} | {found['tables'] / 1e3:.1f} | "
            f"{found['state']} | {found['stack']} | {found['mean']:.0f} | {found['most']} |"
        )
        if estimator == "observer" and feedforward == "none" and is_plain:
            assert found["flash"] <= 32_768, "more than 32 kB of flash"
            assert found["state"] + found["stack"] <= 4096, "more than 4 kB of RAM"
            assert found["most"] <= CLOCK_HZ / RATE_HZ, "too slow for 10 kHz at 100 MHz"


def cost(scenario: str, model: Path | None, settings: dict[str, Any], place: Path) -> dict[str, float]:
    """Return the figures of one loop."""
    run(scenario, model=model, settings=settings, out=place / "run")
    made = export_c(scenario, model=model, settings=settings, out=place / "loop")
    subprocess.run(["make", "-s", "-C", str(place / "loop"), "cost", "library"], check=True)
    build = place / "loop" / "build" / "float"
    recorded = read_run(place / "run")
    step, setpoints, _ = planned_step(recorded.scenario, recorded.model)
    rows, _ = inputs_of(
        law_of(recorded.scenario, recorded.model), recorded, setpoints, step.preview_s, np.float32
    )
    (build / "in.bin").write_bytes(rows.tobytes())
    subprocess.run(
        [*MACHINES["m4f"].emulator, *EMULATED, "-icount", "shift=0", "-kernel", "cost.elf"],
        cwd=build,
        check=False,
    )
    samples, most, every, stack, state = struct.unpack("<IIQII", (build / "cost.bin").read_bytes()[:24])
    sizes = subprocess.run(
        ["arm-none-eabi-size", str(build / "rtctl_m4f.o")], check=True, capture_output=True, text=True
    )
    text = int(sizes.stdout.splitlines()[1].split()[0])
    return {
        "flash": text, "tables": made.table_bytes, "state": state, "stack": stack, "mean": every / samples,
        "most": most,
    }  # fmt: skip


if __name__ == "__main__":
    main()
