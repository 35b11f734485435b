"""Files that were surveyed, and what the user said, to a proposed manifest. Pure: nothing is read, asked or written."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from rtctl.border.errors import InputError
from rtctl.measured.manifest.signal_kinds import measured_kinds
from rtctl.measured.proposal.aligned import aligned
from rtctl.measured.proposal.candidates import (
    Candidate,
    find_candidates,
    find_silent,
    lost_counts,
)
from rtctl.measured.proposal.given import Given, check_plant, given_signals
from rtctl.measured.proposal.instants.stamps import judge_stamps
from rtctl.measured.proposal.instants.time_base import find_time, homes_of
from rtctl.measured.proposal.instants.told_rate import told_rate_hz
from rtctl.measured.proposal.naming.column_units import (
    told_logarithm,
)
from rtctl.measured.proposal.naming.own_recording import without_computed
from rtctl.measured.proposal.own_equations.roles import assign_named_roles
from rtctl.measured.proposal.own_equations.signals import with_named_signals, with_signals
from rtctl.measured.proposal.parts import NO_TEST, called, find_parts, propose_records
from rtctl.measured.proposal.proposal import (
    NO_SIGNAL,
    Answers,
    Proposal,
    RecordGuess,
    SignalGuess,
    TimeGuess,
)
from rtctl.measured.proposal.roles import Roles, assign_roles
from rtctl.measured.proposal.signal_tables import propose_signals
from rtctl.measured.proposal.survey import Survey
from rtctl.measured.proposal.swept.sweeps import find_sweep, propose_sweeps
from rtctl.measured.proposal.uses.staircases import Use, doubts_about_uses, look_at_staircase, propose_uses
from rtctl.registry import PlantKind, plant_kind

NO_STAIRCASE = (
    "current: no quasi-static staircase, which rtctl identify needs of a vo2 (acquire_vo2 plays one)"
)


def propose(surveys: Sequence[Survey], answers: Answers) -> Proposal:
    """Return what the files probably hold. Raises InputError where the user's word contradicts them."""
    if surveys and (swept := find_sweep(surveys[0], answers)) is not None:
        return propose_sweeps(swept, surveys, answers)
    time = find_time(surveys, answers)
    found = _columns(surveys, answers, time.guess)
    homes = homes_of(surveys[0], [one.column for one in found.roles.chosen.values()])
    if homes:
        before = time.guess.column
        time = find_time(surveys, answers, homes)  # of the group that the signals are in, not of another one
        if time.guess.column != before:
            found = _columns(surveys, answers, time.guess)
    candidates, unused, kind, given, roles, answers, plant, plant_why = found
    signals, unit_opens, unsure = propose_signals(surveys[0], kind, roles, given, answers)
    needed = [one for one in signals if not kind.signals[one.name].optional and one.constant is None]
    _check_common(surveys, needed, time.guess)
    records, time_guess, record_notes = _records(surveys, signals, time.guess, answers, plant)
    return Proposal(
        name=answers.name or _name_of(surveys),
        plant=plant,
        plant_why=plant_why,
        kind=kind,
        model=None if answers.model is None else answers.model.path,
        signals=signals,
        time=time_guess,
        records=records,
        unused=_without_used(unused, signals) | _leftovers(candidates, signals, roles, kind),
        opens=(*time.opens, *roles.opens, *unit_opens),
        unsure=(*_remarks(surveys), *time.unsure, *roles.unsure, *unsure, *record_notes),
    )


def _without_used(unused: Mapping[str, str], signals: Sequence[SignalGuess]) -> dict[str, str]:
    """Return the columns that look like no signal, without one that the user named as one all the same."""
    used = {one.column for one in signals}
    return {name: why for name, why in unused.items() if name not in used}


class _Found(NamedTuple):
    """Columns of the signals, for one choice of the time."""

    candidates: dict[str, Candidate]
    unused: dict[str, str]
    kind: PlantKind
    given: dict[str, Given]
    roles: Roles
    answers: Answers
    plant: str
    plant_why: str


def _columns(surveys: Sequence[Survey], answers: Answers, time: TimeGuess) -> _Found:
    """Return the columns of the signals where `time` is the time."""
    of_equations = _has_free_signals(answers)
    candidates, unused = find_candidates(surveys, [time.column], named_logarithms=of_equations)
    plant, plant_why = _plant(answers, candidates)
    kind = _with_named_input(plant_kind(plant), answers)
    if kind.free_signals:
        if answers.model is None:
            answers = with_named_signals(answers, surveys[0].columns)
        kind = with_signals(kind, answers)
    given = given_signals(answers, kind.signals, surveys[0].columns)
    _check_given(given, surveys[0], named_logarithms=of_equations)
    candidates, computed = without_computed(surveys[0], candidates, kind.signals)
    roles = (
        assign_named_roles(candidates, kind, given, answers)
        if kind.free_signals
        else assign_roles(
            candidates, kind, given, find_silent(surveys, [time.column]), _constant(surveys[0], unused)
        )
    )
    if not (kind.free_signals or roles.undriven):
        _check_two_signals(surveys[0], time)
    return _Found(candidates, unused | computed, kind, given, roles, answers, plant, plant_why)


def _constant(survey: Survey, unused: Mapping[str, str]) -> list[str]:
    """Return the columns of one number throughout."""
    columns = [survey.columns[name] for name in unused]
    return [one.name for one in columns if one.values is not None and one.rows > 1 and not one.varies]


def _with_named_input(kind: PlantKind, answers: Answers) -> PlantKind:
    """Return the kind of plant with its own signals, and those that stand for them where the user names these."""
    named = {text.partition("=")[0].strip() for text in answers.inputs}
    instead = {one.stands_for: name for name, one in kind.signals.items() if one.stands_for and name in named}
    signals = {
        instead.get(name, name): kind.signals[instead.get(name, name)]
        for name in kind.without_stand_ins().signals
    }
    return replace(kind, signals=signals)


def _has_free_signals(answers: Answers) -> bool:
    """Return whether the user named a kind of plant whose signals are those of his model."""
    if answers.plant is not None:
        check_plant(answers.plant)
        return plant_kind(answers.plant).free_signals
    return answers.model is not None and plant_kind(answers.model.plant).free_signals


def _plant(answers: Answers, candidates: Mapping[str, Candidate]) -> tuple[str, str]:
    if answers.plant is not None:
        check_plant(answers.plant)
        return answers.plant, "you said so"
    if answers.model is not None:
        return answers.model.plant, f"the kind of {answers.model.path.name}"
    known = measured_kinds()
    votes = [one.reading.votes for one in candidates.values()]
    if (
        "vo2" in known
        and any("resistance" in one for one in votes)
        and any("current" in one for one in votes)
    ):
        return "vo2", "a current and a resistance"
    return "oscillator", "a drive and a motion"


def _check_two_signals(survey: Survey, time: TimeGuess) -> None:
    """Raise InputError for a file that has one signal beside its time: of a drive or of a response alone."""
    signals = [name for name in survey.numeric if name != time.column]
    others = [one for name, one in survey.columns.items() if name not in signals and name != time.column]
    if len(signals) == 1 and not others:
        raise InputError(
            f'{survey.path}: has one signal, "{signals[0]}", beside its time "{time.column}"; a drive and a '
            "response are needed, in one file: export both channels together. Of a release without any drive: say "
            "--input -"
        )


def _check_given(given: Mapping[str, Given], survey: Survey, *, named_logarithms: bool) -> None:
    for signal, one in given.items():
        column = survey.columns.get(one.column)
        if column is not None and column.values is None:
            raise InputError(f'{survey.path}: column "{one.column}", given as the {signal}, {column.refusal}')
        if column is not None and (logarithm := told_logarithm(column, named=not named_logarithms)):
            raise InputError(f'{survey.path}: column "{one.column}", given as the {signal}, {logarithm}')


def _check_common(surveys: Sequence[Survey], needed: Sequence[SignalGuess], time: TimeGuess) -> None:
    """Raise InputError where a file lacks a column that the first one gives."""
    names = [*(one.column for one in needed), *([time.column] if time.column else [])]
    lines = []
    for survey in surveys[1:]:
        missing = [name for name in names if name not in survey.columns]
        if missing:
            lines.append(
                f"{survey.path}{_of_group(survey)}: has no column {', '.join(f'{one!r}' for one in missing)}, as "
                f"{surveys[0].path} has; it has {', '.join(list(survey.columns)[:8])}. "
                "Files of one dataset have the same columns: give the "
                "others a dataset of their own, with --out"
            )
    if lines:
        raise InputError("\n".join(lines))


def _records(
    surveys: Sequence[Survey], signals: Sequence[SignalGuess], time: TimeGuess, answers: Answers, plant: str
) -> tuple[tuple[RecordGuess, ...], TimeGuess, list[str]]:
    """Return the records of all files, the time with its resampling, and what should be looked at."""
    parts, notes, stamps, read = [], [], [], []
    for survey in surveys:
        columns = [one.column for one in signals if one.column in survey.columns]
        try:
            read.append(aligned(survey, columns, time))
            rows, cut = find_parts(read[-1], columns, time)
            stamps.append(judge_stamps(read[-1], rows, time))
        except ValueError as error:
            raise InputError(f"{survey.path}{_of_group(survey)}: {error}") from None
        parts.append(rows)
        notes += [f"{survey.path.name}{_of_group(survey)}: {cut}"] if cut else []
    uneven = next((one.uneven for one in stamps if one.uneven), "")
    rounded = "" if uneven else next((one.rounded for one in stamps if one.rounded), "")
    if uneven:
        notes.append(f'time: "{time.column}" is not uniform ({uneven}): it is resampled')
    if rounded:
        rounded = f'"{time.column}": {rounded}'
    rates = [
        one.rate_hz if rounded else told_rate_hz(survey) for one, survey in zip(stamps, read, strict=True)
    ]
    uses = _uses(read, signals, plant)
    records = propose_records(read, parts, rates, answers.test, uses)
    if plant == "vo2" and not any(one.use == "identify" for one in records):
        notes.append(NO_STAIRCASE)
    elif plant == "vo2":
        told = list(dict.fromkeys((one.group or one.file.name, Use(one.use, one.why)) for one in records))
        notes += doubts_about_uses(told, tested=answers.test != NO_TEST)
    return records, replace(time, resample=bool(uneven), rounded=rounded), notes


def _uses(surveys: Sequence[Survey], signals: Sequence[SignalGuess], plant: str) -> list[Use]:
    """Return what each file is for but for tests: of a vo2 its staircases are identified, else everything is fitted."""
    columns = {one.name: one.column for one in signals}
    if plant != "vo2" or "current" not in columns:
        return [Use("fit", "")] * len(surveys)
    shown = [look_at_staircase(one, columns["current"], columns.get("resistance")) for one in surveys]
    return propose_uses(shown, [called(one) for one in surveys])


def _of_group(survey: Survey) -> str:
    return "" if survey.group is None else f', group "{survey.group}"'


def _leftovers(
    candidates: Mapping[str, Candidate], signals: Sequence[SignalGuess], roles: Roles, kind: PlantKind
) -> dict[str, str]:
    """Return the columns that could be signals and are none, with the reason."""
    used = {one.column: one.name for one in signals}
    taken = {one.name: f'the {one.name} is column "{one.column}"' for one in signals} | roles.undriven
    found = {}
    for name, candidate in candidates.items():
        if name not in used:
            best = candidate.best(kind.signals)
            found[name] = roles.left_out.get(name, taken.get(best, NO_SIGNAL))
    return found


def _remarks(surveys: Sequence[Survey]) -> list[str]:
    remarks = [f"{survey.path.name}: {remark}" for survey in surveys for remark in survey.remarks]
    remarks += [text for survey in surveys for text in _about_lost_rows(survey)]
    groups: dict[str, list[str]] = {}
    for survey in surveys:
        if survey.group is not None:
            groups.setdefault(survey.path.name, []).append(survey.group)
    return remarks + [
        f"{file}: its groups with the same columns are taken as its records: {', '.join(names)}"
        for file, names in groups.items()
    ]


def _about_lost_rows(survey: Survey) -> Iterator[str]:
    """Yield what columns that count the rows say of rows that are not there."""
    for name, column in survey.numeric.items():
        lost, row = (0, 0) if column.values is None else lost_counts(column.values)
        if lost:
            yield (
                f'{survey.path.name}: "{name}" counts the rows and misses {lost}, first before row {row} (counted from '
                "0): rows were lost there, and what is left is taken for one piece; divide the record there, in the "
                f"manifest: rows = [0, {row}] and rows = [{row}, {column.rows}]"
            )


def _name_of(surveys: Sequence[Survey]) -> str:
    first = surveys[0].path.resolve()
    return (
        first.name.partition(".")[0]
        if len({one.path for one in surveys}) == 1
        else first.parent.name or first.name
    )
