"""Help answers at once: for every verb, with every option explained, and without importing what is heavy."""

from __future__ import annotations

import argparse
import shlex
import subprocess
import sys

import pytest

from rtctl import __version__
from rtctl.cli import VERBS, build_parser, main

HEAVY = {
    "numpy", "scipy", "numba", "pydantic", "pint", "control", "matplotlib", "pyarrow", "pymodbus", "serial", "rich",
}  # fmt: skip


def verb_parsers() -> dict[str, argparse.ArgumentParser]:
    actions = build_parser()._actions
    return dict(next(a for a in actions if isinstance(a, argparse._SubParsersAction)).choices)


def test_the_parser_imports_nothing_heavy() -> None:
    code = (
        "import sys, rtctl.cli; rtctl.cli.build_parser(); print(*{m.partition('.')[0] for m in sys.modules})"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(ended.stdout.split())
    assert "rtctl" in loaded
    assert loaded & HEAVY == set()


def test_help_lists_every_verb(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    assert ended.value.code == 0
    text = capsys.readouterr().out
    assert [verb for verb in VERBS if verb not in text] == []


@pytest.mark.parametrize("verb", VERBS)
def test_help_of_a_verb_explains_every_option(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main([verb, "--help"])
    assert ended.value.code == 0
    text = capsys.readouterr().out
    assert text.startswith(f"usage: rtctl {verb}")
    actions = verb_parsers()[verb]._actions
    assert [action.dest for action in actions if not action.help] == []
    assert [option for action in actions for option in action.option_strings if option not in text] == []
    assert {"--quiet", "--json"} <= {option for action in actions for option in action.option_strings}


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert ended.value.code == 0
    assert capsys.readouterr().out == f"rtctl {__version__}\n"


@pytest.mark.parametrize("verb", VERBS)
def test_help_of_a_verb_has_two_examples_that_can_be_typed(
    verb: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main([verb, "--help"])
    _, _, text = capsys.readouterr().out.partition("examples:\n")
    examples = [line.strip() for line in text.splitlines() if line.strip()]
    assert len(examples) == 2
    for line in examples:
        words = shlex.split(line.partition(" >")[0])
        assert words[:2] == ["rtctl", verb]
        assert build_parser().parse_args(words[1:]).verb == verb
