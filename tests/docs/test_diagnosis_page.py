"""The tutorial of the diagnosis runs as it stands and ends as it says."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


PAGE = (ROOT / "docs" / "diagnosis.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```sh\n(.*?)```", PAGE, flags=re.DOTALL)
OSCILLATOR, VO2 = BLOCKS[:4], BLOCKS[4:]


def typed(blocks: list[str], folder: Path) -> None:
    """In a shell, one after the other."""
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash", "-c", "set -e\n" + "".join(blocks)], cwd=folder, env=environment, text=True, timeout=600,
        capture_output=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_the_tutorial_names_what_the_bundled_beam_has_and_then_finds_nothing(tmp_path: Path) -> None:
    assert len(OSCILLATOR) == 4
    typed(OSCILLATOR, tmp_path)
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
    said = re.findall(r"fifth order: (0\.\d+)", PAGE)
    assert said == [f"{found['value']:.3g}"]


@pytest.mark.slow
def test_a_hidden_delay_is_named_and_the_loop_tracks_better_with_it(tmp_path: Path) -> None:
    assert len(VO2) == 2
    typed(VO2, tmp_path)
    answer = json.loads((tmp_path / "late" / "answer" / "diagnosis.json").read_text())
    assert answer["verdict"] == "explained"
    assert [cause["id"] for cause in answer["causes"]] == ["actuation.delay"]
    (said,) = re.findall(r"acts (\d+(?:\.\d+)?) ms late", PAGE)
    assert said == f"{1e3 * answer['causes'][0]['parameters']['delay']['value']:.4g}"
    means = [
        json.loads((tmp_path / "late" / when / "summary.json").read_text())["tracking"]["mean_abs_um"]
        for when in ("before", "after")
    ]
    before, after = re.findall(r"mean tracking error of (\d\.\d) µm, the second has (0\.\d) µm", PAGE)[0]
    assert [f"{means[0]:.1f}", f"{means[1]:.1f}"] == [before, after]


def test_the_pages_links_and_pictures_exist() -> None:
    targets = re.findall(r"\]\(([^)#]+)\)", PAGE)
    assert "pictures/diagnosis.png" in targets
    assert [target for target in targets if not (ROOT / "docs" / target).exists()] == []
