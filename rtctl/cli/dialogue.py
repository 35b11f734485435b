"""The questions of `rtctl init` in a terminal: one at a time, Enter takes the guess."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence

from rtctl.border.errors import InputError
from rtctl.measured.proposal.proposal import Answers, Proposal
from rtctl.measured.proposal.propose import propose
from rtctl.measured.proposal.questions import Question, next_question
from rtctl.measured.proposal.survey import Survey

Ask = Callable[[str], str]
MOST_SHOWN = 12
"""Choices that a question lists."""


def is_terminal() -> bool:
    """Return whether a person can be asked."""
    return sys.stdin.isatty() and sys.stdout.isatty()


def ask_all(surveys: Sequence[Survey], answers: Answers, ask: Ask = input) -> Proposal:
    """Ask what the options did not say, and return the proposal that follows. Raises InputError."""
    asked = _said(answers)
    print("Enter takes the guess in brackets; Ctrl-C ends without writing anything.")
    while True:
        proposal = propose(surveys, answers)
        question = next_question(proposal, surveys, asked)
        if question is None:
            return proposal
        answers = _ask(question, answers, surveys, ask)
        asked.append(question.key)


def _ask(question: Question, answers: Answers, surveys: Sequence[Survey], ask: Ask) -> Answers:
    """Ask until the answer can be used, with the answers so far."""
    listed = ", ".join(question.choices[:MOST_SHOWN])
    if listed and len(question.choices) > 1:
        print(f"  ({listed}{', ...' if len(question.choices) > MOST_SHOWN else ''})")
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
        return answered


def _said(answers: Answers) -> list[str]:
    """Return the keys of what the options say already."""
    known = {
        "plant": answers.plant is not None,
        "time": answers.time is not None or answers.sample_rate_hz is not None,
        "time_unit": answers.time is not None and ":" in answers.time,
        "sample_rate_hz": answers.sample_rate_hz is not None,
        "test": answers.test is not None,
    }
    return [key for key, told in known.items() if told]
