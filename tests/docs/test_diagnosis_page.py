"""The tutorial of the diagnosis runs as it stands and ends as it says."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_the_tutorial_names_what_the_bundled_beam_has_and_then_finds_nothing(tmp_path: Path) -> None:
    text = (ROOT / "docs" / "diagnosis.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```sh\n(.*?)```", text, flags=re.DOTALL)
    assert len(blocks) == 4
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash", "-c", "set -e\n" + "".join(blocks)], cwd=tmp_path, env=environment, text=True, timeout=600,
        capture_output=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    answers = [
        json.loads((tmp_path / "diagnosis" / name / "diagnosis.json").read_text())
        for name in ("answer", "again")
    ]
    assert [answer["verdict"] for answer in answers] == ["explained", "adequate"]
    (cause,) = answers[0]["causes"]
    assert cause["id"] == "stiffness.quintic"
    beam = tomllib.loads((ROOT / "plant_sim/oscillator/devices/beam_rm5c.toml").read_text())
    truth = beam["model"]["mechanisms"][0]["parameters"]["coefficient"]["value"]
    found = cause["parameters"]["coefficient"]
    assert found["low"] < truth < found["high"]
    assert answers[0]["gain"]["ratio_low"] > 1.5
    said = re.findall(r"fifth order: (0\.\d+)", text)
    assert said == [f"{found['value']:.3g}"]


def test_the_pages_links_and_pictures_exist() -> None:
    text = (ROOT / "docs" / "diagnosis.md").read_text(encoding="utf-8")
    targets = re.findall(r"\]\(([^)#]+)\)", text)
    assert "pictures/diagnosis.png" in targets
    assert [target for target in targets if not (ROOT / "docs" / target).exists()] == []
