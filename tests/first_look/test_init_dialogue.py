"""The dialogue of `rtctl init` in a real terminal: one question at a time, Enter takes the guess."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import signal
import subprocess
import sys
import termios
from pathlib import Path

import numpy as np
import pytest
from first_look_cases import motion, write_text

import rtctl
from rtctl.border.errors import InputError
from rtctl.cli.dialogue import ask_all
from rtctl.measured.proposal.proposal import Answers
from rtctl.measured.proposal.survey import survey_files

M = motion(600)
ENDS = ("] ", "? ")
"""How a prompt ends."""


def _hear_ctrl_c() -> None:
    """Make the pseudo-terminal the process's own, whose Ctrl-C is a signal, which a test runner may have ignored."""
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def talk(folder: Path, words: list[str], answers: list[str]) -> tuple[int, str]:
    """Run `rtctl init` on a pseudo-terminal, answer each prompt in turn; return exit code and all that was shown."""
    ours, theirs = pty.openpty()
    environment = {**os.environ, "TERM": "dumb", "COLUMNS": "160"}
    process = subprocess.Popen(
        [sys.executable, "-m", "rtctl", "init", *words], cwd=folder, env=environment, stdin=theirs, stdout=theirs,
        stderr=theirs, close_fds=True, start_new_session=True,
        preexec_fn=_hear_ctrl_c,
    )  # fmt: skip
    os.close(theirs)
    shown, since = "", ""
    waiting = list(answers)
    while True:
        ready, _, _ = select.select([ours], [], [], 60.0)
        if not ready:
            process.kill()
            process.wait()
            raise AssertionError(f"no answer for a minute, after: {shown}")
        try:
            piece = os.read(ours, 4096).decode()
        except OSError:  # the other end is closed
            break
        if not piece:
            break
        shown, since = shown + piece, since + piece
        if waiting and since.endswith(ENDS):
            os.write(ours, waiting.pop(0).encode())
            since = ""
    os.close(ours)
    assert waiting == [], shown
    return process.wait(), shown


@pytest.mark.wire
def test_a_person_says_what_0_dB_of_a_sweep_is(tmp_path: Path) -> None:
    f = np.linspace(90.0, 110.0, 41)
    z = 1e3 / (100.0**2 - f**2 + 2.5j * f)
    level = 20.0 * np.log10(np.abs(z))
    header = "Freq (Hz),Drive (V rms),Mag (dB),Phase (deg)"
    write_text(tmp_path / "r.csv", header + "\n", f, np.full(41, 0.5), level, np.rad2deg(np.angle(z)))
    # plant, drive, its unit, displacement, its unit (decibels of nothing, of 1 um), velocity, acceleration, test
    answers = ["\n", "\n", "\n", "\n", "dB\n", "dB re 1 um\n", "\n", "\n", "\n"]
    code, shown = talk(tmp_path, ["r.csv", "--no-plot"], answers)
    assert code == 0, shown
    record = rtctl.read_dataset(tmp_path / "dataset.toml").records[0]
    np.testing.assert_allclose(record.signals["drive"], 0.5 * np.sqrt(2.0))
    np.testing.assert_allclose(record.complex_amplitudes("displacement"), z, rtol=1e-5)


@pytest.mark.wire
def test_a_person_takes_the_guesses_by_enter_and_says_what_is_not_known(tmp_path: Path) -> None:
    write_text(tmp_path / "r.csv", "t,u,x\n", M.t, M.u, M.x)
    # plant, drive, its unit (nothing, nonsense, V), hold, displacement, its unit, time, its unit, test
    answers = ["\n", "\n", "\n", "blorp\n", "V\n", "\n", "\n", "mm\n", "\n", "\n", "\n"]
    code, shown = talk(tmp_path, ["r.csv", "--no-plot"], answers)
    assert code == 0, shown
    for words in (
        "What was measured (equations: a model of your own)? [oscillator]",
        "Which column is the time? (- for none) [t]",
        'In which unit does "t" count? [s]',
        "this cannot be guessed: an answer is needed",
        'unknown unit "blorp"',
        "Which column is the displacement? (- for none) [x]",
        "now run: rtctl diagnose dataset.toml --out answer",
    ):
        assert words in shown, shown
    dataset = rtctl.read_dataset(tmp_path / "dataset.toml")
    assert dataset.units == {"drive": "V", "displacement": "mm"}
    assert [record.use for record in dataset.records] == ["fit", "test"]


@pytest.mark.wire
def test_ctrl_c_and_the_end_of_input_leave_nothing(tmp_path: Path) -> None:
    path = write_text(tmp_path / "r.csv", "t,u,x\n", M.t, M.u, M.x)
    # a signal between the prompt and the reading of the answer is heard after the next line
    for last, code in (("\x03\n", 1), ("\x04", 2)):
        ended, shown = talk(tmp_path, ["r.csv"], ["\n", last])
        assert ended == code, shown
        assert "Traceback" not in shown
        assert list(tmp_path.iterdir()) == [path]


def asked(path: Path, answers: list[str], given: Answers | None = None) -> tuple[list[str], rtctl.Initiation]:
    """The prompts of a dialogue without a terminal, and what follows."""
    prompts: list[str] = []

    def ask(prompt: str) -> str:
        prompts.append(prompt)
        assert len(prompts) < 30, prompts  # a needed answer that is never given is asked for again
        return answers.pop(0) if answers else ""

    proposal = ask_all(survey_files([path]), given or Answers(), ask)
    from rtctl.api.first_look.initiation import write_proposal

    return prompts, write_proposal(proposal, path.parent / "new", plot=False)


def test_what_an_option_says_is_not_asked(tmp_path: Path) -> None:
    path = write_text(tmp_path / "r.csv", "t [s],u [V],x [mm]\n", M.t, M.u, M.x)
    prompts, found = asked(path, [], Answers(plant="oscillator", sample_rate_hz=500.0, time="-", test="none"))
    assert not [
        one for one in prompts if "measured?" in one or "time" in one or "rate" in one or "test" in one
    ]
    assert found.dataset.records[0].period_s == 2e-3


def test_another_column_than_the_guess_may_be_taken(tmp_path: Path) -> None:
    path = write_text(tmp_path / "r.csv", "t [s],u [V],x [mm],x2 [mm]\n", M.t, M.u, M.x, -M.x)
    prompts, found = asked(path, ["", "", "", "", "x2 [mm]"])
    guess = found.proposal.signal("displacement")
    assert guess is not None
    assert guess.column == "x2 [mm]"
    assert [one for one in prompts if one.startswith("Which column is the displacement?")] == [
        "Which column is the displacement? (- for none) "
    ]


def test_a_rate_is_asked_where_no_column_is_the_time(tmp_path: Path) -> None:
    path = write_text(tmp_path / "r.csv", "u [V],x [mm]\n", M.u, M.x)
    prompts, found = asked(path, ["", "", "", "", "", "", "a thousand", "1000 Hz"])
    assert [one for one in prompts if "rate" in one] == ["Sample rate in Hz? "] * 2 or prompts.count(
        "Sample rate in Hz? "
    ) == 1
    assert found.dataset.records[0].period_s == 1e-3


def test_the_end_of_input_is_told(tmp_path: Path) -> None:
    path = write_text(tmp_path / "r.csv", "u [V],x [mm]\n", M.u, M.x)

    def ended(prompt: str) -> str:
        raise EOFError

    with pytest.raises(InputError, match="nothing is written"):
        ask_all(survey_files([path]), Answers(), ended)


def test_a_column_in_g_is_not_offered_as_a_displacement(tmp_path: Path) -> None:
    path = write_text(
        tmp_path / "r.csv", "t [s],force [N],acc1 [g],acc2 [g]\n", M.t, M.u, M.a / 9806.65, M.v / 9806.65
    )
    # plant, time, its unit, drive, its unit, hold, acceleration
    prompts, found = asked(path, ["", "", "", "", "", "", "acc2"])
    assert not [one for one in prompts if "displacement" in one or "velocity" in one]
    guess = found.proposal.signal("acceleration")
    assert guess is not None
    assert (guess.column, guess.unit) == ("acc2 [g]", "g_0")


def test_questions_show_where_a_guess_comes_from_and_what_the_hold_means(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    head = "# fs = 1000 Hz\n# D/A output is a zero-order hold\nDA [V],acc [g]\n"
    prompts, found = asked(write_text(tmp_path / "r.txt", head, M.u, M.a / 9806.65), [])
    shown = capsys.readouterr().out
    for words in (
        "guess: DA [V] (by its unit)",
        'guess: V (its name has "V" in brackets)',
        'guess: g (its name has "g" in brackets, taken as standard gravity, 9.80665 m/s^2)',
        'guess: zero (by line 2 "# D/A output is a zero-order hold")',
        "half a sample",
        "anti-aliasing filter",
        'guess: 1000 (line 1 "# fs = 1000 Hz" of the file)',
    ):
        assert words in shown, shown
    assert not [one for one in prompts if "g_0" in one]
    text = found.path.read_text()
    assert "you said so" not in text
    assert "given" not in text
    assert found.dataset.holds == {"drive": "zero"}


def test_a_guess_that_is_taken_keeps_its_reason_and_an_answer_says_whose_it_is(tmp_path: Path) -> None:
    path = write_text(tmp_path / "r.csv", "Time/s,u,x [mm]\n", M.t, M.u, M.x)
    # plant, drive, its unit, hold, displacement, its unit, time
    _, found = asked(path, ["", "", "V", "zero", "x [mm]", "", "", ""])
    text = found.path.read_text()
    for line in (
        'column = "u"  # by its name',
        'unit = "V"  # given',
        'hold = "zero"  # you said so',
        'column = "x [mm]"  # you said so',
        'unit = "mm"  # its name has "mm" in brackets',
        'time = "Time/s"  # it increases, and its name says so; its name has "s" after a slash',
    ):
        assert line in text, text


def test_signals_and_hold_that_options_say_are_not_asked(tmp_path: Path) -> None:
    path = write_text(tmp_path / "r.csv", "t [s],u [V],x [mm]\n", M.t, M.u, M.x)
    said = Answers(inputs=("u:V",), outputs=("displacement=x",), hold="zero", time="t:s", test="none")
    prompts, found = asked(path, [], said)
    assert [one.partition("?")[0] for one in prompts] == [
        "What was measured (equations: a model of your own)",
        'In which unit is "x [mm]"',
    ]
    assert 'hold = "zero"  # you said so' in found.path.read_text()


def test_without_a_terminal_the_guesses_are_taken_and_that_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from rtctl.cli import main

    path = write_text(tmp_path / "r.csv", "t [s],u [V],x [mm]\n", M.t, M.u, M.x)
    for words, told in (([], True), (["--yes"], False), (["--quiet"], False), (["--json"], False)):
        assert main(["init", str(path), "--no-plot", "--force", *words]) == 0
        assert ("nothing is asked" in capsys.readouterr().err) == told


def test_the_question_about_a_unit_tells_of_a_scale_in_the_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_text(tmp_path / "r.csv", "t [s],u [V],x*1000 [m]\n", M.t, M.u, 1e3 * M.x)
    prompts, found = asked(
        path, ["", "", "", "um"], Answers(plant="oscillator", time="t [s]", test="none", hold="linear")
    )
    told = " ".join([*prompts, capsys.readouterr().out])
    assert 'In which unit is "x*1000 [m]"?' in told
    assert "the scale in its name" in told
    assert "--scale 'displacement=0.001 UNIT'" in told
    assert found.dataset.units["displacement"] in ("mm", "um")
