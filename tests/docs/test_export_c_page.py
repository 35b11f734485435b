"""The page on loops in C runs as it stands: from a measured device to the loop on the emulated board."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "export-c.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```sh\n(.*?)```", PAGE, flags=re.DOTALL)


@pytest.mark.slow
@pytest.mark.wire
def test_the_page_leads_from_a_device_to_the_emulated_board(tmp_path: Path) -> None:
    if shutil.which("arm-none-eabi-gcc") is None or shutil.which("qemu-system-arm") is None:
        pytest.skip("the emulated board needs gcc-arm-none-eabi and qemu-system-arm")
    proof, board = BLOCKS
    serve, on_board = board.splitlines()
    place = str(tmp_path / "vo2")
    wait = f"while [ ! -e {place} ]; do sleep 0.2; done"
    script = "\n".join(
        (
            "set -e",
            proof,
            f"{serve.replace('/tmp/vo2', place)}",
            wait,
            on_board.replace("/tmp/vo2", place),
            "kill %1",
        )
    )
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash", "-c", script], cwd=tmp_path, env=environment, text=True, timeout=1800, capture_output=True, check=False
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert "differ" not in done.stdout
    assert json.loads((tmp_path / "out" / "board" / "summary.json").read_text())["verdict"] == "pass"
