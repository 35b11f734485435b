"""The campaign of faults in short: its own verdict is that nothing is unsafe, unnamed, lost or wrongly believed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from plant_sim.journal import Entry

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "benchmarks"))

import fault_cells  # noqa: E402


@pytest.mark.wire
def test_every_kind_that_strikes_device_host_or_line_ends_safe_and_named(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "# Page\n<!-- fault campaign -->\n<!-- end of the fault campaign -->\nrest\n", encoding="utf-8"
    )
    command = [
        sys.executable,
        str(ROOT / "benchmarks" / "fault_campaign.py"),
        "--count",
        "2",
        "--wires",
        "serial",
        "--kinds",
        "bit_flip,device_reboot,host_pause,several",
        "--out",
        str(tmp_path / "faults"),
    ]

    def run(*more: str) -> str:
        done = subprocess.run(
            [*command, *more], capture_output=True, text=True, cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT)}, timeout=280.0,
        )  # fmt: skip
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    run()
    (tmp_path / "faults" / "serial-bit_flip-0.json").unlink()
    # what was done before it was stopped is not done again
    assert run("--page", str(page)).count("journal:") == 1
    text = page.read_text(encoding="utf-8")
    assert "| 3 kinds at once |" in text
    assert text.endswith("rest\n")
    assert "Unsafe currents at the device: 0. Faults without a name: 0." in text
    assert "Records lost: 0 of" in text


LEASE_US = round(1e6 * fault_cells.WATCHDOG_S)


def entries(*applied: tuple[int, int, float]) -> list[Entry]:
    """Commands of 5 mA at 1000 us and two and a half leases later, and what was applied."""
    return [
        Entry("command", 1000, 7, (5.0,)),
        Entry("command", 1000 + 5 * LEASE_US // 2, 8, (5.0,)),
        *(Entry("applied", at, for_us, (level,)) for at, for_us, level in applied),
    ]


@pytest.mark.parametrize(
    ("applied", "sent", "words"),
    [
        ((1000, LEASE_US, 5.0), {5.0}, []),
        ((1000, LEASE_US + 5, 5.0), {5.0}, ["not renewed"]),
        ((1000, 3 * LEASE_US, 5.0), {5.0}, ["not renewed"]),
        ((1000, 10, 8.6), {5.0}, ["outside"]),
        ((1000, 10, 5.0), {4.0}, 2 * ["never sent"]),
        ((900_000, 10_000_000, 0.0), {5.0}, []),
    ],
    ids=[
        "within the lease",
        "beyond the lease",
        "renewed too late",
        "beyond the limits",
        "never sent",
        "off",
    ],
)
def test_the_judge_sees_what_must_not_be(
    applied: tuple[int, int, float], sent: set[float], words: list[str]
) -> None:
    found = fault_cells.unsafe_entries(entries(applied), sent, 3.68, 8.49)
    assert len(found) == len(words)
    assert all(word in sentence for word, sentence in zip(words, found, strict=True))
