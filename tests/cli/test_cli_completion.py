"""`rtctl completion`: bash itself completes verbs and options by the script; the others have every one of them."""

from __future__ import annotations

import shutil
import subprocess

import pytest

from rtctl.cli import VERBS, main


def script(capsys: pytest.CaptureFixture[str], shell: str) -> str:
    assert main(["completion", shell]) == 0
    return capsys.readouterr().out


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["rtctl", "ini"], ["init"]),
        (["rtctl", "di"], ["diagnose"]),
        (["rtctl", "init", "--sa"], ["--sample-rate"]),
        (["rtctl", "diagnose", "d.toml", "--mo"], ["--model"]),
        (["rtctl", "init", "run"], []),
    ],
)
def test_bash_completes(capsys: pytest.CaptureFixture[str], words: list[str], expected: list[str]) -> None:
    ask = f'COMP_WORDS=({" ".join(words)}); COMP_CWORD={len(words) - 1}; _rtctl; printf "%s\\n" "${{COMPREPLY[@]}}"'
    done = subprocess.run(
        ["bash", "--norc", "-c", script(capsys, "bash") + ask], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == expected


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_other_shells_have_every_verb_and_option(capsys: pytest.CaptureFixture[str], shell: str) -> None:
    text = script(capsys, shell)
    assert [verb for verb in VERBS if verb not in text] == []
    assert "sample-rate" in text
