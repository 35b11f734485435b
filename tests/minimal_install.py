"""What a base install must do without any extra, run by `make minimal` in a fresh environment.

Import rtctl, measure and identify a simulated actuator, run `steps` on it, identify an oscillator from CSV, and name
the extra where a reader is missing.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np

OPTIONAL = (
    "h5py",
    "nptdms",
    "pyuff",
    "distributed",
    "mcap",
    "caproto",
)  # matplotlib comes with python-control
MANIFEST = """
[dataset]
name = "minimal"
plant = "oscillator"
[signals.drive]
role = "input"
unit = "V"
[signals.displacement]
role = "output"
unit = "mm"
[[records]]
file = "{file}"
sample_rate_hz = 1000.0
"""


def rtctl(*arguments: str, expected: int = 0) -> str:
    """Run a verb and return what it printed; exit with its output if its exit code is not the expected one."""
    done = subprocess.run(
        [sys.executable, "-m", "rtctl", *arguments], capture_output=True, text=True, check=False
    )
    print(f"rtctl {' '.join(arguments)}: exit {done.returncode}")
    if done.returncode != expected:
        sys.exit(done.stdout + done.stderr)
    return done.stdout + done.stderr


def write_oscillator(folder: Path) -> None:
    """Write a CSV record of z'' + 20 z' + 8882.6 z = 300 u, exact between samples of a held drive, and its manifest."""
    period_s, rng = 1e-3, np.random.default_rng(1)
    drive = np.repeat(rng.normal(size=200), 20)
    poles = np.roots([1.0, 20.0, 8882.6])
    decay, modes = np.exp(poles * period_s), np.array([1.0, -1.0]) * 300.0 / (poles[0] - poles[1])
    state, rows = np.zeros(2, complex), []
    for u in drive:
        rows.append((u, state.sum().real))
        state = decay * state + (decay - 1.0) / poles * modes * u
    np.savetxt(folder / "r.csv", rows, delimiter=",", header="drive,displacement", comments="")
    manifest = MANIFEST.replace('unit = "V"', 'unit = "V"\nhold = "zero"')
    (folder / "csv.toml").write_text(manifest.format(file="r.csv"), encoding="utf-8")
    (folder / "r.tdms").write_bytes(b"TDSm".ljust(28, b"\0"))
    (folder / "tdms.toml").write_text(MANIFEST.format(file="r.tdms"), encoding="utf-8")


def main() -> None:
    """Run all of it in a temporary folder."""
    present = [name for name in OPTIONAL if find_spec(name) is not None]
    if present:
        sys.exit(f"not a base install: {', '.join(present)} can be imported")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        data, model = str(folder / "data"), str(folder / "model.toml")
        rtctl("acquire", "acquire_vo2", "--out", data)
        rtctl("identify", f"{data}/dataset.toml", "--kind", "vo2", "--out", model)
        rtctl("run", "steps", "--model", model, "--out", str(folder / "run"))
        write_oscillator(folder)
        fitted = str(folder / "oscillator.toml")
        rtctl("identify", str(folder / "csv.toml"), "--kind", "oscillator", "--out", fitted)
        message = rtctl(
            "identify", str(folder / "tdms.toml"), "--kind", "oscillator", "--out", fitted, expected=2
        )
        if "reading .tdms needs npTDMS: pip install 'rtctl[readers]'" not in message:
            sys.exit(f"the message does not name the extra: {message}")


if __name__ == "__main__":
    main()
