"""What the data do not allow, found before the search, in words: too short, one tone, clipped, nothing moves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from rtctl.border.errors import InputError
from rtctl.diagnosis.problem.subject import Subject
from rtctl.diagnosis.screening.spikes import without_spikes
from rtctl.identification.fit_record import FitRecord, make_fit_record
from rtctl.measured.dataset import Dataset, Record

LEAST_SAMPLES = 200
LEAST_PERIODS = 5.0
CLIPPED_SHARE = 0.005
CLIPPED_PILE = 4.0
"""Times as many samples as at any of the levels beside it: even a quantised sine has no more than 2.4."""
ANOTHER_INPUT = 0.05
"""Of a drive's RMS, by which repeats of one input may differ."""
TONE_SHARE = 0.995
"""Of the drive's power in one line."""
ANOTHER_SLOPE = 0.3
"""Of itself, by which a displacement's slope may differ from the velocity that was read."""
CERTAIN = 6.0
"""Standard errors of a correlation, where one sample in TOGETHER is a reading of its own."""
TOGETHER = 10.0


def split(
    dataset: Dataset, subject: Subject
) -> tuple[tuple[FitRecord, ...], tuple[FitRecord, ...], list[str]]:
    """Records to fit, records to test on, warnings; where none is marked, the last is held out, and that is said."""
    usable = [record for record in dataset.records if record.samples - record.ignore_first >= LEAST_SAMPLES]
    warnings = [
        f"record {record.name} has {record.samples - record.ignore_first} scored samples, fewer than "
        f"{LEAST_SAMPLES}, and was left out"
        for record in dataset.records
        if record not in usable
    ]
    usable, spikes = without_spikes(usable, subject.spikes_of, dataset.units)
    usable, still = _moving(usable, subject)
    usable, unlike = _repeating(usable, subject.drive)
    warnings += spikes + still + unlike + _impossible(usable, dataset.units) + _another_motion(usable)
    fit = [record for record in usable if record.use == "fit"]
    fit = fit or [record for record in usable if record.use != "test"]
    tests = [record for record in usable if record.use == "test"]
    if not fit:
        raise InputError(
            "\n".join(
                [
                    f'{dataset.path}: no record with use = "fit" can be diagnosed; {LEAST_SAMPLES} samples of a '
                    f"moving {subject.signal} are needed",
                    *warnings,
                ]
            )
        )
    if subject.is_at_rest_undriven and not any(record.signals[subject.drive].any() for record in fit):
        raise InputError(
            f"{dataset.path}: the {subject.drive} of every record to fit is 0 {dataset.units[subject.drive]}: nothing "
            f"acts on the device, and nothing can be diagnosed. Is the {subject.drive} in the right column? If so, "
            "record with one that changes"
        )
    if not tests and len(fit) > 1:
        tests = [fit.pop()]
        warnings.append(
            f'no record has use = "test": {tests[0].name} was held out of the fit to measure the gain'
        )
    elif not tests:
        warnings.append(
            'one record and none with use = "test": the gain could not be measured; add a record at another amplitude'
        )
    for name in subject.clipping_of:
        warnings += _clipped((*fit, *tests), name, dataset.units[name])
    if all(np.ptp(record.signals[subject.drive]) == 0.0 for record in fit):
        warnings.append(
            f"the {subject.drive} of every record to fit is one constant number: what it does, and most causes, are "
            "only seen while it changes"
        )
    warnings += _one_tone(fit, subject.drive)
    holds = dataset.holds
    return (
        tuple(make_fit_record(r, holds) for r in fit),
        tuple(make_fit_record(r, holds) for r in tests),
        warnings,
    )


def _moving(records: Sequence[Record], subject: Subject) -> tuple[list[Record], list[str]]:
    """Those with an output that moves, and what is wrong with the others."""
    name, good, warnings = subject.signal, list[Record](), list[str]()
    for record in records:
        if not record.has(name):
            warnings.append(f"record {record.name} has no {name} and was left out")
        elif np.ptp(record.signals[name][record.ignore_first :]) == 0.0:
            warnings.append(f"record {record.name}: the {name} is one constant number; it was left out")
        else:
            good.append(record)
    return good, warnings


def _repeating(records: Sequence[Record], drive: str) -> tuple[list[Record], list[str]]:
    """Without the letters of `repeat` under which the inputs are not one."""
    wrong, warnings = set(), []
    for letter in dict.fromkeys(record.repeat for record in records if record.repeat is not None):
        group = [record for record in records if record.repeat == letter]
        samples = min(record.samples for record in group)
        drives = np.stack([record.signals[drive][:samples] for record in group])
        size = float(np.sqrt(np.mean(drives**2)))
        apart = float(np.sqrt(np.mean((drives - drives[0]) ** 2, axis=1)).max())
        if apart > ANOTHER_INPUT * size:
            wrong.add(letter)
            warnings.append(
                f'records {", ".join(one.name for one in group)} have repeat = "{letter}", and their {drive}s differ '
                f"by up to {apart / size:.0%} (RMS): they are no repeats of one input, and were not taken for such"
            )
    return [replace(one, repeat=None) if one.repeat in wrong else one for one in records], warnings


def _impossible(records: Sequence[Record], units: Mapping[str, str]) -> list[str]:
    """Resistances that are not above zero."""
    found = {
        r.name: int(np.count_nonzero(r.signals["resistance"] <= 0.0)) for r in records if r.has("resistance")
    }
    names = [name for name, count in found.items() if count]
    if not names:
        return []
    return [
        f"{', '.join(names)}: {sum(found.values())} readings of the resistance are 0 {units['resistance']} or less, "
        "which no film has: are its column, unit and sign right, was the reader in range?"
    ]


def short(records: Sequence[FitRecord], rate: float) -> list[str]:
    """Warning where all records together are a few periods of the motion (`rate` [1/s])."""
    duration = sum((record.samples - record.first) * record.period_s for record in records)
    periods = duration * rate / (2.0 * np.pi)
    if periods >= LEAST_PERIODS:
        return []
    return [
        f"the fit records hold {periods:.2g} periods of the motion, {duration:.3g} s: slow or weak effects and the "
        "damping cannot be told from the start; record longer"
    ]


def _another_motion(records: Sequence[Record]) -> list[str]:
    """Velocities that are no slope of the displacement beside them, by any share of noise in both (Frisch's bounds)."""
    found: dict[str, float] = {}
    for record in (one for one in records if one.has("velocity") and one.has("displacement")):
        slope = np.gradient(record.signals["displacement"], record.period_s)
        velocity = record.signals["velocity"] - record.signals["velocity"].mean()
        sizes = float(slope.std()), float(velocity.std())
        alike = float(np.mean((slope - slope.mean()) * velocity)) / max(sizes[0] * sizes[1], 1e-300)
        if abs(alike) < CERTAIN * np.sqrt(
            TOGETHER / record.samples
        ):  # or nothing of the motion is seen in one of them
            continue
        least, most = (sizes[0] / sizes[1] * share for share in (abs(alike), 1.0 / abs(alike)))
        if alike < 0.0 or least > 1.0 + ANOTHER_SLOPE or most < 1.0 - ANOTHER_SLOPE:
            found[record.name] = float(np.copysign(sizes[0] / sizes[1], alike))
    if not found:
        return []
    return [
        f"{', '.join(found)}: the displacement's slope is {next(iter(found.values())):.3g} times the velocity that was "
        "read beside it: are the velocity's unit, sign and column right, and both of one motion?"
    ]


def _clipped(records: Sequence[Record], output: str, unit: str) -> list[str]:
    """Readings that pile up at exactly the largest or smallest value of a record, one note for each such value."""
    piles: dict[tuple[str, float], list[tuple[str, int]]] = {}
    for record, (side, sign) in product(records, (("largest", 1.0), ("smallest", -1.0))):
        values = sign * record.signals[output]
        levels, counts = np.unique(values, return_counts=True)
        beside = counts[-4:-1].max() if len(counts) > 1 else 0
        if len(levels) > 8 and counts[-1] >= max(10, CLIPPED_SHARE * len(values), CLIPPED_PILE * beside):
            piles.setdefault((side, sign * float(levels[-1])), []).append((record.name, int(counts[-1])))
    return [
        f"{'record' if len(found) == 1 else 'records'} {', '.join(name for name, _ in found)}: "
        f"{sum(count for _, count in found)} readings are exactly the {side} value, {value:.5g} {unit}: a clipped "
        "sensor; what it hid cannot be diagnosed, and the clipping itself may be named as sensor.saturation"
        for (side, value), found in piles.items()
    ]


def _one_tone(records: Sequence[Record], name: str) -> list[str]:
    """Drives that are all the same single line."""
    lines = []
    for record in records:
        drive = record.signals[name] - record.signals[name].mean()
        power = np.abs(np.fft.rfft(drive * np.hanning(len(drive)))) ** 2
        top = int(np.argmax(power))
        total = float(power.sum())
        if not total > 0.0:
            continue
        if power[max(0, top - 3) : top + 4].sum() < TONE_SHARE * total or top < 4:
            return []
        lines.append((top / (len(drive) * record.period_s), float(np.std(drive))))
    frequencies, sizes = (np.array([line[k] for line in lines]) for k in (0, 1))
    if not lines or np.ptp(frequencies) > 0.02 * frequencies.mean() or np.ptp(sizes) > 0.05 * sizes.mean():
        return []
    return [
        f"every fit record is driven by the same tone of {frequencies.mean():.4g} Hz at one level: once it is "
        "steady it says no more than one complex compliance and its harmonics; what changes with frequency or "
        "amplitude (a delay, a lag, most nonlinear terms) cannot be told apart. Add a sweep or a multisine at two "
        "levels"
    ]
