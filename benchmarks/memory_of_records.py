"""What a long record takes: peak memory and time of `rtctl identify`, and of the streaming regression on a mapped file.

    python benchmarks/memory_of_records.py [--samples 1e6 3e6 1e7] [--streamed 1e7 1e8]

Each in a process of its own; peak memory above that of the same process after its imports. The regression
(`compute_weak_gram`, as the beam study uses it) reads displacement and frame velocity from two mapped files of float64
and keeps an 11 x 11 matrix; pages of a mapped file count as the process's memory while the system has nothing better
to do with them, so its anonymous memory is what is told.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from oscillator_vs_c import PERIOD_S, nominal, random_drive, values_of

from rtctl.border.simulation import Stimulus

BLOCK = 500_000
PEAK = """
import sys, threading, time
from pathlib import Path

def anonymous_kB():
    lines = Path("/proc/self/status").read_text().splitlines()
    return sum(int(line.split()[1]) for line in lines if line.startswith(("RssAnon", "RssShmem")))

class Peak(threading.Thread):
    def __init__(self):
        super().__init__(daemon=True)
        self.before = self.most = anonymous_kB()
        self.start()
    def run(self):
        while True:
            self.most = max(self.most, anonymous_kB())
            time.sleep(0.005)
"""
IDENTIFY = """
import rtctl, rtctl.api.identifying.identification
small, large = sys.argv[1:]
rtctl.identify(rtctl.read_dataset(small))  # imports, compiles
peak, begun = Peak(), time.process_time()
fit = rtctl.identify(rtctl.read_dataset(large))
value = fit.model.parameters["stiffness"].value
print(1e-3 * (peak.most - peak.before), time.process_time() - begun, value)
"""
STREAM = """
import numpy as np
from rtctl.identification.regression.streaming_gram import COLUMNS, compute_weak_gram
z, w = (np.memmap(name, dtype=np.float64, mode="r") for name in sys.argv[1:3])
period_s, half_width_s = float(sys.argv[3]), float(sys.argv[4])
compute_weak_gram(z[:100_000], w[:100_000], period_s, half_width_s)
peak, begun = Peak(), time.process_time()
gram = compute_weak_gram(z, w, period_s, half_width_s)
rows = [COLUMNS.index(name) for name in ("v", "z", "z^3")]
found = np.linalg.solve(gram[np.ix_(rows, rows)], -gram[rows, 0])
print(1e-3 * (peak.most - peak.before), time.process_time() - begun, found[1])
"""


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--samples", nargs="*", type=float, default=[1e6, 3e6, 1e7])
    parser.add_argument("--streamed", nargs="*", type=float, default=[1e7, 1e8])
    asked = parser.parse_args()
    print("| samples | by | peak memory [MB] | bytes a sample | processor time [s] | stiffness off by |")
    print("|---|---|---|---|---|---|")
    true = float(values_of(nominal())[1])
    with tempfile.TemporaryDirectory(dir="/var/tmp") as name:
        folder = Path(name)
        small = dataset(folder, 20_000)
        for samples in map(int, asked.samples):
            row("rtctl identify", samples, true, IDENTIFY, small, dataset(folder, samples))
        for samples in map(int, asked.streamed):
            z, w = mapped(folder, samples)
            row("weak form, streamed", samples, true, STREAM, z, w, PERIOD_S, 0.5 / 70.0)
            z.unlink()
            w.unlink()


def row(by: str, samples: int, true: float, code: str, *arguments: object) -> None:
    """Run a process and print its row."""
    command = [sys.executable, "-c", PEAK + code, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        print(
            f"| {samples:.0e} | {by} | failed: {(done.stderr.splitlines() or [done.returncode])[-1]} | | | |"
        )
        return
    peak_mb, seconds, value = map(float, done.stdout.split()[-3:])
    print(
        f"| {samples:.0e} | {by} | {peak_mb:.0f} | {1e6 * peak_mb / samples:.0f} | {seconds:.1f} | "
        f"{abs(value / true - 1.0):.0e} |",
        flush=True,
    )


def blocks(samples: int) -> tuple[int, np.ndarray, np.ndarray]:
    """How often, and one block of drive and displacement, which follows itself: the drive is periodic."""
    block = min(samples, BLOCK)
    simulation, drive = nominal(), 2.0 * random_drive(block)
    stimulus = Stimulus(inputs={"drive": np.tile(drive, 2)}, holds={"drive": "linear"}, period_s=PERIOD_S)
    both = simulation.predict(stimulus, values_of(simulation)).outputs["displacement"].ravel()
    return -(-samples // block), drive, both[block:]


def dataset(folder: Path, samples: int) -> Path:
    """One record with a thousandth of noise; its manifest."""
    import rtctl

    count, drive, z = blocks(samples)
    noise = 1e-3 * z.std() * np.random.default_rng(0).standard_normal(count * z.size)
    signals = {
        "drive": np.tile(drive, count)[:samples],
        "displacement": (np.tile(z, count) + noise)[:samples],
    }
    record = rtctl.Record(name="long", period_s=PERIOD_S, use="fit", signals=signals)
    units = {"drive": "V", "displacement": "V"}
    where = folder / str(samples)
    where.mkdir()
    made = rtctl.write_dataset(
        where, [record], name="long", plant="oscillator", units=units, holds={"drive": "linear"}
    )
    return Path(made.path)


def mapped(folder: Path, samples: int) -> tuple[Path, Path]:
    """Displacement, and the velocity of a frame whose acceleration is what the drive does: - gain drive."""
    count, drive, z = blocks(samples)
    gain = float(values_of(nominal())[3])
    about_mean = drive - drive.mean()
    velocity = -gain * PERIOD_S * (np.cumsum(about_mean) - 0.5 * about_mean)
    paths = folder / "z.f64", folder / "w.f64"
    for path, values in zip(paths, (z, velocity), strict=True):
        with path.open("wb") as file:
            for _ in range(count):
                values.tofile(file)
    return paths


if __name__ == "__main__":
    main()
