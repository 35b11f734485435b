"""Files that hold sweeps of frequencies to a proposed manifest: recognised by a column of frequencies and two parts.

The parts are in phase and quadrature, or amplitude and phase, by the names of their columns. What no file tells, a unit
or the amplitude of the drive, is refused with what to do: it is never guessed.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rtctl.border.arrays import FloatArray
from rtctl.border.errors import InputError
from rtctl.measured.amplitude_unit import AmplitudeUnit, without_convention
from rtctl.measured.proposal.given import Given, given_signals
from rtctl.measured.proposal.instants.told_rate import is_rate_unit
from rtctl.measured.proposal.naming.column_names import bare_name, base_name
from rtctl.measured.proposal.naming.column_units import (
    MOTIONS,
    amplitude_of,
    is_in_decibels,
    quantity_of,
    read_column,
    unit_of_amplitude,
)
from rtctl.measured.proposal.proposal import Answers, Open, Proposal, RecordGuess, SignalGuess, TimeGuess
from rtctl.measured.proposal.survey import Survey
from rtctl.measured.proposal.swept.drive_level import DriveLevel, doubts_about_levels, find_levels, in_unit
from rtctl.measured.records.sweep_reading import LEAST_ROWS
from rtctl.measured.stated_unit import stated_amplitude
from rtctl.measured.units import is_angular, same_unit
from rtctl.registry import plant_kind

FREQUENCY = re.compile(r"f|freq\w*|frequenz\w*|f_?drive|drive_?freq\w*", re.IGNORECASE)
PAIRS = (
    ("in_phase", r"x|i|re|real|in.?phase", "quadrature", r"y|q|im|imag|imaginary|quad|quadrature"),
    ("amplitude", r"r|a|amp\w*|mag\w*|abs|modulus", "phase", r"phase|theta|phi|ang|angle|arg"),
)
"""Keys of the manifest with the names that their columns have, or with which these end."""
NO_COLUMN = "drive"
"""Column of a drive whose amplitude no column has."""
MOST_RADIANS = 2.0 * np.pi + 0.1
"""Phase beyond which it is in degrees."""
NO_AMPLITUDE = (
    'a sweep of frequencies (frequency "{0}", {1} "{2}", {3} "{4}"): nobody tells the amplitude of the drive, no '
    "column, no line above the columns and no name of a file, and the response is in {5}, not per drive. Say it with "
    '--drive-amplitude "20 mV" (or "20 mV rms"), of files with different drives in their names: sweep_020mV.csv'
)


class SweepColumns(NamedTuple):
    """Columns of a sweep: its frequencies, and the keys and columns of the two parts of its response."""

    frequency: str
    parts: dict[str, str]


def find_sweep(survey: Survey, answers: Answers) -> SweepColumns | None:
    """Return the columns of a sweep; None: the file is none, or the user said what its time is."""
    plant = answers.plant or (answers.model.plant if answers.model else None)
    if answers.sample_rate_hz is not None or answers.time is not None or plant not in (None, "oscillator"):
        return None
    numeric = list(survey.numeric)
    frequency = next((name for name in numeric if _is_frequency(survey, name)), None)
    if frequency is None:
        return None
    others = [name for name in numeric if name != frequency]
    for first_key, first, second_key, second in PAIRS:
        parts = [_called(others, first), _called(others, second)]
        if parts[0] is not None and parts[1] is not None and parts[0] != parts[1]:
            return SweepColumns(frequency, {first_key: parts[0], second_key: parts[1]})
    _check_has_phase(survey, frequency, others)
    return None


def _check_has_phase(survey: Survey, frequency: str, others: Sequence[str]) -> None:
    """Raise InputError for amplitudes over a frequency without their phase, in a file that has no time."""
    amplitude = _called(others, PAIRS[1][1]) or next(
        (name for name in others if is_in_decibels(survey.columns[name])), None
    )
    if amplitude is None or _has_time(survey):
        return
    raise InputError(
        f'{survey.path}: a sweep of frequencies (frequency "{frequency}", amplitude "{amplitude}") without a phase: '
        "an amplitude alone has no parts in phase and in quadrature; export the phase against the drive as a column "
        'beside it, such as "Phase (deg)"'
    )


def propose_sweeps(columns: SweepColumns, surveys: Sequence[Survey], answers: Answers) -> Proposal:
    """Return what files of sweeps hold. Raises InputError where nobody tells the amplitude of the drive."""
    survey = surveys[0]
    if answers.scales:
        raise InputError(
            f"--scale {answers.scales[0]}: {survey.path} holds a sweep of frequencies, in whose manifest scale "
            "and unit are written by hand: leave out --scale"
        )
    kind = plant_kind("oscillator").without_stand_ins()
    given = given_signals(answers, kind.signals, survey.columns)
    name, unit, source, drive_unit = _response(columns, survey, given)
    drive = None if answers.drive_amplitude else _drive(columns, survey, given, drive_unit)
    levels = None
    if drive is None or drive.column == NO_COLUMN:
        levels = find_levels(surveys, answers.drive_amplitude)
        levels = in_unit(levels, drive_unit) if drive_unit else levels
        drive = _drive_at(levels) if levels else drive
    first, second = columns.parts.items()
    if drive is None:
        raise InputError(
            f"{survey.path}: " + NO_AMPLITUDE.format(columns.frequency, *first, *second, unit or "no unit")
        )
    keys, unsure = _keys(columns, survey, per_drive=bool(drive_unit))
    amplitude = _amplitude(survey, first[1], given.get(name))
    response = SignalGuess(
        name=name, role="output", column=first[1], why="a sweep of frequencies, by the names of its columns",
        unit=unit, unit_source=source, keys=keys, amplitude_unit=_written(amplitude),
    )  # fmt: skip
    if levels:
        unsure = (*unsure, *doubts_about_levels(levels))
    elif not drive_unit:
        unsure = (*unsure, *_doubts_about_peaks(survey, drive, response, amplitude))
    opens = [
        Open(f"unit.{one.name}", _unknown_unit(one), f"--{one.role} {shlex.quote(text)}")
        for one, text in (
            (drive, f"{drive.column}:{_example(drive, 'UNIT')}"),
            (response, f"{name}={first[1]}:{_example(response, 'UNIT')}"),
        )
        if not one.unit
    ]
    return Proposal(
        name=answers.name or survey.path.name.partition(".")[0],
        plant="oscillator",
        plant_why="a response over frequency",
        kind=kind,
        model=None if answers.model is None else answers.model.path,
        signals=(drive, response),
        time=TimeGuess(
            column=columns.frequency, unit=read_column(survey.columns[columns.frequency]).unit.text or None,
            why="frequencies, by name and unit", is_frequency=True,
        ),
        records=_records(columns, surveys, answers, levels),
        opens=tuple(opens),
        unsure=unsure,
    )  # fmt: skip


def _is_frequency(survey: Survey, name: str) -> bool:
    column = survey.columns[name]
    values = column.values
    if (
        values is None
        or len(values) < LEAST_ROWS
        or not np.isfinite(values).all()
        or not (values > 0.0).all()
    ):
        return False
    unit = read_column(column).unit.text
    by_unit = unit in ("Hz", "kHz", "MHz") or (_is_angular(unit) and not _has_time(survey))
    return (by_unit or (not unit and FREQUENCY.fullmatch(bare_name(name)) is not None)) and _runs(
        values
    ) != []


def _is_angular(unit: str) -> bool:
    return bool(unit) and is_rate_unit(unit) and is_angular(unit)


def _has_time(survey: Survey) -> bool:
    return any("time" in read_column(column).votes for column in survey.numeric.values())


def _runs(frequency: FloatArray) -> list[tuple[int, int]]:
    """Return the rows [first, end) of each rising or falling run; [] where a run is too short to be a sweep."""
    way = np.sign(np.diff(frequency))
    turned, stayed = np.flatnonzero(way[1:] * way[:-1] < 0.0) + 2, np.flatnonzero(way == 0.0) + 1
    edges = [0, *np.union1d(turned, stayed).tolist(), len(frequency)]
    runs = list(zip(edges[:-1], edges[1:], strict=True))
    return runs if all(end - first >= LEAST_ROWS for first, end in runs) else []


def _called(names: Sequence[str], pattern: str) -> str | None:
    """Return the column that is called so, or whose name ends so after a blank or an underscore."""
    bare = {name: without_convention(base_name(name)) for name in names}
    whole = [name for name in names if re.fullmatch(pattern, bare[name], re.IGNORECASE)]
    ends = [name for name in names if re.search(rf"(?:^|[ _.])(?:{pattern})$", bare[name], re.IGNORECASE)]
    return next(iter([*whole, *ends]), None)


def _amplitude(survey: Survey, column: str, given: Given | None) -> AmplitudeUnit | None:
    """Return what the amplitudes in a column are: what the user says, else what the file states; None: a plain unit."""
    said = stated_amplitude(given.unit) if given is not None and given.unit else None
    return said or (amplitude_of(survey.columns[column]) if column in survey.columns else None)


def _written(amplitude: AmplitudeUnit | None) -> str:
    """Return the key `amplitude_unit`; "" for peak values in the signal's unit."""
    plain = amplitude is None or (not amplitude.is_level and amplitude.convention in ("", "peak"))
    return "" if amplitude is None or plain else amplitude.text


def _unknown_unit(one: SignalGuess) -> str:
    if one.amplitude_unit:
        return f'column "{one.column}" is in decibels, and nobody tells what 0 dB is'
    return f'nobody states the unit of column "{one.column}"'


def _example(one: SignalGuess, otherwise: str) -> str:
    return f"dB re 1 {'um' if one.role == 'output' else 'V'}" if one.amplitude_unit else otherwise


def _doubts_about_peaks(
    survey: Survey, drive: SignalGuess, response: SignalGuess, amplitude: AmplitudeUnit | None
) -> list[str]:
    """Return doubts about peak and RMS values, where one column states which it has or decibels leave it open."""
    of_drive = amplitude_of(survey.columns[drive.column]) if drive.column in survey.columns else None
    told = [one is not None and one.convention != "" for one in (of_drive, amplitude)]
    is_level = [one is not None and one.is_level for one in (of_drive, amplitude)]
    if all(told) or not any((*told, *is_level)):
        return []
    return [
        f'{one.name}: nobody states whether "{one.column}" has peak or RMS values: taken as peak values; else add '
        f'" rms" to its amplitude_unit'
        for one, known in ((drive, told[0]), (response, told[1]))
        if not known and one.column in survey.columns
    ]


def _response(columns: SweepColumns, survey: Survey, given: dict[str, Given]) -> tuple[str, str, str, str]:
    """Return signal, unit and its source, and the unit of the drive where the response is per drive."""
    column = survey.columns[next(iter(columns.parts.values()))]
    name, said = next(((name, one) for name, one in given.items() if name in MOTIONS), ("", None))
    amplitude = _amplitude(survey, column.name, said)
    if amplitude is not None and not amplitude.unit:
        return name or "displacement", "", "", ""
    if said is not None and said.unit and stated_amplitude(said.unit) is None:
        stated, source = said.unit, "you said so"
    elif amplitude is not None:
        stated, source = amplitude.unit, f"the file states {amplitude.text}"
    else:
        read = read_column(column).unit
        stated, source = column.unit or read.text, read.source or "the file states it"
    above, drive = _per_drive(stated)
    if drive:
        return name or quantity_of(above), above, f"the file states {stated}", drive
    unit = unit_of_amplitude(stated)
    quantity = quantity_of(unit) if unit else ""
    return name or (quantity if quantity in MOTIONS else "displacement"), unit, source, ""


def _per_drive(stated: str) -> tuple[str, str]:
    """Return the units of the response and of the drive whose ratio a unit is; "", "": it is no such ratio."""
    above, slash, drive = stated.rpartition("/")
    unit = unit_of_amplitude(above.strip("() ")) if slash else ""
    whole = unit_of_amplitude(stated)
    if not unit or quantity_of(unit) not in MOTIONS or (whole and quantity_of(whole) in MOTIONS):
        return "", ""
    return unit, drive.strip("() ")


def _drive(
    columns: SweepColumns, survey: Survey, given: dict[str, Given], per_drive: str
) -> SignalGuess | None:
    """Return the drive: the column of its amplitude, or of a response per drive its unit alone; None without."""
    if (one := given.get("drive")) is not None:
        return _drive_of(survey, one.column, one)
    used = {columns.frequency, *columns.parts.values()}
    for name, column in survey.numeric.items():
        amplitude = amplitude_of(column)
        unit = unit_of_amplitude(amplitude.unit) if amplitude is not None else ""
        called = "drive" in read_column(column).votes or (unit and quantity_of(unit) == "drive")
        if name not in used and called:
            return _drive_of(survey, name, None)
    if not per_drive:
        return None
    return SignalGuess(name="drive", role="input", column=NO_COLUMN, why="no column has it", unit=per_drive)


def _drive_at(levels: Sequence[DriveLevel]) -> SignalGuess:
    """Return the drive whose amplitude each record has."""
    return SignalGuess(
        name="drive", role="input", column=NO_COLUMN, why="no column has it, drive_amplitude of each record does",
        unit=levels[0].unit, unit_source=f"{levels[0].why}",
    )  # fmt: skip


def _drive_of(survey: Survey, column: str, given: Given | None) -> SignalGuess:
    """Return the drive whose amplitude is a column."""
    amplitude = _amplitude(survey, column, given)
    read = read_column(survey.columns[column]).unit
    unit, source = read.text, read.source
    if amplitude is not None:
        unit, source = unit_of_amplitude(amplitude.unit), f"the file states {amplitude.text}"
    if given is not None and given.unit and stated_amplitude(given.unit) is None:
        unit = given.unit if amplitude is None or amplitude.unit else ""
    return SignalGuess(
        name="drive", role="input", column=column, why="its amplitude" if given is None else "you said so",
        unit=unit, unit_source="" if given is not None and given.unit else source, amplitude_unit=_written(amplitude),
    )  # fmt: skip


def _keys(
    columns: SweepColumns, survey: Survey, *, per_drive: bool
) -> tuple[tuple[tuple[str, str | bool], ...], tuple[str, ...]]:
    """Return the keys of the response's table, and what was guessed of them."""
    keys: list[tuple[str, str | bool]] = list(columns.parts.items())
    unsure: list[str] = []
    if (phase := columns.parts.get("phase")) is not None:
        column = survey.columns[phase]
        stated = read_column(column).unit.text
        values = column.values if column.values is not None else np.empty(0)
        large = bool(np.abs(values[np.isfinite(values)]).max(initial=0.0) > MOST_RADIANS)
        unit = "deg" if stated.startswith("deg") or (stated != "rad" and large) else "rad"
        if stated and not stated.startswith("deg") and not same_unit(stated, "rad"):
            raise InputError(
                f'{survey.path}: column "{phase}" is a phase in {stated}; export it in degrees or radians, and write '
                'the unit behind its name: "Phase (deg)"'
            )
        keys.append(("phase_unit", unit))
        if not stated:
            unsure.append(f'phase: nobody states the unit of "{phase}"; by its size it is {unit}')
    unsure.append('phase: a response that lags is taken to have a phase below 0; else add phase_sign = "lag"')
    if per_drive:
        keys.append(("per_drive", True))
    return tuple(keys), tuple(unsure)


def _records(
    columns: SweepColumns, surveys: Sequence[Survey], answers: Answers, levels: Sequence[DriveLevel] | None
) -> tuple[RecordGuess, ...]:
    """Return one record for each run of frequencies; of several the last one is for the test."""
    found = []
    for which, survey in enumerate(surveys):
        values = survey.columns[columns.frequency].values if columns.frequency in survey.columns else None
        runs = _runs(values) if values is not None else []
        if not runs:
            raise InputError(
                f'{survey.path}: has no sweep in a column "{columns.frequency}", as {surveys[0].path} has'
            )
        level = levels[which] if levels else None
        found += [(survey, level, rows if len(runs) > 1 else None) for rows in runs]
    last = len(found) - 1 if len(found) > 1 and answers.test != "none" else -1
    return tuple(
        RecordGuess(
            file=survey.path,
            use="test" if k == last else "fit",
            why="the last sweep" if k == last else "",
            rows=rows,
            drive_amplitude=level and level.amplitude,
            drive_why=level.why if level else "",
        )
        for k, (survey, level, rows) in enumerate(found)
    )
