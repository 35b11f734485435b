"""What to ask a person, one question at a time, each with the guess as its default.

`next_question` is pure: it takes the proposal and what was answered so far; an answer changes `Answers`, from which a
new proposal follows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from rtctl.border.errors import InputError, nearest
from rtctl.measured.manifest.signal_kinds import measured_kinds
from rtctl.measured.proposal.between_rows.hold import HOLDS, SAID
from rtctl.measured.proposal.candidates import is_count
from rtctl.measured.proposal.given import NONE, find_column
from rtctl.measured.proposal.instants.time_base import homes_of, is_near, time_candidates
from rtctl.measured.proposal.naming.column_units import (
    AS_GRAVITY,
    MOTIONS,
    as_written,
    given_unit,
    quantity_of,
    read_column,
)
from rtctl.measured.proposal.own_equations.signals import read_model_signals
from rtctl.measured.proposal.parts import LAST_THIRD, NO_TEST
from rtctl.measured.proposal.proposal import Answers, Proposal, SignalGuess
from rtctl.measured.proposal.survey import Column, Survey
from rtctl.measured.stated_unit import stated_amplitude
from rtctl.measured.units import count_s
from rtctl.output.readable_units import readable

Settled = Callable[[Answers, str], Answers]


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """One question."""

    key: str
    text: str
    default: str
    """The guess, "" where there is none and an answer is needed."""
    why: str = ""
    """From what the guess comes; it stays in the manifest where a person takes it."""
    details: tuple[str, ...] = ()
    """What the answers mean and lead to, a line each."""
    choices: tuple[str, ...] = ()
    """What may be answered; empty: anything that `settle` takes."""
    settle: Settled
    """Returns the answers with this one; raises InputError in words."""

    def answered(self, answers: Answers, text: str) -> Answers:
        """Return the answers with `text`, or the default where it is empty. Raises InputError in words."""
        said = text.strip() or self.default
        if not said:
            raise InputError("this cannot be guessed: an answer is needed")
        if not self.choices:
            return self.settle(answers, said)
        chosen = find_column(said, self.choices)
        if chosen is None:
            raise InputError(f'"{said}" is none of them{nearest(said, self.choices)}')
        return self.settle(answers, chosen)


def next_question(proposal: Proposal, surveys: Sequence[Survey], asked: Sequence[str]) -> Question | None:
    """Return the next question that was not asked yet; None: all is said."""
    for question in _questions(proposal, surveys[0]):
        if question.key not in asked:
            return question
    return None


def _questions(proposal: Proposal, survey: Survey) -> list[Question]:
    questions = [_about_plant(proposal)]
    columns = {
        name: quantity_of(unit.text) if (unit := read_column(column).unit).text else ""
        for name, column in survey.numeric.items()
        if name != proposal.time.column and column.varies and not _counts(column)
    }
    questions += _about_own_signals(proposal, tuple(columns))
    for name, kind in proposal.kind.signals.items():
        questions += _about_signal(proposal, name, kind.role, columns)
    return [*questions, *_about_time(proposal, survey), _about_test(proposal)]


def _about_plant(proposal: Proposal) -> Question:
    return Question(
        key="plant", text="What was measured (equations: a model of your own)?", default=proposal.plant,
        why=proposal.plant_why, choices=tuple(measured_kinds()),
        settle=lambda answers, said: replace(answers, plant=said),
    )  # fmt: skip


def _about_own_signals(proposal: Proposal, columns: Sequence[str]) -> list[Question]:
    """Return the questions that give signals of equations their names: by a model file, or by the columns."""
    if not proposal.kind.free_signals or any(one.role == "output" for one in proposal.kind.signals.values()):
        return []
    listed = ", ".join(columns)
    return [
        Question(
            key="model", text="Which model file names the inputs and outputs? (- for none yet)", default=NONE,
            settle=lambda answers, said: (
                answers if said == NONE else replace(answers, model=read_model_signals(Path(said)))
            ),
        ),
        Question(
            key="inputs", text=f"Which are inputs, with commas between, - for none ({listed})?", default=NONE,
            settle=lambda answers, said: replace(answers, inputs=_listed(said)),
        ),
        Question(
            key="outputs", text=f"Which are outputs, with commas between ({listed})?", default="",
            settle=lambda answers, said: replace(answers, outputs=_listed(said)),
        ),
    ]  # fmt: skip


def _listed(said: str) -> tuple[str, ...]:
    return () if said == NONE else tuple(one.strip() for one in said.split(",") if one.strip())


def _about_time(proposal: Proposal, survey: Survey) -> list[Question]:
    """Return questions about the time column and its unit, or the rate; none where the file states its rate."""
    time = proposal.time
    if time.stated_hz is not None or time.is_frequency:
        return []
    homes = homes_of(survey, [one.column for one in proposal.signals])
    candidates = sorted(time_candidates(survey), key=lambda one: not is_near(survey.columns[one], homes))
    questions = []
    if candidates and (time.rate_hz is None or time.why != "you said so"):
        questions.append(Question(
            key="time", text="Which column is the time? (- for none)", default=time.column or NONE,
            why=time.why if time.column else "", choices=(*candidates, NONE),
            settle=lambda answers, said: replace(answers, time=said),
        ))  # fmt: skip
    if time.column is not None and time.unit is not None:
        needs = any(one.key == "time_unit" for one in proposal.opens)
        column = time.column
        questions.append(Question(
            key="time_unit", text=f'In which unit does "{column}" count?', default="" if needs else time.unit,
            why=time.why.removeprefix(f"{SAID}; "),
            settle=lambda answers, said: replace(answers, time=f"{column}:{_unit_of_time(said)}"),
        ))  # fmt: skip
    elif time.column is None:
        rate = "" if time.rate_hz is None else f"{time.rate_hz:.9g}"
        questions.append(
            Question(
                key="sample_rate_hz", text="Sample rate in Hz?", default=rate, why=time.why, settle=_with_rate
            )
        )
    return questions


def _about_signal(proposal: Proposal, name: str, role: str, columns: Mapping[str, str]) -> list[Question]:
    """Return the questions about a signal; `columns` that may be one, each with what its unit measures."""
    guess = proposal.signal(name)
    required = not proposal.kind.signals[name].optional
    needed = any(one.key == name for one in proposal.opens) or (required and guess is None)
    used = {one.column for one in proposal.signals if one.name != name and one.certain}
    others = {one for one in MOTIONS if one != name} if name in MOTIONS else set()
    free = tuple(one for one, quantity in columns.items() if one not in used and quantity not in others)
    if guess is not None and guess.column not in free:
        free = (guess.column, *free)
    if not free:
        return []
    default = guess.column if guess is not None else "" if needed else NONE
    may_lack = not required or (role == "input" and proposal.kind.may_be_released)
    none = " (- for none)" if may_lack else ""
    choices = (*free, NONE) if may_lack and NONE not in free else free
    text = f"Which column is the {name}?{none}"
    named = proposal.kind.free_signals and guess is not None and guess.certain
    questions = [] if named else [
        Question(key=name, text=text, default=default, choices=choices, why=guess.why if guess else "",
                 settle=lambda answers, said: _with_signal(answers, role, name, said, "")),
    ]  # fmt: skip
    if guess is not None and guess.constant is not None:
        return questions
    if guess is not None and guess.scale is None:
        column = guess.column
        questions.append(Question(
            key=f"unit.{name}", text=f'In which unit is "{column}"?', default=as_written(guess.unit),
            why=_why_unit(guess), details=_doubts_about(proposal, f"unit.{name}"),
            settle=lambda answers, said: _with_signal(
                answers, role, name, column, _unit(said, name, swept=proposal.time.is_frequency)
            ),
        ))  # fmt: skip
    if guess is not None and role == "input" and not proposal.time.is_frequency:
        questions.append(Question(
            key=f"hold.{name}",
            text=f"How does the {name} go on between its rows?", details=_about_holds(proposal),
            default=guess.hold or "linear", why=guess.hold_why, choices=HOLDS,
            settle=lambda answers, said: replace(answers, hold=said),
        ))  # fmt: skip
    return questions


def _doubts_about(proposal: Proposal, key: str) -> tuple[str, ...]:
    """Return why something must be asked, with the option that settles it otherwise."""
    return tuple(
        f"{one.text}: {one.option}" for one in proposal.opens if one.key == key and " or " in one.option
    )


def _why_unit(guess: SignalGuess) -> str:
    gravity = f", {AS_GRAVITY}" if guess.unit == "g_0" else ""
    return f"{guess.unit_source}{gravity}" if guess.unit_source else ""


def _about_holds(proposal: Proposal) -> tuple[str, ...]:
    """Return what each hold means, and what a wrong one leads to."""
    rate_hz = proposal.time.rate_hz or proposal.time.stated_hz or proposal.records[0].rate_hz
    half = f" ({readable(0.5 / rate_hz, 's')})" if rate_hz else ""
    return (
        "linear: on a straight line to the next row, as a force or a current that was measured",
        "zero: each value stays until the next row, as a D/A converter puts it out",
        "band-limited: on the smooth curve through the rows, as a signal that was measured behind an anti-aliasing "
        "filter",
        f"zero instead of linear makes the drive half a sample{half} later: the wrong one looks like a delay of the "
        "device",
    )


def _counts(column: Column) -> bool:
    return column.values is not None and is_count(column.values)


def _about_test(proposal: Proposal) -> Question:
    files, tests = proposal.labels(), proposal.labels("test")
    if len(files) == 1:
        default = LAST_THIRD if tests else NO_TEST
        return Question(
            key="test", text="Which part may no fit use, to test the model?", default=default,
            choices=(LAST_THIRD, NO_TEST), settle=lambda answers, said: replace(answers, test=said),
        )  # fmt: skip
    guess = ", ".join(tests) or NO_TEST
    choices = tuple(dict.fromkeys((guess, *files, NO_TEST)))
    return Question(
        key="test", text=f"Which {_what(proposal)} may no fit use, to test the model?", default=guess, choices=choices,
        settle=lambda answers, said: answers if said == guess else replace(answers, test=said),
    )  # fmt: skip


def _what(proposal: Proposal) -> str:
    return "group" if any(one.group for one in proposal.records) else "file"


def _with_rate(answers: Answers, said: str) -> Answers:
    try:
        rate = float(said.lower().removesuffix("hz"))
    except ValueError:
        raise InputError(f'"{said}" is no number of Hz; write one such as 1000') from None
    return replace(answers, time=NONE, sample_rate_hz=rate)


def _with_signal(answers: Answers, role: str, name: str, column: str, unit: str) -> Answers:
    """Return the answers with a signal's column and unit in the place of what was said of it before."""
    text = f"{name}={column}{f':{unit}' if unit else ''}"
    others = [
        one
        for one in (answers.inputs if role == "input" else answers.outputs)
        if one.partition("=")[0] != name and one != column and not one.startswith(f"{column}:")
    ]
    if role == "input":
        return replace(answers, inputs=(*others, text))
    return replace(answers, outputs=(*others, text))


def _unit(said: str, name: str, *, swept: bool) -> str:
    """Return a unit that a person says; of a sweep also one of amplitudes, such as "dB re 1 um"."""
    try:
        if swept and (amplitude := stated_amplitude(said)) is not None and amplitude.unit:
            return said
        return given_unit(said, name).text
    except ValueError as error:
        raise InputError(f"{error}") from None


def _unit_of_time(said: str) -> str:
    try:
        count_s(said)
    except ValueError as error:
        raise InputError(f"{error}") from None
    return said
