"""The documentation says what the program does: every verb and option stands in it, and its blocks run."""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from rtctl.cli import VERBS, build_parser

ROOT = Path(__file__).resolve().parents[2]
COMMANDS = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")


def _verb_parsers() -> dict[str, argparse.ArgumentParser]:
    actions = build_parser()._actions
    choices = next(action for action in actions if isinstance(action, argparse._SubParsersAction)).choices
    return dict(choices)


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_and_option_stands_in_the_documentation(verb: str) -> None:
    assert f"rtctl {verb}" in COMMANDS
    for action in _verb_parsers()[verb]._actions:
        for option in action.option_strings:
            if option not in ("-h", "--help"):
                assert option in COMMANDS, f"{verb} {option}"


def test_links_of_the_readme_lead_somewhere() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    targets = re.findall(r"\]\(([^)#]+)\)", text)
    assert len(targets) > 5
    assert [target for target in targets if not (ROOT / target).exists()] == []


@pytest.mark.wire
def test_the_tutorial_runs_as_it_stands(tmp_path: Path) -> None:
    text = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
    server, *blocks = re.findall(r"```sh\n(.*?)```", text, flags=re.DOTALL)
    assert len(blocks) == 3
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    serve = server.strip().removesuffix("&").replace(":5020", ":0").split()
    with subprocess.Popen(serve, cwd=tmp_path, env=environment, text=True, stdout=subprocess.PIPE) as device:
        try:
            assert device.stdout is not None
            address = re.search(r"127\.0\.0\.1:\d+", device.stdout.readline())
            assert address is not None
            script = "set -e\n" + "".join(blocks).replace("127.0.0.1:5020", address[0])
            done = subprocess.run(
                ["bash", "-c", script], cwd=tmp_path, env=environment, text=True, timeout=300,
                capture_output=True, check=False,
            )  # fmt: skip
        finally:
            device.terminate()
    assert done.returncode == 0, done.stdout + done.stderr
    for name in ("observer", "composite"):
        assert (tmp_path / "tutorial" / name / "summary.json").is_file()
        assert (tmp_path / "tutorial" / name / "run.png").stat().st_size > 20_000
