"""A mechanism that nobody knows is told at once, before minutes of identification, and leaves no files."""

from __future__ import annotations

from pathlib import Path

import pytest
from diagnosis_cases import device, measured, noise_drive, write_case

from rtctl.cli import main


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ("friction.stick", 'there is no mechanism "friction.stick"; did you mean "friction.stribeck"'),
        (" , ", "mechanisms: name one at least"),
    ],
)
def test_an_unknown_mechanism_is_told_before_the_identification(
    asked: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drive = noise_drive(1)
    manifest = write_case(tmp_path, [(drive, measured(device(), drive), "fit")])
    out = tmp_path / "answer"
    assert main(["diagnose", str(manifest), "--mechanisms", asked, "--out", str(out)]) != 0
    heard = capsys.readouterr()
    assert said in heard.err
    assert "identify" not in heard.out + heard.err
    assert not list(out.glob("*"))
