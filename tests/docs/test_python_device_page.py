"""The page on devices as Python classes runs as it stands, in under 40 lines, and names the hidden rim."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "python-device.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_page_goes_from_a_class_to_a_named_cause_in_under_40_lines(tmp_path: Path) -> None:
    module, script = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    assert sum(bool(line.strip()) for line in (module + script).splitlines()) < 40
    (tmp_path / "tank.py").write_text(module, encoding="utf-8")
    (tmp_path / "go.py").write_text(script, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "go.py"], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=600
    )
    assert done.returncode == 0, done.stderr
    assert "state.level.limit" in done.stdout
    assert done.stdout.splitlines()[-1] in PAGE
