"""The questions of `rtctl init` in a terminal: one at a time, Enter takes the guess."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence

from rtctl.border.errors import InputError
from rtctl.measured.proposal.asking.questions import Question, next_question
from rtctl.measured.proposal.asking.taken_guesses import with_reasons
from rtctl.measured.proposal.proposal import Answers, Proposal
from rtctl.measured.proposal.propose import propose
from rtctl.measured.proposal.survey import Survey

Ask = Callable[[str], str]
MOST_SHOWN = 12
"""Choices that a question lists."""


def is_terminal() -> bool:
    """Return whether a person can be asked."""
    return sys.stdin.isatty() and sys.stdout.isatty()


def ask_all(surveys: Sequence[Survey], answers: Answers, ask: Ask = input) -> Proposal:
    """Ask what the options did not say, and return the proposal that follows. Raises InputError."""
    asked = _said(answers, propose(surveys, answers))
    reasons: dict[str, str] = {}
    print("Enter takes the guess in brackets; Ctrl-C ends without writing anything.")
    while True:
        proposal = propose(surveys, answers)
        question = next_question(proposal, surveys, asked)
        if question is None:
            return with_reasons(proposal, reasons)
        answers, taken = _ask(question, answers, surveys, ask)
        if taken and question.why:
            reasons[question.key] = question.why
        asked.append(question.key)


def _ask(question: Question, answers: Answers, surveys: Sequence[Survey], ask: Ask) -> tuple[Answers, bool]:
    """Ask until the answer can be used; return the answers with it, and whether it is the guess, by Enter."""
    for line in question.details:
        print(f"  {line}")
    listed = ", ".join(question.choices[:MOST_SHOWN])
    if listed and len(question.choices) > 1:
        print(f"  ({listed}{', ...' if len(question.choices) > MOST_SHOWN else ''})")
    if question.default and question.why:
        print(f"  guess: {question.default} ({question.why})")
    prompt = f"{question.text} [{question.default}] " if question.default else f"{question.text} "
    while True:
        try:
            text = ask(prompt)
        except EOFError:
            raise InputError("the questions ended before all was said; nothing is written") from None
        try:
            answered = question.answered(answers, text)
            propose(surveys, answered)
        except InputError as error:
            print(f"  {error}")
            continue
        return answered, not text.strip()


def _said(answers: Answers, proposal: Proposal) -> list[str]:
    """Return the keys of what the options say already, with `proposal` what follows from them alone."""
    inputs = [one for one in proposal.signals if one.role == "input"]
    signals = {one.name: one.certain for one in proposal.signals}
    units = {f"unit.{one.name}": one.unit_source == "given" for one in proposal.signals}
    holds = {f"hold.{one.name}": answers.hold is not None for one in inputs}
    known = {
        "plant": answers.plant is not None,
        "time": answers.time is not None or answers.sample_rate_hz is not None,
        "time_unit": answers.time is not None and ":" in answers.time,
        "sample_rate_hz": answers.sample_rate_hz is not None,
        "test": answers.test is not None,
        **signals, **units, **holds,
    }  # fmt: skip
    return [key for key, told in known.items() if told]
