"""A bar and a line appear for a person who watches, and nothing for a script."""

from __future__ import annotations

import subprocess
import sys

import pytest

from rtctl.output.progress import progress_bar, say


def test_no_bar_where_nobody_watches(capfd: pytest.CaptureFixture[str]) -> None:
    with progress_bar("sweep", 3, quiet=False) as advance:
        advance(3)
    assert capfd.readouterr() == ("", "")


def test_a_bar_on_standard_error_that_counts_to_the_end(capfd: pytest.CaptureFixture[str]) -> None:
    with progress_bar("sweep", 4, quiet=False, forced=True) as advance:
        advance(4)
    shown = capfd.readouterr()
    assert "sweep" in shown.err
    assert "100%" in shown.err
    assert shown.out == ""


def test_quiet_wins_over_forced(capfd: pytest.CaptureFixture[str]) -> None:
    with progress_bar("sweep", 4, quiet=True, forced=True) as advance:
        advance(4)
    assert capfd.readouterr() == ("", "")


def test_a_failure_inside_passes_through_the_bar() -> None:
    with pytest.raises(KeyboardInterrupt), progress_bar("sweep", 4, quiet=False, forced=True):
        raise KeyboardInterrupt


@pytest.mark.parametrize(("quiet", "shown"), [(False, "wrote it\n"), (True, "")])
def test_lines_go_to_standard_error_unless_quiet(
    capfd: pytest.CaptureFixture[str], quiet: bool, shown: str
) -> None:
    say("wrote it", quiet=quiet)
    assert capfd.readouterr() == ("", shown)


def test_importing_progress_does_not_import_rich() -> None:
    code = "import sys, rtctl.output.progress; print('rich' in sys.modules)"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "False"
